#include "shading/lightShapes.h"

#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

using Batch = xsimd::batch<float>;

template <class T>
Vec3<T> v3(double x, double y, double z) {
    return {T(static_cast<float>(x)), T(static_cast<float>(y)), T(static_cast<float>(z))};
}

// One skewed, unevenly scaled and mirrored placement of each shape.
template <class T>
RectShape<T> rectShape() {
    return {v3<T>(0.5, 1.0, 2.0), v3<T>(0.8, 0.2, 0.0), v3<T>(0.1, 0.3, 0.2), v3<T>(0, 0, -1)};
}
template <class T>
DiskShape<T> diskShape() {
    return {v3<T>(-0.5, 0.4, 1.5), v3<T>(0.9, 0.0, 0.1), v3<T>(0.2, -0.4, 0.0), v3<T>(0, 0, -1)};
}
template <class T>
EllipsoidShape<T> ellipsoidShape() {
    return {v3<T>(0.3, -0.2, 2.0), v3<T>(0.9, 0.1, 0.0), v3<T>(0.2, -0.5, 0.1),
            v3<T>(0.0, 0.1, 0.3)};
}
template <class T>
CylinderShape<T> cylinderShape() {
    return {v3<T>(0.2, 0.3, 1.5), v3<T>(1.2, 0.2, 0.3), v3<T>(0.0, 0.4, 0.1),
            v3<T>(0.1, 0.0, -0.7)};
}
template <class T>
TriangleShape<T> triangleShape() {
    return {v3<T>(-0.5, -0.5, 1.0), v3<T>(1.0, 0.0, 1.5), v3<T>(0.0, 0.8, 1.2), Mask<T>(true)};
}

const std::vector<Float3> kReceivers{
    {0.0F, 0.0F, 0.0F}, {1.5F, -0.7F, 0.6F}, {-3.0F, 2.0F, -4.0F}, {0.4F, 0.9F, 1.3F}};

template <class Shape>
float pdfAt(const Shape& shape, const Float3& p, const Float3& wi, const Float3& point) {
    if constexpr (std::is_same_v<Shape, EllipsoidShape<float>>) {
        return shape.pdf(p, wi, point);
    } else {
        return shape.pdf(p, point);
    }
}

/// Moller-Trumbore free: solves for the plane, then for the weights by areas.
float intersectTriangle(const TriangleShape<float>& s, const Float3& o, const Float3& d) {
    const Double3 n = cross(Double3(s.p1) - Double3(s.p0), Double3(s.p2) - Double3(s.p0));
    const double t = dot(Double3(s.p0) - Double3(o), n) / dot(Double3(d), n);
    const Double3 q = Double3(o) + Double3(d) * t;
    const double b1 = dot(cross(q - Double3(s.p0), Double3(s.p2) - Double3(s.p0)), n);
    const double b2 = dot(cross(Double3(s.p1) - Double3(s.p0), q - Double3(s.p0)), n);
    const double full = dot(n, n);
    return t > 0.0 && b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= full ? static_cast<float>(t) : -1.0F;
}

template <class Shape>
float distanceTo(const Shape& shape, const Float3& p, const Float3& wi) {
    if constexpr (std::is_same_v<Shape, TriangleShape<float>>) {
        return intersectTriangle(shape, p, wi);
    } else {
        return shape.intersect(p, wi, 0.0F, 1e30F);
    }
}

/// Density as a ray would find it: intersect, then ask for the pdf of the point.
template <class Shape>
double rayDensity(const Shape& shape, const Float3& p, const Float3& wi) {
    const float t = distanceTo(shape, p, wi);
    return t > 0.0F ? pdfAt(shape, p, wi, p + wi * t) : 0.0;
}

