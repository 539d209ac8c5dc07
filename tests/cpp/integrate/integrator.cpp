// The path tracer against closed forms, and its invariances. Monte Carlo tolerances are stated as
// multiples of a bound on the standard error; seeds are fixed.
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "support/check.h"
#include "testScenes.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

const std::vector<std::string> kParts = {
    "mbfeat:contribution:emission", "mbfeat:contribution:0",   "mbfeat:contribution:1",
    "mbfeat:contribution:2",        "mbfeat:contribution:3",   "mbfeat:contribution:4",
    "mbfeat:contribution:5",        "mbfeat:contribution:tail"};

/// A room with every kind of transport: diffuse, glossy, glass, an area light and a sky.
void fillMixedScene(TestScene& test) {
    test.add("/Floor", quadMesh({-4, -1, 4}, {8, 0, 0}, {0, 0, -8}),
             constantMaterial("/M/Floor", {0.6F, 0.5F, 0.4F}));
    Material metal = constantMaterial("/M/Metal", {0.9F, 0.7F, 0.3F});
    metal.metallic = MaterialInput(1.0F);
    metal.roughness = MaterialInput(0.3F);
    test.add("/Metal", sphereMesh(0.7F, 24, false), metal, translation(-1.2, -0.3, -3));
    Material glass = constantMaterial("/M/Glass", {0.9F, 0.95F, 1.0F});
    glass.opacity = MaterialInput(0.0F);
    glass.roughness = MaterialInput(0.2F);
    glass.ior = MaterialInput(1.5F);
    test.add("/Glass", sphereMesh(0.7F, 24, false), glass, translation(1.2, -0.3, -3));
    Light lamp;
    lamp.path = "/Lamp";
    lamp.type = LightType::kRect;
    lamp.radiance = Rgb(6.0F);
    lamp.width = 2.0F;
    lamp.height = 2.0F;
    // Local -z points down.
    lamp.toWorld.x = {1, 0, 0};
    lamp.toWorld.y = {0, 0, -1};
    lamp.toWorld.z = {0, 1, 0};
    lamp.toWorld.t = {0, 3, -3};
    test.scene.setLight(lamp);
    test.addSky(Rgb(0.2F, 0.3F, 0.5F));
}

std::vector<float> mixedColor(int threads, int tileSize, int samples) {
    TestScene test;
    fillMixedScene(test);
    RenderOptions options = exactOptions(samples);
    options.threads = threads;
    options.tileSize = tileSize;
    return aov(*render(test.scene, testCamera({0, 0.5, 2}, 0.7F), 33, 21, {"color"}, options),
               "color");
}

} // namespace

TEST_CASE("inside of an emitting sphere: the geometric series of its bounces") {
    TestScene test;
    Material material = constantMaterial("/M", Rgb(0.5F));
    material.emissiveColor = MaterialInput(Rgb(0.5F));
    test.add("/Sphere", sphereMesh(2.0F, 48, true), material);
    std::vector<std::string> names = kParts;
    names.emplace_back("color");
    const auto film =
        render(test.scene, testCamera({0, 0, 0.5}, 0.8F), 16, 16, names, exactOptions(64));
    // The estimator of every bounce is bounded by 1; 16384 paths give a standard error below
    // 0.004 for the whole, and below half the value's for each part.
    CHECK(meanOf(*film, "color") == doctest::Approx(1.0).epsilon(0.012));
    CHECK(meanOf(*film, "mbfeat:contribution:emission") == doctest::Approx(0.5).epsilon(1e-6));
    double series = 0.5;
    for (int k = 0; k < 6; ++k) {
        const double expected = std::pow(0.5, k + 2);
        series += expected;
        CHECK(meanOf(*film, "mbfeat:contribution:" + std::to_string(k)) ==
              doctest::Approx(expected).epsilon(0.05));
    }
    CHECK(meanOf(*film, "mbfeat:contribution:tail") == doctest::Approx(1.0 - series).epsilon(0.3));
}

