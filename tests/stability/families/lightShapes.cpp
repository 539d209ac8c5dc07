// Shapes of lights where sampling them is hard: tiny, far, touched, stretched. Irradiance from
// quadrature over their own samples in float against closed forms, and densities told twice.
#include "families.h"

#include <algorithm>

#include "oracle.h"
#include "shading/lightShapes.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;

constexpr double kPiExact = 3.14159265358979323846;

/// Irradiance at p with normal n under radiance 1, by a grid of the shape's samples.
template <class Shape>
double irradiance(const Shape& shape, const Float3& p, const Float3& n, int grid = 256) {
    double sum = 0.0;
    for (int y = 0; y < grid; ++y) {
        for (int x = 0; x < grid; ++x) {
            const Float2 u((static_cast<float>(x) + 0.5F) / static_cast<float>(grid),
                           (static_cast<float>(y) + 0.5F) / static_cast<float>(grid));
            const ShapeSample<float> s = shape.sample(p, u);
            const double cosine = std::max(static_cast<double>(dot(s.wi, n)), 0.0);
            if (s.pdf > 0.0F && dot(s.normal, s.wi) < 0.0F) {
                sum += cosine / static_cast<double>(s.pdf);
            }
        }
    }
    return sum / (static_cast<double>(grid) * grid);
}

/// A shape of T with axes along the world's, `half` its half extents.
template <template <class> class Shape>
Shape<float> placed(const Float3& center, const Double3& half) {
    const Shape<double> exact(Double3(center), {half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z});
    return Shape<float>(exact);
}

/// A square facing down at the given height above the receiver at the origin of the plane z = 0.
RectShape<float> ceiling(float height, double half) {
    const RectShape<double> exact({0, 0, static_cast<double>(height)}, {half, 0, 0}, {0, half, 0},
                                  {0, 0, -1});
    return RectShape<float>(exact);
}

/// Form factor of a parallel square seen from below its centre (Howell, configuration C-11).
double squareAbove(double half, double height) {
    const double a = half / height;
    const double r = std::sqrt(1.0 + a * a);
    return 4.0 * kPiExact * (1.0 / (2.0 * kPiExact)) * 2.0 * (a / r) * std::atan(a / r);
}

void checkSquare(Report& report, float height, double half) {
    const double truth = squareAbove(half, static_cast<double>(height));
    const double e = irradiance(ceiling(height, half), Float3(0.0F), {0, 0, 1});
    report.error(relativeError(e, truth), [&] { return Text().add("E", e).add("exact", truth); });
}

/// A sphere that touches the floor, seen from the floor at some distances from where it does:
/// E = pi R^3 / (x^2 + R^2)^1.5.
void checkTangentSphere(Report& report, double radius) {
    const auto sphere =
        placed<EllipsoidShape>({0, 0, static_cast<float>(radius)}, {radius, radius, radius});
    for (const double share : {10.0, 1.0, 0.1, 1e-2, 1e-3}) {
        const double x = share * radius;
        const double truth =
            kPiExact * std::pow(radius, 3.0) / std::pow(x * x + radius * radius, 1.5);
        const double e = irradiance(sphere, {static_cast<float>(x), 0, 0}, {0, 0, 1});
        report.error(relativeError(e, truth), [&] {
            return Text().add("distance/radius", share).add("E", e).add("exact", truth);
        });
    }
}

/// A sphere above: E = pi (R / d)^2, however far.
void checkFarSphere(Report& report, double radius, float height) {
    const auto sphere = placed<EllipsoidShape>({0, 0, height}, {radius, radius, radius});
    const double truth = kPiExact * sqr(radius / static_cast<double>(height));
    const double e = irradiance(sphere, Float3(0.0F), {0, 0, 1});
    report.error(relativeError(e, truth), [&] { return Text().add("E", e).add("exact", truth); });
}

/// Radiance 1 arrives from every direction that sees the sphere; just above its surface, from all
/// of the hemisphere: E = pi (R / (R + h))^2 for a receiver that faces it.
void checkNearSphere(Report& report, double gap) {
    const double radius = 1.0;
    const auto sphere = placed<EllipsoidShape>(Float3(0.0F), {radius, radius, radius});
    for (int i = 0; i < 20; ++i) {
        TestRandom random(static_cast<std::uint64_t>(i));
        const Double3 up(uniformSphere(random.nextFloat2()));
        const Float3 p(up * (radius + gap));
        const double distance = length(Double3(p));
        const double truth = kPiExact * sqr(radius / distance);
        const double e = irradiance(sphere, p, -Float3(up));
        report.error(relativeError(e, truth),
                     [&] { return Text().add("E", e).add("exact", truth); });
    }
}

