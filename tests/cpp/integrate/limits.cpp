// Limits on kinds of scattering: what is left is what the closed form without the rest says.
#include <doctest/doctest.h>

#include "testScenes.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

std::shared_ptr<Mesh> facetedSphere(float radius, bool inward) {
    std::shared_ptr<Mesh> mesh = sphereMesh(radius, 16, inward);
    mesh->normals = {}; // smooth normals lose light, see "Known limits"
    return mesh;
}

/// Radiance at the middle of the camera's view, as the mean of a small image.
double seen(TestScene& test, const RenderOptions& options) {
    const std::shared_ptr<Film> film =
        render(test.scene, testCamera({0, 0, 0}, 0.05F), 8, 8, {}, options);
    return meanOf(*film, "color");
}

/// A closed room whose walls glow with 1 and reflect half.
void addGlowingRoom(TestScene& test) {
    Material wall = constantMaterial("/M/Wall", Rgb(0.5F));
    wall.emissiveColor = MaterialInput(Rgb(1.0F));
    test.add("/Room", facetedSphere(5.0F, true), wall);
}

} // namespace

TEST_CASE("so many diffuse bounces add so many terms of the geometric series") {
    TestScene test;
    addGlowingRoom(test);
    RenderOptions options = exactOptions(256);
    for (const int limit : {0, 1, 3}) {
        CAPTURE(limit);
        double expected = 0.0, term = 1.0;
        for (int k = 0; k <= limit; ++k, term *= 0.5) {
            expected += term;
        }
        options.maxDiffuse = limit;
        // 16384 paths: a standard deviation of less than 0.4 % even for the longest.
        CHECK(seen(test, options) == doctest::Approx(expected).epsilon(0.02));
    }
}

TEST_CASE("a pane of glass takes two transmissions, and a mirror one reflection") {
    RenderOptions options = exactOptions(4);
    TestScene behindGlass;
    addGlowingRoom(behindGlass);
    Material glass = constantMaterial("/M/Glass", Rgb(1.0F));
    glass.opacity = MaterialInput(0.0F);
    glass.roughness = MaterialInput(0.0F);
    behindGlass.add("/Near", quadMesh({-1, -1, -2}, {2, 0, 0}, {0, 2, 0}), glass);
    behindGlass.add("/Far", quadMesh({-1, -1, -2.1F}, {0, 2, 0}, {2, 0, 0}), glass);
    options.maxDiffuse = 0; // of the wall, its emission alone
    options.maxTransmission = 2;
    CHECK(seen(behindGlass, options) == doctest::Approx(1.0));
    options.maxTransmission = 1;
    CHECK(seen(behindGlass, options) == 0.0);

    TestScene beforeMirror;
    addGlowingRoom(beforeMirror);
    Material mirror = constantMaterial("/M/Mirror", Rgb(0.8F));
    mirror.metallic = MaterialInput(1.0F);
    mirror.roughness = MaterialInput(0.0F);
    beforeMirror.add("/Mirror", quadMesh({-1, -1, -2}, {2, 0, 0}, {0, 2, 0}), mirror);
    options.maxReflection = 1;
    CHECK(seen(beforeMirror, options) == doctest::Approx(0.8));
    options.maxReflection = 0;
    CHECK(seen(beforeMirror, options) == 0.0);
}

TEST_CASE("without caustics a mirror gives the floor no more light than a black body does") {
    const auto floorBeside = [](const Material& ball, bool caustics) {
        TestScene test;
        test.add("/Floor", quadMesh({-9, -9, -2}, {18, 0, 0}, {0, 18, 0}),
                 constantMaterial("/M/Floor", Rgb(0.6F)));
        test.add("/Ball", sphereMesh(0.8F, 32, false), ball, translation(1.2, 0, -1.2));
        test.addSky(Rgb(1.0F));
        RenderOptions options = exactOptions(64);
        options.caustics = caustics;
        return aov(*render(test.scene, testCamera({0, 0, 0}, 0.05F), 8, 8, {}, options), "color");
    };
    Material mirror = constantMaterial("/M/Ball", Rgb(1.0F));
    mirror.metallic = MaterialInput(1.0F);
    mirror.roughness = MaterialInput(0.0F);
    const Material black = constantMaterial("/M/Ball", Rgb(0.0F));
    const std::vector<float> without = floorBeside(mirror, false);
    CHECK(without == floorBeside(black, true));
    CHECK(without != floorBeside(mirror, true));
}

TEST_CASE("without blur a lens sees what a pinhole does") {
    TestScene test;
    test.add("/Wall", quadMesh({-0.5F, -0.5F, -3}, {1, 0, 0}, {0, 1, 0}),
             constantMaterial("/M/Wall", Rgb(0.6F)));
    test.addSky(Rgb(1.0F));
    Camera lens = testCamera({0, 0, 0}, 0.3F);
    const Camera pinhole = lens;
    lens.lensRadius = 0.4F;
    lens.focusDistance = 1.0F;
    RenderOptions options = exactOptions(16);
    const auto image = [&](const Camera& camera) {
        return aov(*render(test.scene, camera, 12, 12, {}, options), "color");
    };
    CHECK(image(lens) != image(pinhole));
    options.blur = false;
    CHECK(image(lens) == image(pinhole));
}
