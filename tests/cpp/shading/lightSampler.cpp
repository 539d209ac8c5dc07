#include "shading/lightSampler.h"
#include "shading/preparedLight.h"

#include <limits>

#include "core/frame.h"
#include "core/warp.h"
#include "shading/lightShaping.h"
#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

using Lights = std::vector<std::shared_ptr<const Light>>;

/// A light of radiance 2 at `height` over the origin that shines down on the plane z = 0.
Light lightAbove(LightType type, double height = 2.0) {
    Light light;
    light.path = "/lights/one";
    light.type = type;
    light.radiance = Rgb(2.0F, 1.0F, 0.5F);
    light.toWorld.t = {0.0, 0.0, height};
    return light;
}

LightSampler committed(const Lights& lights, std::vector<EmissiveTriangle> triangles = {},
                       Double3 origin = Double3(0.0)) {
    LightSampler sampler;
    Diagnostics diagnostics;
    sampler.commit(lights, origin, 10.0F, std::move(triangles), diagnostics);
    CHECK(diagnostics.messages().empty());
    return sampler;
}

LightSampler committed(const Light& light) {
    return committed({std::make_shared<Light>(light)});
}

const LightReceiver kFloor{Float3(0.0F), Float3(0.0F, 0.0F, 1.0F), false};

/// Whether a light's own shape stands before the sampled point of another.
bool isOccluded(const LightSampler& sampler, const Float3& p, const LightSample& s) {
    for (std::uint32_t shape = 0; shape < sampler.shapeCount(); ++shape) {
        const float tFar = min(s.distance, 1e30F) * 0.999F;
        if (sampler.intersectShape(shape, p, s.wi, 0.0F, tFar) > 0.0F) {
            return true;
        }
    }
    return false;
}

/// Irradiance (red) by sampling the lights.
Statistics sampledIrradiance(const LightSampler& sampler, const LightReceiver& receiver = kFloor,
                             int samples = 200000) {
    TestRandom random(3);
    Statistics statistics;
    for (int i = 0; i < samples; ++i) {
        const LightSample s = sampler.sample(receiver, random.nextFloat(), random.nextFloat2());
        const bool lit = s.pdf > 0.0F && !isOccluded(sampler, receiver.p, s);
        statistics.add(lit ? s.radiance.x * max(dot(s.wi, receiver.n), 0.0F) / s.pdf : 0.0F);
    }
    return statistics;
}

/// What a ray sees of all lights that can be met, red.
float seen(const LightSampler& sampler, const LightReceiver& receiver, const Float3& wi) {
    float nearest = 1e30F;
    float radiance = sampler.environmentRadiance(wi, false).x;
    for (std::uint32_t shape = 0; shape < sampler.shapeCount(); ++shape) {
        const float t = sampler.intersectShape(shape, receiver.p, wi, 0.0F, nearest);
        if (t > 0.0F) {
            nearest = t;
            radiance = sampler.evaluateHit(sampler.lightOfShape(shape), receiver, wi, t).radiance.x;
        }
    }
    return radiance;
}

/// Irradiance by cosine-weighted directions: knows nothing of the sampling of lights.
Statistics hitIrradiance(const LightSampler& sampler, const LightReceiver& receiver = kFloor,
                         int samples = 400000) {
    TestRandom random(4);
    const auto frame = Frame<float>::fromNormal(receiver.n);
    Statistics statistics;
    for (int i = 0; i < samples; ++i) {
        const Float3 wi = frame.toWorld(cosineHemisphere(random.nextFloat2()));
        statistics.add(kPi * seen(sampler, receiver, wi));
    }
    return statistics;
}

void checkIrradiance(const LightSampler& sampler, double truth) {
    checkMean(sampledIrradiance(sampler), truth);
    checkMean(hitIrradiance(sampler), truth, 0.03);
}

/// Form factor of a rectangle parallel to a receiver below its corner (Howell, C-11).
double cornerFormFactor(double a, double b, double height) {
    const double x = a / height, y = b / height;
    const double rx = std::sqrt(1.0 + x * x), ry = std::sqrt(1.0 + y * y);
    return (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry)) / (2.0 * kPi);
}

AffineD rotation(double axisX, double axisY, double axisZ, double angle) {
    const Double3 k = normalize(Double3(axisX, axisY, axisZ));
    const auto rotate = [&](const Double3& v) {
        return v * std::cos(angle) + cross(k, v) * std::sin(angle) +
               k * (dot(k, v) * (1.0 - std::cos(angle)));
    };
    AffineD r;
    r.x = rotate({1.0, 0.0, 0.0});
    r.y = rotate({0.0, 1.0, 0.0});
    r.z = rotate({0.0, 0.0, 1.0});
    return r;
}