/// An ellipsoid of uniform radiance lights like the sphere it is the image of, seen along a
/// symmetry axis of both: the solid angle by fine quadrature of the projected ellipse's cone.
void checkStretched(Report& report, const Double3& half, float height) {
    const auto shape = placed<EllipsoidShape>({0, 0, height}, half);
    // From the axis the silhouette is an elliptic cone: with s = c / sqrt(h^2 - c^2), tangents
    // a s / c and b s / c. E is the integral of the cosine over it, pi A B / sqrt((1+A^2)(1+B^2)).
    const double h = static_cast<double>(height), s = std::sqrt(h * h - half.z * half.z);
    const double a = half.x / s, b = half.y / s;
    const double truth = kPiExact * a * b / std::sqrt((1.0 + a * a) * (1.0 + b * b));
    const double e = irradiance(shape, Float3(0.0F), {0, 0, 1}, 1024);
    report.error(relativeError(e, truth), [&] { return Text().add("E", e).add("exact", truth); });
}

/// A thin tube overhead: with radius r much below the distance h and half length l,
/// E = 2 r / h (l h / (l^2 + h^2) + atan(l / h)) of a line that emits as a cylinder does.
void checkTube(Report& report, double radius, double half, float height) {
    const auto tube = placed<CylinderShape>({0, 0, height}, {half, radius, radius});
    const double h = static_cast<double>(height), l = half;
    // Facing the tube: integral of cos^2 over the line; the tube's width is 2 r sin(theta).
    const double truth = 2.0 * radius / h * (l * h / (l * l + h * h) + std::atan(l / h));
    const double e = irradiance(tube, Float3(0.0F), {0, 0, 1});
    report.error(relativeError(e, truth), [&] { return Text().add("E", e).add("exact", truth); });
}

/// The density that a ray finds at what it meets, against that of the sample that led it there.
template <class Shape, class Pdf>
void checkDensities(Report& report, const Shape& shape, const Float3& center, double distance,
                    const Pdf& pdf) {
    TestRandom random(61);
    for (int i = 0; i < 4000; ++i) {
        const Float3 p(Double3(center) + Double3(uniformSphere(random.nextFloat2())) * distance);
        const ShapeSample<float> s = shape.sample(p, random.nextFloat2());
        if (!(s.pdf > 0.0F) || !(dot(s.normal, s.wi) < -0.05F)) {
            continue;
        }
        const float t = shape.intersect(p, s.wi, 0.0F, std::numeric_limits<float>::infinity());
        if (!(t > 0.0F)) {
            continue; // past the edge by a rounding
        }
        const auto found = static_cast<double>(pdf(p, s.wi, p + s.wi * t));
        report.error(relativeError(found, static_cast<double>(s.pdf)), [&] {
            return Text()
                .add("sampled", s.pdf)
                .add("found", found)
                .add("cosine", dot(s.normal, s.wi));
        });
    }
}

