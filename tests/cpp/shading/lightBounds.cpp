#include "shading/lightBounds.h"

#include "shading/lightCases.h"
#include "shading/preparedLight.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

Light lightOf(LightType type) {
    Light light;
    light.path = "/light";
    light.type = type;
    light.radiance = Rgb(3.0F);
    return light;
}

LightBounds boundsOfLight(const Light& light) {
    Diagnostics diagnostics;
    const auto prepared = prepareLight(light, Double3(0.0), diagnostics);
    REQUIRE(prepared.has_value());
    return boundsOf(*prepared);
}

} // namespace

TEST_CASE("the measure of an orientation is the integral of its cosine over the sphere") {
    for (const float spread : {0.0F, 0.3F, 1.5F, 2.5F, kPi}) {
        for (const float falloff : {0.0F, 0.2F, 1.0F, 0.5F * kPi}) {
            const double from = static_cast<double>(spread);
            const double end = std::min(from + static_cast<double>(falloff), 3.14159265358979);
            const double truth = integrate2D(
                [&](double theta, double) {
                    return std::cos(std::max(theta - from, 0.0)) * std::sin(theta);
                },
                0.0, end, 0.0, 2.0 * kPi, 1e-6, 32);
            INFO("spread " << spread << ", falloff " << falloff);
            CHECK(isNear(orientationMeasure(spread, falloff, false), truth, 1e-3, 1e-3));
        }
    }
    CHECK(isNear(orientationMeasure(0.0F, 0.5F * kPi, true), 2.0 * kPi, 1e-5));
    CHECK(isNear(orientationMeasure(2.0F, 0.5F * kPi, true), 4.0 * kPi, 1e-5));
}

TEST_CASE("strengths are radiant intensities: the irradiance of a small light from afar") {
    // Radiance 3 from an area A seen head on gives 3 A / distance^2.
    Light rect = lightOf(LightType::kRect);
    rect.width = 0.5F;
    CHECK(isNear(boundsOfLight(rect).strength, 3.0 * 0.5, 1e-5));
    Light disk = lightOf(LightType::kDisk);
    disk.radius = 0.1F;
    CHECK(isNear(boundsOfLight(disk).strength, 3.0 * kPi * 0.01, 1e-5));
    Light sphere = lightOf(LightType::kSphere);
    sphere.radius = 0.1F;
    CHECK(isNear(boundsOfLight(sphere).strength, 3.0 * kPi * 0.01, 1e-4));
    sphere.treatAsPoint = true;
    CHECK(isNear(boundsOfLight(sphere).strength, 3.0 * kPi * 0.01, 1e-4));
    // A spot cut out of it is as strong where it shines.
    sphere.shaping.coneAngle = 20.0F;
    CHECK(isNear(boundsOfLight(sphere).strength, 3.0 * kPi * 0.01, 1e-2));
    rect.shaping.coneAngle = 20.0F;
    CHECK(isNear(boundsOfLight(rect).strength, 3.0 * 0.5, 1e-2));
    for (const bool doubleSided : {true, false}) {
        const EmissiveTriangle t =
            triangleLight(Float3(0.0F), {0.0F, 1.0F, 0.0F}, 1.0F, 3.0F, doubleSided);
        CHECK(isNear(boundsOf(t).strength, 3.0 * 0.75 * std::sqrt(3.0), 1e-5));
    }
    // At infinity: the irradiance itself, but that an even dome counts for a tenth where scattering
    // finds it too.
    Light dome = lightOf(LightType::kDome);
    CHECK(isNear(boundsOfLight(dome).strength, 0.3 * kPi, 1e-5));
    dome.castsShadows = false;
    CHECK(isNear(boundsOfLight(dome).strength, 3.0 * kPi, 1e-5));
    Light distant = lightOf(LightType::kDistant);
    distant.angle = 2.0F;
    const double sine = std::sin(kPi / 180.0);
    CHECK(isNear(boundsOfLight(distant).strength, 3.0 * kPi * sine * sine, 1e-3));
    distant.angle = 0.0F;
    CHECK(isNear(boundsOfLight(distant).strength, 3.0, 1e-6));
}

TEST_CASE("bounds know which way a light shines") {
    const Float3 down(0.0F, 0.0F, -1.0F);
    const LightBounds rect = boundsOfLight(lightOf(LightType::kRect));
    CHECK(length(rect.axis - down) < 1e-6F);
    CHECK(rect.spread == 0.0F);
    CHECK(rect.falloff == doctest::Approx(0.5 * kPi));
    CHECK_FALSE(rect.bothSides);
    CHECK(boundsOfLight(lightOf(LightType::kSphere)).spread == kPi);
    CHECK(boundsOfLight(lightOf(LightType::kCylinder)).spread == kPi);
    Light spot = lightOf(LightType::kSphere);
    spot.shaping.coneAngle = 30.0F;
    CHECK(length(boundsOfLight(spot).axis - down) < 1e-6F);
    CHECK(boundsOfLight(spot).spread == doctest::Approx(kPi / 6.0));
    CHECK(boundsOfLight(spot).falloff == 0.0F);
    spot.type = LightType::kDisk;
    CHECK(boundsOfLight(spot).spread == 0.0F);
    CHECK(boundsOfLight(spot).falloff == doctest::Approx(kPi / 6.0).epsilon(0.01));
    // Sheared, the normal is not the axis of the cone.
    spot.toWorld.z = {0.0, 0.5, 1.0};
    CHECK(boundsOfLight(spot).spread == doctest::Approx(kPi / 6.0));
    CHECK(boundsOf(triangleLight(Float3(0.0F), down, 1.0F, 1.0F, true)).bothSides);
}

TEST_CASE("the sphere of a light's bounds holds the light and is no larger than its box") {
    TestRandom random(1);
    for (const LightType type :
         {LightType::kRect, LightType::kDisk, LightType::kSphere, LightType::kCylinder}) {
        Light light = lightOf(type);
        light.radius = 0.3F;
        light.toWorld.x = {0.9, 0.3, -0.2};
        light.toWorld.y = {0.1, 0.5, 0.4};
        light.toWorld.z = {-0.3, 0.2, 1.5};
        light.toWorld.t = {10.0, -20.0, 30.0};
        const LightBounds bounds = boundsOfLight(light);
        CHECK(bounds.radius <= bounds.box.radius());
        LightSampler sampler;
        Diagnostics diagnostics;
        sampler.commit({std::make_shared<Light>(light)}, Double3(0.0), 1.0F, {}, diagnostics);
        float farthest = 0.0F;
        for (int i = 0; i < 20000; ++i) {
            const LightReceiver receiver{Float3(light.toWorld.t) + uniformDirection(random) * 5.0F};
            const LightSample s = sampler.sample(receiver, 0.5F, random.nextFloat2());
            if (s.pdf > 0.0F) {
                farthest = std::max(farthest, length(s.point - bounds.box.center()));
            }
        }
        CHECK(farthest <= bounds.radius);
        CHECK(farthest > 0.6F * bounds.radius);
    }
}