AffineD scaled(double x, double y, double z) {
    AffineD a;
    a.x = {x, 0.0, 0.0};
    a.y = {0.0, y, 0.0};
    a.z = {0.0, 0.0, z};
    return a;
}

/// Irradiance on the floor at the origin from an ellipsoid of radiance 1 with semi-axes (a, b, c)
/// above it, by brute force over the hemisphere.
double ellipsoidIrradiance(double a, double b, double c, double height) {
    // Directions that can meet it at all, so that the grid is fine where it matters.
    const double slope = height > c ? std::max(a, b) / (height - c) : 1e9;
    const double sin2Max = slope * slope / (1.0 + slope * slope);
    return integrate2D(
        [&](double sin2, double phi) {
            const double r = std::sqrt(sin2), z = std::sqrt(1.0 - sin2);
            const Double3 d{r * std::cos(phi) / a, r * std::sin(phi) / b, z / c};
            const Double3 o{0.0, 0.0, -height / c};
            const double along = dot(o, d), squared = dot(d, d);
            return along < 0.0 && along * along > squared * (dot(o, o) - 1.0) ? 0.5 : 0.0;
        },
        0.0, sin2Max, 0.0, 2.0 * kPi, 1e-7, 200);
}

} // namespace

TEST_CASE("rect lights give their analytic irradiance") {
    Light light = lightAbove(LightType::kRect);
    light.width = 3.0F;
    light.height = 1.0F;
    const double factor = 4.0 * cornerFormFactor(1.5, 0.5, 2.0);
    checkIrradiance(committed(light), 2.0 * kPi * factor);

    light.normalize = true;
    checkIrradiance(committed(light), 2.0 * kPi * factor / 3.0);

    // Twice as wide, half as high by the transform; normalize sees the world's area.
    light.toWorld = scaled(2.0, 0.5, 7.0);
    light.toWorld.t = {0.0, 0.0, 2.0};
    const double stretched = 4.0 * cornerFormFactor(3.0, 0.25, 2.0);
    checkIrradiance(committed(light), 2.0 * kPi * stretched / 3.0);
}

TEST_CASE("mirrored and flattened rect lights still emit along local -z") {
    for (const double z : {1.0, -1.0}) {
        for (const double x : {1.0, -1.0}) {
            Light light = lightAbove(LightType::kRect);
            light.toWorld = scaled(x, 1.0, z);
            light.toWorld.t = {0.0, 0.0, 2.0};
            const LightSampler sampler = committed(light);
            const double truth = 2.0 * kPi * 4.0 * cornerFormFactor(0.5, 0.5, 2.0);
            if (z > 0.0) {
                checkIrradiance(sampler, truth);
            } else {
                CHECK(sampledIrradiance(sampler).mean() == 0.0);
                CHECK(hitIrradiance(sampler).mean() == 0.0);
            }
        }
    }
    Light flat = lightAbove(LightType::kRect);
    flat.toWorld = scaled(1.0, 1.0, 0.0);
    flat.toWorld.t = {0.0, 0.0, 2.0};
    checkIrradiance(committed(flat), 2.0 * kPi * 4.0 * cornerFormFactor(0.5, 0.5, 2.0));
}

TEST_CASE("disk lights give their analytic irradiance") {
    Light light = lightAbove(LightType::kDisk);
    light.radius = 1.5F;
    const double factor = 2.25 / (2.25 + 4.0);
    checkIrradiance(committed(light), 2.0 * kPi * factor);
    light.normalize = true;
    checkIrradiance(committed(light), 2.0 * factor / 2.25);
    // A uniform scale by the transform is the same as a larger radius.
    light.normalize = false;
    light.toWorld = scaled(0.5, 0.5, 0.5);
    light.toWorld.t = {0.0, 0.0, 2.0};
    checkIrradiance(committed(light), 2.0 * kPi * 0.5625 / (0.5625 + 4.0));
    // An ellipse: the flat limit of the ellipsoid.
    light.toWorld = scaled(1.0, 0.4, 1.0);
    light.toWorld.t = {0.0, 0.0, 2.0};
    checkIrradiance(committed(light), 2.0 * ellipsoidIrradiance(1.5, 0.6, 1e-4, 2.0));
}