void addDensities(Catalogue& catalogue) {
    const auto add = [&](const std::string& name, double budget, const std::string& reason,
                         std::function<void(Report&)> run) {
        catalogue.push_back({"light-shape/density-" + name,
                             "density of a point that a ray met against that of sampling it, "
                             "relative; at cosines above 0.05",
                             budget, reason, std::move(run)});
    };
    // Whatever condition the shape's own space has, both densities are of the same point in it.
    const std::string rounding = "about ten roundings of the distance, 20 times that at the cosine";
    constexpr double kBudget = 1.2e-5;
    add("sphere-far", kBudget, rounding, [](Report& report) {
        const auto s = placed<EllipsoidShape>({5, 0, 0}, {0.01, 0.01, 0.01});
        checkDensities(report, s, {5, 0, 0}, 1e3,
                       [&](const auto& p, const auto& w, const auto& q) { return s.pdf(p, w, q); });
    });
    add("sphere-near", kBudget, rounding, [](Report& report) {
        const auto s = placed<EllipsoidShape>({5, 0, 0}, {1, 1, 1});
        checkDensities(report, s, {5, 0, 0}, 1.001,
                       [&](const auto& p, const auto& w, const auto& q) { return s.pdf(p, w, q); });
    });
    add("ellipsoid-1e3", kBudget, rounding, [](Report& report) {
        const auto s = placed<EllipsoidShape>(Float3(0.0F), {1.0, 1e-2, 10.0});
        checkDensities(report, s, Float3(0.0F), 30.0,
                       [&](const auto& p, const auto& w, const auto& q) { return s.pdf(p, w, q); });
    });
    add("tube-1e-6", kBudget, rounding, [](Report& report) {
        const auto s = placed<CylinderShape>(Float3(0.0F), {1.0, 1e-6, 1e-6});
        checkDensities(report, s, Float3(0.0F), 2.0,
                       [&](const auto& p, const auto&, const auto& q) { return s.pdf(p, q); });
    });
    add("rect-tiny", kBudget, rounding, [](Report& report) {
        const auto s = ceiling(3.0F, 5e-5);
        checkDensities(report, s, {0, 0, 3}, 10.0,
                       [&](const auto& p, const auto&, const auto& q) { return s.pdf(p, q); });
    });
}

} // namespace

void addLightShapes(Catalogue& catalogue) {
    const auto add = [&](const std::string& name, double budget, const std::string& reason,
                         std::function<void(Report&)> run) {
        catalogue.push_back({"light-shape/" + name,
                             "irradiance of the shape's samples in float against the closed form, "
                             "relative",
                             budget, reason, std::move(run)});
    };
    const std::string exact = "the estimator has no variance there: some tens of roundings";
    const std::string grid = "cosines are linear in the numbers but for an angle over which "
                             "midpoints cancel: some tens of roundings";
    constexpr double kTens = 2e-6;
    for (const auto& [name, height, half] :
         {std::tuple("square-area-1e-8", 1.0F, 5e-5), std::tuple("square-area-1e-16", 1.0F, 5e-9),
          std::tuple("square-1e-4-away-1e6", 1e6F, 5e-5)}) {
        add(name, kTens, exact,
            [height = height, half = half](Report& report) { checkSquare(report, height, half); });
    }
    add("sphere-tangent-1", kTens, grid, [](Report& report) { checkTangentSphere(report, 1.0); });
    add("sphere-tangent-1e-6", kTens, grid,
        [](Report& report) { checkTangentSphere(report, 1e-6); });
    add("sphere-tangent-1e6", kTens, grid, [](Report& report) { checkTangentSphere(report, 1e6); });
    add("sphere-1e-3-away-1e6", kTens, exact,
        [](Report& report) { checkFarSphere(report, 1e-3, 1e6F); });
    add("sphere-1e-8-away-1", kTens, exact,
        [](Report& report) { checkFarSphere(report, 1e-8, 1.0F); });
    for (const auto& [name, gap] :
         {std::pair("1e-2", 1e-2), std::pair("1e-4", 1e-4), std::pair("1e-6", 1e-6)}) {
        add(std::string("sphere-gap-") + name, kTens,
            "the square of the cone's cosine is 1 - 1/d^2, and the irradiance 1 less that: "
            "some tens of roundings, although the cosine itself cancels",
            [gap = gap](Report& report) { checkNearSphere(report, gap); });
    }
    add("ellipsoid-flat-1e4", kTens, grid, [](Report& report) {
        checkStretched(report, {1.0, 1.0, 1e-4}, 2.0F);
    });
    add("ellipsoid-long-1e3", kTens, grid, [](Report& report) {
        checkStretched(report, {1.0, 1e-3, 0.1}, 2.0F);
    });
    add("tube-1e-4", 1e-4, "the closed form is that of a line: off by a radius over the distance",
        [](Report& report) { checkTube(report, 1e-4, 1.0, 1.0F); });
    add("tube-1e-6", 1e-5, "a grid of 256 midpoints along the tube",
        [](Report& report) { checkTube(report, 1e-6, 1.0, 1.0F); });
    add("tube-1e-9", 1e-5, "as above", [](Report& report) { checkTube(report, 1e-9, 1.0, 1.0F); });
    add("tube-endless", 1e-6, "the closed form is off by the square of radius over distance, 1e-8",
        [](Report& report) { checkTube(report, 1e-3, 1e6, 10.0F); });
    addDensities(catalogue);
}

} // namespace mbfeat::stability