TEST_CASE("a convex sphere under a uniform sky shows its albedo and no later bounce") {
    TestScene test;
    test.add("/Sphere", sphereMesh(1.0F, 48, false), constantMaterial("/M", Rgb(0.5F)));
    test.addSky(Rgb(1.0F));
    const auto film = render(test.scene, testCamera({0, 0, 6}, 0.1F), 12, 12,
                             {"color", "mbfeat:contribution:0", "mbfeat:contribution:1",
                              "mbfeat:contribution:tail", "alpha"},
                             exactOptions(64));
    CHECK(meanOf(*film, "alpha") == doctest::Approx(1.0));
    CHECK(meanOf(*film, "color") == doctest::Approx(0.5).epsilon(0.01));
    CHECK(meanOf(*film, "mbfeat:contribution:0") == doctest::Approx(0.5).epsilon(0.01));
    // A ray that meets the sphere again would be a self-intersection.
    CHECK(meanOf(*film, "mbfeat:contribution:1") == 0.0);
    CHECK(meanOf(*film, "mbfeat:contribution:tail") == 0.0);
}

TEST_CASE("clear glass without tint is invisible in a uniform sky") {
    for (const float roughness : {0.0F, 0.1F}) {
        CAPTURE(roughness);
        TestScene test;
        Material glass = constantMaterial("/M", Rgb(1.0F));
        glass.opacity = MaterialInput(0.0F);
        glass.ior = MaterialInput(1.5F);
        glass.roughness = MaterialInput(roughness);
        test.add("/Ball", sphereMesh(1.0F, 64, false), glass);
        test.addSky(Rgb(1.0F));
        const auto film =
            render(test.scene, testCamera({0, 0, 4}, 0.35F), 16, 16, {"color"}, exactOptions(64));
        // Rough glass loses the light of masked facets, below 1 % at this roughness.
        CHECK(meanOf(*film, "color") ==
              doctest::Approx(1.0).epsilon(roughness > 0.0F ? 0.02 : 5e-3));
    }
}

TEST_CASE("emission, contributions and tail add up to color") {
    TestScene test;
    fillMixedScene(test);
    std::vector<std::string> names = kParts;
    names.emplace_back("color");
    const auto film =
        render(test.scene, testCamera({0, 0.5, 2}, 0.7F), 24, 24, names, exactOptions(16));
    const std::vector<float> color = aov(*film, "color");
    std::vector<double> sum(24 * 24 * 3, 0.0);
    for (const std::string& name : kParts) {
        const std::vector<float> part = aov(*film, name);
        for (std::size_t i = 0; i < sum.size(); ++i) {
            sum[i] += part[i];
        }
    }
    double worst = 0.0;
    for (std::size_t pixel = 0; pixel < 24 * 24; ++pixel) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double expected = color[pixel * 4 + c];
            worst = std::max(worst, std::abs(sum[pixel * 3 + c] - expected) / (1e-3 + expected));
        }
    }
    CHECK(worst < 1e-5);
}