TEST_CASE("sphere lights give their analytic irradiance, near, far and scaled") {
    Light light = lightAbove(LightType::kSphere);
    light.radius = 0.5F;
    checkIrradiance(committed(light), 2.0 * kPi * 0.25 / 4.0);
    light.normalize = true;
    checkIrradiance(committed(light), 2.0 / 4.0 / 4.0);

    light.normalize = false;
    light.toWorld.t = {0.0, 0.0, 0.501};
    checkIrradiance(committed(light), 2.0 * kPi * 0.25 / (0.501 * 0.501));

    // Far: a hundred thousand radii away, with the cone a few float steps wide.
    light.toWorld.t = {0.0, 0.0, 5e4};
    checkMean(sampledIrradiance(committed(light)), 2.0 * kPi * 0.25 / 25e8, 1e-3);

    light.toWorld = scaled(2.0, 0.8, 1.5);
    light.toWorld.t = {0.0, 0.0, 2.0};
    checkIrradiance(committed(light), 2.0 * ellipsoidIrradiance(1.0, 0.4, 0.75, 2.0));
}

TEST_CASE("a sphere that is almost one has almost its area") {
    // Two ways to the area: in closed form, and by quadrature where it is no sphere any more.
    const auto powerOf = [](const AffineD& toWorld) {
        Light light = lightAbove(LightType::kSphere, 2.0);
        light.toWorld = toWorld;
        return committed(light).prepared(0).power;
    };
    const double exact = powerOf(scaled(1.0, 1.0, 1.0));
    CHECK(powerOf(scaled(1.0 + 1e-7, 1.0, 1.0)) == doctest::Approx(exact).epsilon(1e-6));
    CHECK(powerOf(scaled(-3.0, 3.0, 3.0)) == doctest::Approx(9.0 * exact).epsilon(1e-6));
}

TEST_CASE("normalize divides by the surface area of a scaled sphere") {
    // A spheroid's area in closed form: prolate, semi-axes 0.5, 0.5 and 1.
    const double e = std::sqrt(1.0 - 0.25);
    const double area = 2.0 * kPi * 0.25 * (1.0 + 1.0 / (0.5 * e) * std::asin(e));
    Light light = lightAbove(LightType::kSphere, 4.0);
    light.toWorld = scaled(1.0, 1.0, 2.0);
    light.toWorld.t = {0.0, 0.0, 4.0};
    light.normalize = true;
    checkIrradiance(committed(light), 2.0 * ellipsoidIrradiance(0.5, 0.5, 1.0, 4.0) / area);
}

TEST_CASE("nothing is emitted into a sphere light") {
    Light light = lightAbove(LightType::kSphere, 0.1);
    light.radius = 1.0F;
    const LightSampler sampler = committed(light);
    CHECK(sampledIrradiance(sampler).mean() == 0.0);
    CHECK(hitIrradiance(sampler).mean() == 0.0);
}

TEST_CASE("cylinder lights give the irradiance of their lateral surface") {
    // Brute force over the surface in double: no caps, outwards only.
    const auto truth = [](double radius, double length, double height, double squash) {
        return integrate2D(
            [&](double x, double phi) {
                const Double3 q{x, radius * std::cos(phi),
                                height + squash * radius * std::sin(phi)};
                const Double3 n{0.0, squash * radius * std::cos(phi), radius * std::sin(phi)};
                const double d2 = dot(q, q);
                const double out = -dot(n, q) / std::sqrt(d2); // times area per (x, phi)
                return out > 0.0 && q.z > 0.0 ? out * q.z / std::sqrt(d2) / d2 : 0.0;
            },
            -0.5 * length, 0.5 * length, 0.0, 2.0 * kPi, 1e-7, 64);
    };
    Light light = lightAbove(LightType::kCylinder);
    light.radius = 0.4F;
    light.length = 3.0F;
    checkIrradiance(committed(light), 2.0 * truth(0.4, 3.0, 2.0, 1.0));
    light.normalize = true;
    checkIrradiance(committed(light), 2.0 * truth(0.4, 3.0, 2.0, 1.0) / (2.0 * kPi * 0.4 * 3.0));
    light.normalize = false;
    light.toWorld = scaled(0.5, 2.0, 1.0);
    light.toWorld.t = {0.0, 0.0, 2.0};
    checkIrradiance(committed(light), 2.0 * truth(0.8, 1.5, 2.0, 0.5));
    // Close to a long tube.
    light.toWorld = scaled(5.0, 1.0, 1.0);
    light.toWorld.t = {0.0, 0.0, 0.5};
    checkMean(sampledIrradiance(committed(light)), 2.0 * truth(0.4, 15.0, 0.5, 1.0));
}