/// Directions of samples against the density that rays find, from several receivers.
template <class Shape>
void checkSampling(const Shape& shape, const Float3& centre) {
    int seen = 0;
    for (const Float3& p : kReceivers) {
        INFO("receiver " << p.x << " " << p.y << " " << p.z);
        TestRandom probe(1);
        int visible = 0;
        for (int i = 0; i < 100; ++i) {
            visible += shape.sample(p, probe.nextFloat2()).pdf > 0.0F ? 1 : 0;
        }
        const ShapeSample<float> middle = shape.sample(p, {0.5F, 0.5F});
        const float slope = std::abs(dot(middle.normal, normalize(middle.point - p)));
        if (visible == 0 || slope < 0.05F) {
            // Nothing is seen, or a flat shape edge on: a sliver too thin for the bins.
            continue;
        }
        ++seen;
        // A cap that holds the shape, so that bins are not wasted on empty directions.
        const Float3 axis = normalize(centre - p);
        float cosMin = 1.0F;
        for (int i = 0; i < 4000; ++i) {
            const Float3 d = shape.sample(p, probe.nextFloat2()).point - p;
            cosMin = min(cosMin, dot(normalize(d), axis));
        }
        cosMin = max(cosMin - 0.05F * (1.0F - cosMin) - 1e-5F, -1.0F);
        checkPassed(chiSquaredCap(
            [&](TestRandom& random) -> std::optional<Float3> {
                const ShapeSample<float> s = shape.sample(p, random.nextFloat2());
                if (!(s.pdf > 0.0F)) {
                    return std::nullopt;
                }
                return s.wi;
            },
            [&](const Float3& wi) { return rayDensity(shape, p, wi); }, axis, cosMin, 20, 24,
            200000));
    }
    CHECK(seen >= 2);
}

/// Every sample is met by a ray at its distance, with its pdf.
template <class Shape>
void checkAgreement(const Shape& shape, double pdfTolerance) {
    TestRandom random(11);
    int checked = 0, missed = 0;
    for (int i = 0; i < 8000; ++i) {
        const Float3& p = kReceivers[static_cast<std::size_t>(i) % kReceivers.size()];
        const ShapeSample<float> s = shape.sample(p, random.nextFloat2());
        CHECK(std::abs(length(s.wi) - 1.0F) < 1e-6F);
        if (!(s.pdf > 0.0F) || std::abs(dot(s.normal, s.wi)) < 0.02F) {
            continue;
        }
        const float t = distanceTo(shape, p, s.wi);
        if (t < 0.0F) {
            ++missed; // samples on the very rim may be missed by rounding
            continue;
        }
        ++checked;
        REQUIRE(isNear(t, s.distance, 2e-4));
        REQUIRE(isNear(pdfAt(shape, p, s.wi, s.point), s.pdf, pdfTolerance));
        REQUIRE(length(p + s.wi * t - s.point) < 1e-3F);
    }
    CHECK(checked > 1000);
    CHECK(missed * 200 < checked);
}

template <class T>
struct Evaluation {
    Vec3<T> wi;
    T distance, pdf;
};

/// The same sample in three lane types.
template <template <class> class Shape>
void checkLaneTypes(const Shape<float>& single, const Shape<double>& exact,
                    const Shape<Batch>& wide, double tolerance) {
    TestRandom random(21);
    int compared = 0;
    for (int i = 0; i < 4000; ++i) {
        const Float3& p = kReceivers[static_cast<std::size_t>(i) % kReceivers.size()];
        const Float2 u = random.nextFloat2();
        const ShapeSample<float> a = single.sample(p, u);
        const ShapeSample<double> b = exact.sample(Double3(p), Vec2<double>(u.x, u.y));
        const ShapeSample<Batch> c =
            wide.sample(v3<Batch>(p.x, p.y, p.z), Vec2<Batch>(Batch(u.x), Batch(u.y)));
        if (std::abs(dot(b.normal, b.wi)) < 0.05) {
            continue; // at grazing angles the pdf amplifies every rounding
        }
        ++compared;
        REQUIRE(isNear(a.pdf, b.pdf, tolerance));
        REQUIRE(isNear(c.pdf.get(0), b.pdf, tolerance));
        REQUIRE(length(Double3(a.point) - b.point) < 3e-6);
        REQUIRE(length(Double3(c.point.x.get(0), c.point.y.get(0), c.point.z.get(0)) - b.point) <
                3e-6);
        REQUIRE(length(Double3(a.wi) - b.wi) < 1e-5);
        REQUIRE(isNear(a.distance, b.distance, 1e-5));
    }
    CHECK(compared > 1000);
}

} // namespace