TEST_CASE("a mirror shows at vertex 1 what it reflects") {
    TestScene test;
    Material silver = constantMaterial("/M/Mirror", Rgb(1.0F));
    silver.metallic = MaterialInput(1.0F);
    silver.roughness = MaterialInput(0.0F);
    const float s = std::sqrt(0.5F);
    test.add("/Mirror", quadMesh({-s, -1, -s}, {2 * s, 0, 2 * s}, {0, 2, 0}), silver);
    const Rgb green(0.1F, 0.6F, 0.2F);
    // The mirror's front normal is (1, 0, -1) / sqrt 2, so a ray along -z meets its back and
    // leaves along -x.
    test.add("/Card", quadMesh({-3, -2, 2}, {0, 0, -4}, {0, 4, 0}),
             constantMaterial("/M/Card", green));
    Light lamp;
    lamp.path = "/Lamp";
    lamp.type = LightType::kSphere;
    lamp.toWorld.t = {0, 3, 2};
    test.scene.setLight(lamp);
    const auto film =
        render(test.scene, testCamera({0, 0, 4}, 0.05F), 4, 4,
               {"mbfeat:albedo:0", "mbfeat:albedo:1", "mbfeat:normal:1", "mbfeat:direct:0",
                "mbfeat:direct:1", "mbfeat:firstNonDelta:albedo", "mbfeat:firstNonDelta:depth",
                "mbfeat:distance:0", "mbfeat:distance:1", "mbfeat:event:0"},
               exactOptions(4));
    const std::vector<float> albedo1 = aov(*film, "mbfeat:albedo:1");
    const std::vector<float> firstNonDelta = aov(*film, "mbfeat:firstNonDelta:albedo");
    const std::vector<float> normal1 = aov(*film, "mbfeat:normal:1");
    for (std::size_t pixel = 0; pixel < 16; ++pixel) {
        for (int c = 0; c < 3; ++c) {
            const auto i = pixel * 3 + static_cast<std::size_t>(c);
            CHECK(albedo1[i] == doctest::Approx(green[c]).epsilon(1e-5));
            CHECK(firstNonDelta[i] == doctest::Approx(green[c]).epsilon(1e-5));
        }
        CHECK(normal1[pixel * 3] == doctest::Approx(1.0).epsilon(1e-5));
    }
    CHECK(meanOf(*film, "mbfeat:direct:0") == 0.0);
    CHECK(meanOf(*film, "mbfeat:direct:1") > 0.0);
    const double path = meanOf(*film, "mbfeat:distance:0") + meanOf(*film, "mbfeat:distance:1");
    CHECK(meanOf(*film, "mbfeat:firstNonDelta:depth") == doctest::Approx(path).epsilon(1e-5));
    CHECK(path == doctest::Approx(7.0).epsilon(0.02));
}

TEST_CASE("the image does not depend on threads or tile size, bit for bit") {
    const std::vector<float> reference = mixedColor(1, 16, 8);
    CHECK(mixedColor(2, 16, 8) == reference);
    CHECK(mixedColor(7, 16, 8) == reference);
    CHECK(mixedColor(2, 5, 8) == reference);
    CHECK(mixedColor(2, 64, 8) == reference);
}

TEST_CASE("instances look like baked prims, mirrored and scaled ones too") {
    AffineD mirrored = translation(1.2, 0, -4);
    mirrored.x = {-0.5, 0, 0};
    mirrored.y = {0, 1.5, 0};
    const std::vector<AffineD> transforms = {translation(-1.2, 0, -4), mirrored};
    const auto image = [&](bool instanced) {
        TestScene test;
        const Material material = constantMaterial("/M", {0.7F, 0.4F, 0.2F});
        const std::shared_ptr<const Mesh> mesh = sphereMesh(1.0F, 32, false);
        if (instanced) {
            test.addInstances("/Ball", mesh, material, transforms);
        } else {
            test.add("/BallA", mesh, material, transforms[0]);
            test.add("/BallB", mesh, material, transforms[1]);
        }
        test.addSky(Rgb(1.0F));
        const auto film = render(test.scene, testCamera({0, 0, 2}, 0.6F), 24, 24,
                                 {"color", "normal"}, exactOptions(16));
        return std::pair(aov(*film, "color"), aov(*film, "normal"));
    };
    const auto baked = image(false);
    const auto instanced = image(true);
    // Same random numbers, so only rounding at silhouettes may differ.
    int different = 0;
    for (std::size_t i = 0; i < baked.first.size(); ++i) {
        different += std::abs(baked.first[i] - instanced.first[i]) > 1e-3F ? 1 : 0;
    }
    CHECK(different <= static_cast<int>(baked.first.size() / 100));
    different = 0;
    for (std::size_t i = 0; i < baked.second.size(); ++i) {
        different += std::abs(baked.second[i] - instanced.second[i]) > 1e-2F ? 1 : 0;
    }
    CHECK(different <= static_cast<int>(baked.second.size() / 100));
}