TEST_CASE("distant lights follow the UsdLux normalisation") {
    for (const float degrees : {0.53F, 30.0F, 120.0F}) {
        Light light = lightAbove(LightType::kDistant);
        light.angle = degrees;
        const double s = std::sin(degrees * kPi / 360.0);
        checkMean(sampledIrradiance(committed(light)), 2.0 * kPi * s * s);
        light.normalize = true;
        // With normalize the intensity is the illuminance, whatever the angle.
        checkMean(sampledIrradiance(committed(light)), 2.0);
    }
    Light wide = lightAbove(LightType::kDistant);
    wide.angle = 300.0F;
    // Beyond a hemisphere: the floor sees all of its hemisphere filled.
    checkIrradiance(committed(wide), 2.0 * kPi);
    wide.normalize = true;
    checkIrradiance(committed(wide), 2.0 / (2.0 - 0.25));
}

TEST_CASE("a distant light of angle zero is a delta whose intensity is irradiance") {
    for (const bool normalize : {false, true}) {
        Light light = lightAbove(LightType::kDistant);
        light.angle = 0.0F;
        light.normalize = normalize;
        light.toWorld = rotation(1.0, 0.0, 0.0, -kPi / 3.0);
        const LightSampler sampler = committed(light);
        const LightSample s = sampler.sample(kFloor, 0.3F, {0.4F, 0.5F});
        CHECK(s.delta);
        CHECK(s.pdf == 1.0F);
        CHECK(std::isinf(s.distance));
        CHECK(isNear(s.radiance.x, 2.0, 1e-6));
        CHECK(isNear(s.wi.z, 0.5, 1e-6));
        CHECK(sampler.environmentCount() == 0);
        CHECK(sampler.shapeCount() == 0);
    }
}

TEST_CASE("domes give pi times their radiance and ignore normalize") {
    Light light = lightAbove(LightType::kDome);
    light.normalize = true;
    checkIrradiance(committed(light), 2.0 * kPi);
    light.toWorld = rotation(1.0, 2.0, -1.0, 0.8);
    checkIrradiance(committed(light), 2.0 * kPi);
}

TEST_CASE("dome textures turn with the light") {
    // The upper half is lit: with the dome turned by 90 degrees about x, that is +z.
    std::vector<float> values(8 * 4, 0.0F);
    std::fill(values.begin() + 16, values.end(), 3.0F);
    Light light = lightAbove(LightType::kDome);
    light.hasTexture = true;
    light.image = makeImage(8, 4, 1, values).value();
    light.toWorld = rotation(1.0, 0.0, 0.0, 0.5 * kPi);
    const LightSampler sampler = committed(light);
    CHECK(isNear(sampler.environmentRadiance({0.0F, 0.0F, 1.0F}, true).x, 6.0, 1e-5));
    CHECK(sampler.environmentRadiance({0.0F, 0.0F, -1.0F}, true).x == 0.0F);
    const Statistics sampled = sampledIrradiance(sampler);
    checkMean(sampled, integrateSphere(
                           [&](const Float3& d) {
                               return d.z > 0.0F ? d.z * sampler.environmentRadiance(d, false).x
                                                 : 0.0;
                           },
                           {0.0F, 0.0F, 1.0F}, 1e-4, 64));
    // A scale that is not uniform bends directions; density and radiance bend alike.
    light.toWorld = scaled(1.0, 0.6, 1.7);
    const LightSampler bent = committed(light);
    checkPassed(chiSquaredSphere(
        [&](TestRandom& random) {
            const LightReceiver anywhere;
            return std::optional<Float3>(bent.sample(anywhere, 0.5F, random.nextFloat2()).wi);
        },
        [&](const Float3& wi) { return bent.environmentPdf(0, {}, wi); }, {0.0F, 1.0F, 0.0F}));
    // So do the sides of a surface's plane.
    const LightReceiver tilted{Float3(0.0F), normalize(Float3(0.3F, 0.8F, -0.5F)), false};
    checkPassed(chiSquaredSphere(
        [&](TestRandom& random) -> std::optional<Float3> {
            const LightSample s = bent.sample(tilted, 0.5F, random.nextFloat2());
            return s.pdf > 0.0F ? std::optional<Float3>(s.wi) : std::nullopt;
        },
        [&](const Float3& wi) {
            const bool lit = dot(wi, tilted.n) > 0.0F && bent.environmentRadiance(wi, false).x > 0;
            return lit ? bent.environmentPdf(0, tilted, wi) : 0.0F;
        },
        tilted.n, 32, 32, 400000));
}