TEST_CASE("samples of light shapes follow the density that rays find") {
    checkSampling(rectShape<float>(), {0.5F, 1.0F, 2.0F});
    checkSampling(diskShape<float>(), {-0.5F, 0.4F, 1.5F});
    checkSampling(ellipsoidShape<float>(), {0.3F, -0.2F, 2.0F});
    checkSampling(cylinderShape<float>(), {0.2F, 0.3F, 1.5F});
    checkSampling(triangleShape<float>(), {0.2F, 0.1F, 1.2F});
}

TEST_CASE("rays along sampled directions meet the sampled point with the sampled pdf") {
    checkAgreement(rectShape<float>(), 1e-4);
    checkAgreement(diskShape<float>(), 1e-4);
    checkAgreement(ellipsoidShape<float>(), 1e-4);
    checkAgreement(cylinderShape<float>(), 2e-3);
    checkAgreement(triangleShape<float>(), 1e-4);
}

TEST_CASE("light shapes agree between float, double and SIMD lanes") {
    checkLaneTypes(rectShape<float>(), rectShape<double>(), rectShape<Batch>(), 5e-5);
    checkLaneTypes(diskShape<float>(), diskShape<double>(), diskShape<Batch>(), 5e-5);
    checkLaneTypes(ellipsoidShape<float>(), ellipsoidShape<double>(), ellipsoidShape<Batch>(),
                   5e-5);
    checkLaneTypes(cylinderShape<float>(), cylinderShape<double>(), cylinderShape<Batch>(), 2e-4);
    checkLaneTypes(triangleShape<float>(), triangleShape<double>(), triangleShape<Batch>(), 5e-5);
}

TEST_CASE("intersections agree between float, double and SIMD lanes") {
    const auto compare = [](const auto& single, const auto& exact, const auto& wide) {
        TestRandom random(31);
        int hits = 0;
        for (int i = 0; i < 6000; ++i) {
            const Float3& p = kReceivers[static_cast<std::size_t>(i) % kReceivers.size()];
            const Float3 d = uniformSphere(random.nextFloat2()) * 3.0F;
            const double b = exact.intersect(Double3(p), Double3(d), 0.0, 1e30);
            const float a = single.intersect(p, d, 0.0F, 1e30F);
            const float c = wide.intersect(v3<Batch>(p.x, p.y, p.z), v3<Batch>(d.x, d.y, d.z),
                                           Batch(0.0F), Batch(1e30F))
                                .get(0);
            REQUIRE(a == c);
            // The same answer, but for rays through the rim.
            if (b > 0.0 && a > 0.0F) {
                ++hits;
                REQUIRE(isNear(a, b, 1e-3));
            }
        }
        CHECK(hits > 50);
    };
    compare(rectShape<float>(), rectShape<double>(), rectShape<Batch>());
    compare(diskShape<float>(), diskShape<double>(), diskShape<Batch>());
    compare(ellipsoidShape<float>(), ellipsoidShape<double>(), ellipsoidShape<Batch>());
    compare(cylinderShape<float>(), cylinderShape<double>(), cylinderShape<Batch>());
}

TEST_CASE("rays from behind and from inside pass") {
    const RectShape<float> rect({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1});
    CHECK(rect.intersect({0.2F, 0.1F, -2.0F}, {0, 0, 1}, 0.0F, 10.0F) == 2.0F);
    CHECK(rect.intersect({0.2F, 0.1F, 2.0F}, {0, 0, -1}, 0.0F, 10.0F) == -1.0F);
    CHECK(rect.intersect({1.2F, 0.1F, -2.0F}, {0, 0, 1}, 0.0F, 10.0F) == -1.0F);
    CHECK(rect.intersect({0.2F, 0.1F, -2.0F}, {0, 0, 1}, 0.0F, 1.5F) == -1.0F);
    CHECK(rect.intersect({0.2F, 0.1F, -2.0F}, {0, 0, 1}, 2.5F, 10.0F) == -1.0F);
    const EllipsoidShape<float> sphere({0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2});
    CHECK(sphere.intersect({0, 0, -5}, {0, 0, 1}, 0.0F, 10.0F) == 3.0F);
    CHECK(sphere.intersect({0, 0, 1}, {0, 0, 1}, 0.0F, 10.0F) == -1.0F);
    CHECK(sphere.intersect({0, 0, 5}, {0, 0, 1}, 0.0F, 10.0F) == -1.0F);
    const CylinderShape<float> tube({0, 0, 0}, {3, 0, 0}, {0, 1, 0}, {0, 0, 1});
    CHECK(tube.intersect({0, 0, -5}, {0, 0, 1}, 0.0F, 10.0F) == 4.0F);
    CHECK(tube.intersect({4, 0, -5}, {0, 0, 1}, 0.0F, 10.0F) == -1.0F);
    // No caps: along the axis everything passes.
    CHECK(tube.intersect({-9, 0, 0}, {1, 0, 0}, 0.0F, 100.0F) == -1.0F);
}