TEST_CASE("presence lets its share of the background through, for the camera and for shadows") {
    TestScene test;
    Material veil = constantMaterial("/M/Veil", Rgb(0.0F));
    veil.opacity = MaterialInput(0.3F);
    veil.opacityMode = OpacityMode::kPresence;
    test.add("/Veil", quadMesh({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}), veil);
    test.addSky(Rgb(1.0F));
    const auto film = render(test.scene, testCamera({0, 0, 2}, 0.5F), 16, 16, {"color", "alpha"},
                             exactOptions(64));
    // Stratified 16384 samples of a Bernoulli variable: standard error below 0.0036.
    CHECK(meanOf(*film, "color") == doctest::Approx(0.7).epsilon(0.02));
    CHECK(meanOf(*film, "alpha") == doctest::Approx(0.3).epsilon(0.04));

    // One behind another each lets its share of what reaches it through.
    for (const int layers : {2, 3}) {
        CAPTURE(layers);
        TestScene stack;
        for (int i = 0; i < layers; ++i) {
            stack.add("/Veil" + std::to_string(i),
                      quadMesh({-5, -5, -0.2F * static_cast<float>(i)}, {10, 0, 0}, {0, 10, 0}),
                      veil);
        }
        stack.addSky(Rgb(1.0F));
        const auto seen =
            render(stack.scene, testCamera({0, 0, 2}, 0.5F), 16, 16, {"color"}, exactOptions(64));
        CHECK(meanOf(*seen, "color") == doctest::Approx(std::pow(0.7, layers)).epsilon(0.03));
    }

    TestScene shadow;
    shadow.add("/Floor", quadMesh({-5, -5, -1}, {10, 0, 0}, {0, 10, 0}),
               constantMaterial("/M/Floor", Rgb(1.0F)));
    shadow.add("/Veil", quadMesh({-50, -50, 5}, {100, 0, 0}, {0, 100, 0}), veil);
    Light sun;
    sun.path = "/Sun";
    sun.type = LightType::kDistant;
    sun.angle = 0.0F;
    sun.radiance = Rgb(kPi);
    shadow.scene.setLight(sun);
    const auto lit =
        render(shadow.scene, testCamera({0, 0, 2}, 0.2F), 8, 8, {"color"}, exactOptions(16));
    CHECK(meanOf(*lit, "color") == doctest::Approx(0.7).epsilon(0.02));
}

TEST_CASE("a sky without shadows lights the inside of a closed sphere at every bounce") {
    TestScene test;
    test.add("/Sphere", sphereMesh(2.0F, 48, true), constantMaterial("/M", Rgb(0.5F)));
    Light sky;
    sky.path = "/Sky";
    sky.type = LightType::kDome;
    sky.castsShadows = false;
    test.scene.setLight(sky);
    const auto film =
        render(test.scene, testCamera({0, 0, 0.5}, 0.8F), 16, 16, kParts, exactOptions(64));
    // Each vertex sees a whole hemisphere of radiance 1. Estimates are bounded by 4 times their
    // mean, so that 16384 paths give standard errors below 3 % of it, at bounce 0 below 1 %.
    CHECK(meanOf(*film, "mbfeat:contribution:emission") == 0.0);
    CHECK(isNear(meanOf(*film, "mbfeat:contribution:0"), 0.5, 0.04));
    for (int k = 1; k < 4; ++k) {
        CHECK(isNear(meanOf(*film, "mbfeat:contribution:" + std::to_string(k)),
                     std::pow(0.5, k + 1), 0.1));
    }
}