TEST_CASE("rect textures are upright for those they light") {
    // Left column 1, right column 0; the upper row twice as bright.
    Light light = lightAbove(LightType::kRect);
    light.hasTexture = true;
    light.image = makeImage(2, 2, 1, {1.0F, 0.0F, 2.0F, 0.0F}).value();
    const LightSampler sampler = committed(light);
    const auto radiance = [&](float x, float y) {
        const LightReceiver below{Float3(x, y, 0.0F)};
        return sampler.evaluateHit(0, below, {0.0F, 0.0F, 1.0F}, 2.0F).radiance.x;
    };
    CHECK(radiance(0.25F, 0.25F) == doctest::Approx(4.0));  // left, top
    CHECK(radiance(0.25F, -0.25F) == doctest::Approx(2.0)); // left, bottom
    CHECK(radiance(-0.25F, 0.25F) == doctest::Approx(0.0)); // right
    const Statistics sampled = sampledIrradiance(sampler);
    CHECK(isNear(sampled.mean(), hitIrradiance(sampler).mean(), 0.03));
}

TEST_CASE("shaping follows the UsdLux formulas") {
    LightShaping shaping;
    shaping.focus = 3.0F;
    shaping.focusTint = {0.25F, 0.5F, 1.0F};
    const ShapingFunction<float> focus(shaping);
    const Rgb f = focus.evaluate(0.5F);
    CHECK(isNear(f.x, 0.125 + 0.875 * 0.25, 1e-6));
    CHECK(isNear(f.y, 0.125 + 0.875 * 0.5, 1e-6));
    CHECK(isNear(f.z, 1.0, 1e-6));
    CHECK(isNear(focus.evaluate(-0.5F).x, f.x, 1e-6));

    LightShaping cone;
    cone.coneAngle = 60.0F;
    CHECK(ShapingFunction<float>(cone).evaluate(std::cos(1.04F)).x == 1.0F);
    CHECK(ShapingFunction<float>(cone).evaluate(std::cos(1.05F)).x == 0.0F);
    cone.coneSoftness = 0.5F;
    const ShapingFunction<float> soft(cone);
    CHECK(soft.evaluate(std::cos(0.5F)).x == 1.0F);
    CHECK(isNear(soft.evaluate(std::cos(0.25F * kPi)).x, 0.5, 1e-5));
    CHECK(soft.evaluate(std::cos(1.05F)).x == 0.0F);
    CHECK_FALSE(ShapingFunction<float>(LightShaping{}).isOn());

    // The same in double and in SIMD lanes.
    using Batch = xsimd::batch<float>;
    cone.focus = 2.5F;
    for (float c = -1.0F; c <= 1.0F; c += 0.01F) {
        const double single = ShapingFunction<float>(cone).evaluate(c).x;
        CHECK(isNear(single, ShapingFunction<double>(cone).evaluate(c).x, 2e-5, 1e-6));
        CHECK(isNear(single, ShapingFunction<Batch>(cone).evaluate(Batch(c)).x.get(0), 2e-5, 1e-6));
    }

    // A sphere with a cone: a spot of the analytic irradiance inside, nothing outside.
    Light light = lightAbove(LightType::kSphere, 20.0);
    light.radius = 0.01F;
    light.shaping.coneAngle = 30.0F;
    const LightSampler sampler = committed(light);
    checkMean(sampledIrradiance(sampler), 2.0 * kPi * 1e-4 / 400.0, 1e-3);
    const LightReceiver outside{Float3(20.0F, 0.0F, 0.0F), kFloor.n, false};
    CHECK(sampledIrradiance(sampler, outside, 1000).mean() == 0.0);
}

TEST_CASE("narrow beams are not lost between the steps of their mean") {
    for (const LightType type : {LightType::kSphere, LightType::kDisk}) {
        for (const float degrees : {3.0F, 0.5F}) {
            Light light = lightAbove(type, 20.0);
            light.radius = 0.001F;
            light.shaping.coneAngle = degrees;
            const LightSampler sampler = committed(light);
            CHECK(sampler.isActive(0));
            checkMean(sampledIrradiance(sampler, kFloor, 1000), 2.0 * kPi * 1e-6 / 400.0, 1e-3);
        }
    }
}

TEST_CASE("spheres treated as points keep their irradiance far away") {
    Light light = lightAbove(LightType::kSphere);
    light.treatAsPoint = true;
    light.radius = 0.25F;
    const LightSampler sampler = committed(light);
    const LightSample s = sampler.sample(kFloor, 0.0F, {0.0F, 0.0F});
    CHECK(s.delta);
    CHECK(isNear(s.radiance.x, 2.0 * kPi * 0.0625 / 4.0, 1e-5));
    CHECK(isNear(s.distance, 2.0, 1e-6));
    CHECK(isBlack(Rgb(s.normal)));
    CHECK(sampler.shapeCount() == 0);
    light.normalize = true;
    light.radius = 0.0F;
    CHECK(isNear(committed(light).sample(kFloor, 0.0F, {0.0F, 0.0F}).radiance.x, 2.0 / 4.0 / 4.0,
                 1e-6));
}