TEST_CASE("samples of a sphere from inside are uniform over its surface") {
    const EllipsoidShape<float> sphere({0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2});
    const Float3 p(0.5F, -0.3F, 0.8F);
    checkPassed(chiSquaredSphere(
        [&](TestRandom& random) {
            return std::optional<Float3>(sphere.sample(p, random.nextFloat2()).point * 0.5F);
        },
        [](const Float3&) { return uniformSpherePdf<double>(); }));
    checkPassed(chiSquaredSphere(
        [&](TestRandom& random) {
            return std::optional<Float3>(sphere.sample(p, random.nextFloat2()).wi);
        },
        [&](const Float3& wi) {
            const float b = dot(p, wi);
            const float t = -b + std::sqrt(b * b - lengthSquared(p) + 4.0F);
            return sphere.pdf(p, wi, p + wi * t);
        }));
}

TEST_CASE("cones of distant lights are sampled uniformly, down to the sun and below") {
    for (const double degrees : {0.01, 0.53, 40.0, 200.0}) {
        const double s = std::sin(degrees * kPi / 720.0);
        const ConeShape<float> cone{normalize(Float3(0.3F, -0.8F, 0.5F)),
                                    static_cast<float>(2.0 * s * s)};
        INFO("angle " << degrees);
        // A float direction has a step of 6e-8; the narrowest disc is 1.7e-4 wide.
        const int bins = degrees < 0.1 ? 8 : 30;
        checkPassed(chiSquaredCap(
            [&](TestRandom& random) {
                return std::optional<Float3>(cone.sample(random.nextFloat2()));
            },
            [&](const Float3&) { return uniformConePdf<double>(2.0 * s * s); }, cone.axis,
            1.0 - 2.0 * s * s * 1.0001, bins, bins));
        TestRandom random(1);
        int inside = 0;
        for (int i = 0; i < 1000; ++i) {
            inside += cone.pdf(cone.sample(random.nextFloat2())) > 0.0F ? 1 : 0;
        }
        CHECK(inside >= 995);
        CHECK(cone.pdf(-cone.axis) == 0.0F);
    }
}

TEST_CASE("round lights light the same from any distance, as far as floats go") {
    // Seen from afar a sphere gives pi (r / d)^2, a tube over its middle pi r / d for a length
    // beyond all bounds and less for a short one. No sample may be lost to rounding.
    for (const double radius : {1e-3, 1e-6, 1e-9}) {
        INFO("radius " << radius);
        const EllipsoidShape<float> sphere(
            EllipsoidShape<double>({0, 0, 1}, {radius, 0, 0}, {0, radius, 0}, {0, 0, radius}));
        const CylinderShape<float> tube(
            CylinderShape<double>({0, 0, 1}, {1, 0, 0}, {0, radius, 0}, {0, 0, radius}));
        TestRandom random(4);
        double fromSphere = 0.0;
        constexpr int kCount = 2000;
        for (int i = 0; i < kCount; ++i) {
            const Float2 u = random.nextFloat2();
            const ShapeSample<float> s = sphere.sample(Float3(0.0F), u);
            REQUIRE(s.pdf > 0.0F);
            REQUIRE(dot(s.normal, s.wi) <= 0.0F);
            REQUIRE(std::abs(length(Double3(s.normal)) - 1.0) < 1e-6);
            fromSphere += static_cast<double>(s.wi.z) / static_cast<double>(s.pdf) / kCount;
            const ShapeSample<float> t = tube.sample(Float3(0.0F), u);
            REQUIRE(t.pdf > 0.0F);
            REQUIRE(dot(t.normal, t.wi) < 0.0F);
        }
        CHECK(fromSphere / (radius * radius) == doctest::Approx(kPi).epsilon(1e-4));
    }
}