TEST_CASE("behind a wall a lamp without shadows lights as one with shadows does in the open") {
    Kernel kernel = Kernel::kAuto;
    const auto floorRadiance = [&](bool castsShadows, float wallOpacity, float roughness) {
        TestScene test;
        Material floor = constantMaterial("/M", Rgb(0.5F));
        floor.metallic = MaterialInput(roughness < 1.0F ? 1.0F : 0.0F);
        floor.roughness = MaterialInput(roughness);
        test.add("/Floor", quadMesh({-4, -1, 0}, {8, 0, 0}, {0, 0, -8}), floor);
        if (wallOpacity > 0.0F) {
            Material wall = constantMaterial("/B", Rgb(0.0F));
            wall.opacity = MaterialInput(wallOpacity);
            wall.opacityMode = OpacityMode::kPresence;
            test.add("/Wall", quadMesh({-2, 1.5F, -1}, {4, 0, 0}, {0, 0, -4}), wall);
        }
        Light lamp;
        lamp.path = "/Lamp";
        lamp.type = LightType::kRect;
        lamp.radiance = Rgb(6.0F);
        lamp.width = lamp.height = 2.0F;
        lamp.toWorld.x = {1, 0, 0};
        lamp.toWorld.y = {0, 0, -1};
        lamp.toWorld.z = {0, 1, 0};
        lamp.toWorld.t = {0, 3, -3};
        lamp.castsShadows = castsShadows;
        test.scene.setLight(lamp);
        RenderOptions options = exactOptions(256);
        options.maxBounces = 1;
        options.kernel = kernel;
        const auto film = render(test.scene, testCamera({0, 0, 2}, 0.4F), 16, 16,
                                 {"mbfeat:contribution:0"}, options);
        return meanOf(*film, "mbfeat:contribution:0");
    };
    // 65536 paths whose estimates vary by less than three times their mean: standard errors below
    // 1.2 %, and below 0.5 % on the diffuse floor.
    for (const Kernel tested : {Kernel::kScalar, Kernel::kAuto}) {
        kernel = tested;
        for (const auto& [roughness, tolerance] : {std::pair(1.0F, 0.03), std::pair(0.4F, 0.08)}) {
            const double open = floorRadiance(true, 0.0F, roughness);
            CHECK(isNear(floorRadiance(false, 0.0F, roughness), open, tolerance));
            CHECK(isNear(floorRadiance(false, 0.5F, roughness), open, tolerance));
            CHECK(isNear(floorRadiance(false, 1.0F, roughness), open, tolerance));
            CHECK(floorRadiance(true, 1.0F, roughness) < 0.7 * open);
        }
    }
}

TEST_CASE("a mirror shows a sky without shadows") {
    TestScene test;
    Material mirror = constantMaterial("/M", Rgb(1.0F));
    mirror.metallic = MaterialInput(1.0F);
    mirror.roughness = MaterialInput(0.0F);
    test.add("/Mirror", quadMesh({-9, -9, -3}, {18, 0, 0}, {0, 18, 0}), mirror);
    Light sky;
    sky.path = "/Sky";
    sky.type = LightType::kDome;
    sky.castsShadows = false;
    test.scene.setLight(sky);
    const auto film =
        render(test.scene, testCamera({0, 0, 0}, 0.5F), 8, 8, {"color"}, exactOptions(4));
    CHECK(meanOf(*film, "color") == doctest::Approx(1.0).epsilon(1e-4));
}

TEST_CASE("mesh emission found by light sampling and by chance agree") {
    const auto brightness = [&](int bounces) {
        TestScene test;
        test.add("/Floor", quadMesh({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}),
                 constantMaterial("/M/Floor", Rgb(0.8F)));
        Material lamp = constantMaterial("/M/Lamp", Rgb(0.0F));
        lamp.emissiveColor = MaterialInput(Rgb(2.0F));
        test.add("/Lamp", quadMesh({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}), lamp);
        const auto film =
            render(test.scene, testCamera({0, 0, 0.5}, 0.2F), 16, 16,
                   {"color", "mbfeat:direct:0", "mbfeat:contribution:0"}, exactOptions(bounces));
        return std::pair(meanOf(*film, "mbfeat:contribution:0"), meanOf(*film, "mbfeat:direct:0"));
    };
    const auto [total, sampled] = brightness(128);
    // Irradiance of a 2 x 2 square of radiance 2 seen from below its centre at distance 1, from the
    // form factor of a corner square (Howell, configuration C-11): 4 F with a = b = 1.
    const double a = 1.0;
    const double f =
        4.0 / (2.0 * M_PI) * 2.0 * (a / std::sqrt(1 + a * a)) * std::atan(a / std::sqrt(1 + a * a));
    const double centre = 0.8 * 2.0 * f;
    CHECK(total == doctest::Approx(centre).epsilon(0.02));
    // Both strategies carry weight.
    CHECK(sampled > 0.2 * total);
    CHECK(sampled < 0.95 * total);
}