TEST_CASE("cylinders treated as lines keep their power") {
    Light light = lightAbove(LightType::kCylinder, 3.0);
    light.length = 2.0F;
    light.radius = 0.02F;
    const double tube = sampledIrradiance(committed(light)).mean();
    light.treatAsLine = true;
    CHECK(isNear(sampledIrradiance(committed(light)).mean(), tube, 0.02));
    light.normalize = true;
    light.radius = 0.0F;
    const double line = sampledIrradiance(committed(light)).mean();
    CHECK(isNear(line, tube / (2.0 * kPi * 0.02 * 2.0), 0.02));
}

TEST_CASE("emissive triangles give their analytic irradiance") {
    // Two triangles make the rectangle, one of them wound the other way.
    EmissiveTriangle a, b;
    a.p0 = {-0.5F, -0.5F, 2.0F};
    a.p1 = {0.5F, -0.5F, 2.0F};
    a.p2 = {0.5F, 0.5F, 2.0F};
    a.radiance = Rgb(2.0F);
    a.userId = 70;
    b = a;
    b.p1 = {-0.5F, 0.5F, 2.0F};
    b.userId = 12;
    const double truth = 2.0 * kPi * 4.0 * cornerFormFactor(0.5, 0.5, 2.0);
    checkMean(sampledIrradiance(committed({}, {a, b})), truth);
    // One-sided, only the one whose front looks down lights the floor.
    a.doubleSided = b.doubleSided = false;
    checkMean(sampledIrradiance(committed({}, {a, b})), 0.5 * truth);
}

TEST_CASE("triangle samples carry weights of the point and the pdf of the hit") {
    EmissiveTriangle a;
    a.p0 = {-0.5F, -0.5F, 2.0F};
    a.p1 = {0.5F, -0.5F, 2.2F};
    a.p2 = {0.3F, 0.5F, 1.9F};
    a.radiance = Rgb(1.0F);
    a.userId = 5;
    EmissiveTriangle b = a;
    b.p0 = {1.0F, 3.0F, 2.0F};
    b.userId = 900;
    const LightSampler sampler = committed({}, {b, a});
    TestRandom random(8);
    for (int i = 0; i < 1000; ++i) {
        const LightSample s = sampler.sample(kFloor, random.nextFloat(), random.nextFloat2());
        const EmissiveTriangle& t = s.triangle == 5 ? a : b;
        REQUIRE(s.triangle == t.userId);
        REQUIRE(s.light == kNoLight);
        const Float3 p = t.p0 * (1.0F - s.b1 - s.b2) + t.p1 * s.b1 + t.p2 * s.b2;
        REQUIRE(length(p - s.point) < 1e-5F);
        REQUIRE(isNear(sampler.pdfTriangle(s.triangle, kFloor, p), s.pdf, 1e-3));
    }
    CHECK(sampler.pdfTriangle(6, kFloor, Float3(0.0F, 0.0F, 2.0F)) == 0.0F);
}

TEST_CASE("the pdf of a sample is the pdf that a ray in its direction finds, for many lights") {
    Lights lights;
    for (const LightType type : {LightType::kRect, LightType::kDisk, LightType::kSphere,
                                 LightType::kCylinder, LightType::kDistant, LightType::kDome}) {
        Light light = lightAbove(type);
        light.toWorld = scaled(0.7, 0.4, 0.6);
        light.toWorld.t = {2.5 * static_cast<double>(lights.size()) - 5.0, 1.0, 2.0};
        light.angle = 10.0F;
        lights.push_back(std::make_shared<Light>(light));
    }
    const LightSampler sampler = committed(lights);
    CHECK(sampler.activeLightCount() == 6);
    CHECK(sampler.shapeCount() == 4);
    CHECK(sampler.environmentCount() == 2);
    TestRandom random(5);
    std::vector<int> count(lights.size(), 0);
    for (int i = 0; i < 20000; ++i) {
        const LightSample s = sampler.sample(kFloor, random.nextFloat(), random.nextFloat2());
        if (!(s.pdf > 0.0F)) {
            continue;
        }
        ++count[s.light];
        if (std::isinf(s.distance)) {
            const std::uint32_t e = sampler.lightOfEnvironment(0) == s.light ? 0 : 1;
            REQUIRE(isNear(sampler.environmentPdf(e, kFloor, s.wi), s.pdf, 1e-4));
            REQUIRE(isNear(sampler.environmentRadiance(e, s.wi).x, s.radiance.x, 1e-4));
        } else {
            const LightHit hit = sampler.evaluateHit(s.light, kFloor, s.wi, s.distance);
            if (dot(hit.normal, s.wi) > -0.05F) {
                continue;
            }
            REQUIRE(isNear(hit.pdf, s.pdf, 2e-3));
            REQUIRE(isNear(hit.radiance.x, s.radiance.x, 1e-4));
        }
    }
    for (const int c : count) {
        CHECK(c > 20);
    }
    const Statistics sampled = sampledIrradiance(sampler), hit = hitIrradiance(sampler);
    const double error = std::hypot(sampled.standardError(), hit.standardError());
    CHECK(error < 0.02 * sampled.mean());
    CHECK(std::abs(sampled.mean() - hit.mean()) < 4.5 * error);
}

TEST_CASE("bounds hold the points of their light") {
    for (const LightType type :
         {LightType::kRect, LightType::kDisk, LightType::kSphere, LightType::kCylinder}) {
        Light light = lightAbove(type);
        const AffineD turn = rotation(1.0, 0.4, -0.3, 1.1);
        light.toWorld = concatenate(scaled(1.3, 0.5, 2.0), turn);
        light.toWorld.t = {100.0, -50.0, 7.0};
        const LightSampler sampler = committed(light);
        const Bounds box = sampler.shapeBounds(0);
        TestRandom random(6);
        Bounds points;
        for (int i = 0; i < 20000; ++i) {
            const LightReceiver receiver{Float3(100.0F, -50.0F, 7.0F) +
                                         uniformSphere(random.nextFloat2()) * 5.0F};
            const LightSample s = sampler.sample(receiver, 0.5F, random.nextFloat2());
            if (s.pdf > 0.0F) {
                points.add(s.point);
            }
        }
        for (int axis = 0; axis < 3; ++axis) {
            CHECK(points.lower[axis] >= box.lower[axis]);
            CHECK(points.upper[axis] <= box.upper[axis]);
            // And not much larger than needed.
            CHECK(points.upper[axis] - points.lower[axis] >
                  0.95F * (box.upper[axis] - box.lower[axis]));
        }
    }
}

TEST_CASE("large world coordinates cancel in double") {
    Light light = lightAbove(LightType::kSphere);
    light.toWorld.t = {1e7 + 0.25, -3e7, 2.0};
    const LightSampler sampler =
        committed({std::make_shared<Light>(light)}, {}, Double3(1e7, -3e7, 0.0));
    const Bounds box = sampler.shapeBounds(0);
    CHECK(isNear(box.center().x, 0.25, 1e-5));
    CHECK(isNear(box.center().z, 2.0, 1e-5));
}

TEST_CASE("lights that cannot light are dropped with one message that names them") {
    const auto refused = [](const Light& light) {
        Diagnostics diagnostics;
        LightSampler sampler;
        sampler.commit({std::make_shared<Light>(light)}, Double3(0.0), 1.0F, {}, diagnostics);
        REQUIRE(diagnostics.messages().size() == 1);
        CHECK(diagnostics.messages()[0].subject == "/lights/one");
        CHECK(diagnostics.messages()[0].text.find("left out") != std::string::npos);
        CHECK(sampler.empty());
        CHECK_FALSE(sampler.isActive(0));
        CHECK(sampler.shapeCount() == 0);
        CHECK(sampler.environmentCount() == 0);
        CHECK(sampler.sample(kFloor, 0.5F, {0.5F, 0.5F}).pdf == 0.0F);
    };
    for (const LightType type : {LightType::kRect, LightType::kDisk, LightType::kSphere,
                                 LightType::kCylinder, LightType::kDistant, LightType::kDome}) {
        Light black = lightAbove(type);
        black.radiance = Rgb(0.0F);
        refused(black);
        Light negative = lightAbove(type);
        negative.radiance = Rgb(-1.0F);
        refused(negative);
        Light infinite = lightAbove(type);
        infinite.radiance.y = std::numeric_limits<float>::infinity();
        refused(infinite);
        Light lost = lightAbove(type);
        lost.toWorld.t.x = std::nan("");
        refused(lost);
        Light singular = lightAbove(type);
        singular.toWorld = scaled(0.0, 0.0, 0.0);
        refused(singular);
    }
    Light rect = lightAbove(LightType::kRect);
    rect.width = 0.0F;
    refused(rect);
    for (const LightType type : {LightType::kDisk, LightType::kSphere, LightType::kCylinder}) {
        Light thin = lightAbove(type);
        thin.radius = 0.0F;
        refused(thin);
    }
    Light shortTube = lightAbove(LightType::kCylinder);
    shortTube.length = 0.0F;
    refused(shortTube);
    Light point = lightAbove(LightType::kSphere);
    point.treatAsPoint = true;
    point.radius = 0.0F;
    refused(point);
    Light closed = lightAbove(LightType::kRect);
    closed.shaping.coneAngle = 0.0F;
    refused(closed);
    Light darkTexture = lightAbove(LightType::kDome);
    darkTexture.hasTexture = true;
    darkTexture.image = makeImage(4, 2, 1, std::vector<float>(8, 0.0F)).value();
    refused(darkTexture);
}