TEST_CASE("an emitter that is partly or wholly cut out lights by what is left of it") {
    const auto direct = [](float opacity, float threshold) {
        TestScene test;
        test.add("/Floor", quadMesh({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}),
                 constantMaterial("/M/Floor", Rgb(0.8F)));
        Material lamp = constantMaterial("/M/Lamp", Rgb(0.0F));
        lamp.emissiveColor = MaterialInput(Rgb(2.0F));
        lamp.opacity = MaterialInput(opacity);
        lamp.opacityMode = OpacityMode::kPresence;
        lamp.opacityThreshold = MaterialInput(threshold);
        test.add("/Lamp", quadMesh({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}), lamp);
        const auto film = render(test.scene, testCamera({0, 0, 0.5}, 0.2F), 16, 16,
                                 {"mbfeat:contribution:0"}, exactOptions(64));
        return meanOf(*film, "mbfeat:contribution:0");
    };
    const double whole = direct(1.0F, 0.0F);
    // 16384 stratified paths of a bounded estimator: standard error below 1 % of the value.
    CHECK(direct(0.25F, 0.0F) == doctest::Approx(0.25 * whole).epsilon(0.05));
    CHECK(direct(0.25F, 0.5F) == 0.0);
}

TEST_CASE("a scene far from the world's origin renders the same") {
    const auto image = [&](double offset) {
        TestScene test;
        test.add("/Ball", sphereMesh(1.0F, 32, false), constantMaterial("/M", Rgb(0.5F)),
                 translation(offset, 0, -3));
        test.addSky(Rgb(1.0F));
        return aov(*render(test.scene, testCamera({offset, 0, 2}, 0.5F), 16, 16, {"color"},
                           exactOptions(16)),
                   "color");
    };
    const std::vector<float> near = image(0.0);
    const std::vector<float> far = image(1e7);
    double difference = 0.0;
    for (std::size_t i = 0; i < near.size(); ++i) {
        difference += std::abs(near[i] - far[i]);
    }
    CHECK(difference / static_cast<double>(near.size()) < 2e-3);
}

TEST_CASE("a camera that cannot see is reported and the render ends") {
    TestScene test;
    test.addSky(Rgb(1.0F));
    Camera camera = testCamera({0, 0, 0}, 0.0F);
    const auto film = render(test.scene, camera, 4, 4, {"color"}, exactOptions(1));
    CHECK(meanOf(*film, "color") == 0.0);
    REQUIRE(test.diagnostics.messages().size() == 1);
    CHECK(test.diagnostics.messages()[0].severity == Severity::kError);
    CHECK(test.diagnostics.count(Severity::kError) == 0); // the job that it was about is gone
}

TEST_CASE("a commit may be stopped anywhere, says nothing of it and goes on at the next") {
    TestScene test;
    test.add("/Plain", sphereMesh(1.0F, 128, false), constantMaterial("/M", Rgb(0.5F)));
    test.addInstances("/Placed", sphereMesh(1.0F, 128, false), constantMaterial("/N", Rgb(0.5F)),
                      {translation(3, 0, 0), translation(0, 3, 0)});
    Integrator integrator(test.scene);
    int stops = 0;
    bool committed = false;
    while (!committed) {
        // Allows one check more each time, until that is enough for what is left to do.
        std::atomic<int> checks{0};
        const int allowed = stops;
        committed = integrator.commit(exactOptions(1), [&] { return checks++ >= allowed; });
        stops += committed ? 0 : 1;
        REQUIRE(stops < 100000);
    }
    CHECK(stops > 2);
    CHECK(test.diagnostics.messages().empty());
}

TEST_CASE("an empty scene renders to black") {
    TestScene test;
    const auto film =
        render(test.scene, testCamera({0, 0, 0}, 0.5F), 4, 4, {"color", "primId"}, exactOptions(1));
    CHECK(meanOf(*film, "color") == 0.0);
    CHECK(meanOf(*film, "primId") == -1.0);
}