TEST_CASE("dropped lights keep the numbers of the others") {
    Light black = lightAbove(LightType::kSphere);
    black.radiance = Rgb(0.0F);
    Light tinted = lightAbove(LightType::kSphere);
    tinted.diffuse = 0.5F;
    tinted.specular = 0.25F;
    LightSampler sampler;
    Diagnostics diagnostics;
    sampler.commit({std::make_shared<Light>(black), std::make_shared<Light>(tinted)}, Double3(0.0),
                   1.0F, {}, diagnostics);
    CHECK(sampler.lightOfShape(0) == 1);
    const LightSample s = sampler.sample(kFloor, 0.5F, {0.5F, 0.5F});
    CHECK(s.light == 1);
    CHECK(s.diffuse == 0.5F);
    CHECK(s.specular == 0.25F);
    CHECK(sampler.diffuseMultiplier(1) == 0.5F);
    CHECK(sampler.specularMultiplier(1) == 0.25F);
}

TEST_CASE("degenerate and black triangles are left out") {
    EmissiveTriangle flat;
    flat.radiance = Rgb(1.0F);
    EmissiveTriangle black = flat;
    black.p1 = {1.0F, 0.0F, 2.0F};
    black.p2 = {0.0F, 1.0F, 2.0F};
    black.radiance = Rgb(0.0F);
    EmissiveTriangle broken = black;
    broken.radiance = Rgb(1.0F);
    broken.p0.x = std::nanf("");
    CHECK(committed({}, {flat, black, broken}).empty());
}

TEST_CASE("the camera light lights only where nothing else does") {
    Light camera = lightAbove(LightType::kDistant);
    camera.isCameraLight = true;
    CHECK(committed(camera).isActive(0));
    const LightSampler with = committed(
        {std::make_shared<Light>(camera), std::make_shared<Light>(lightAbove(LightType::kDome))});
    CHECK_FALSE(with.isActive(0));
    CHECK(with.isActive(1));
    EmissiveTriangle triangle;
    triangle.p1 = {1.0F, 0.0F, 0.0F};
    triangle.p2 = {0.0F, 1.0F, 0.0F};
    triangle.radiance = Rgb(1.0F);
    CHECK_FALSE(committed({std::make_shared<Light>(camera)}, {triangle}).isActive(0));
    // A black light does not count as another light.
    Light black = lightAbove(LightType::kDome);
    black.radiance = Rgb(0.0F);
    LightSampler sampler;
    Diagnostics diagnostics;
    sampler.commit({std::make_shared<Light>(camera), std::make_shared<Light>(black)}, Double3(0.0),
                   1.0F, {}, diagnostics);
    CHECK(sampler.isActive(0));
}

TEST_CASE("domes hidden from the camera light all the same") {
    Light dome = lightAbove(LightType::kDome);
    dome.visibleToCamera = false;
    const LightSampler sampler = committed(dome);
    const Float3 up(0.0F, 0.0F, 1.0F);
    CHECK(isBlack(sampler.environmentRadiance(up, true)));
    CHECK(sampler.environmentRadiance(up, false).x == 2.0F);
    CHECK_FALSE(sampler.visibleToCamera(0));
    checkMean(sampledIrradiance(sampler), 2.0 * kPi);
}

TEST_CASE("samples below an opaque receiver are refused") {
    const LightSampler sampler = committed(lightAbove(LightType::kDome));
    TestRandom random(7);
    for (int i = 0; i < 1000; ++i) {
        const LightSample s = sampler.sample(kFloor, 0.5F, random.nextFloat2());
        CHECK((s.pdf == 0.0F) == !(s.wi.z > 0.0F));
    }
}
