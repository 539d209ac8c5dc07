// The hierarchy of light shapes: what it meets is what a look at every shape meets.
#include "shading/lightShapeTree.h"

#include <limits>

#include "shading/lightLanes.h"
#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Lights of all shapes, or of one, strewn over a hall; some of them at the same place.
std::vector<PreparedLight> manyLights(int count, bool mixed, double spread) {
    constexpr LightType kTypes[] = {LightType::kSphere, LightType::kRect, LightType::kDisk,
                                    LightType::kCylinder};
    std::vector<PreparedLight> lights;
    TestRandom random(31);
    Diagnostics diagnostics;
    const auto between = [&](double a, double b) { return a + (b - a) * random.nextDouble(); };
    for (int i = 0; i < count; ++i) {
        Light light;
        light.type = kTypes[mixed ? i % 4 : 0];
        light.radiance = Rgb(1.0F);
        light.radius = static_cast<float>(between(0.02, 0.3));
        light.width = static_cast<float>(between(0.1, 0.5));
        light.height = light.length = 0.4F;
        light.toWorld.y = {0.0, 0.8, 0.6};
        light.toWorld.z = {0.0, -0.6, between(0.5, 1.5)};
        const double place = i % 7 == 6 ? 0.5 : 1.0;
        light.toWorld.t = {spread * place * between(-1.0, 1.0), spread * between(-1.0, 1.0),
                           spread * between(-1.0, 1.0)};
        const auto prepared = prepareLight(light, Double3(0.0), diagnostics);
        REQUIRE(prepared);
        lights.push_back(*prepared);
        if (i % 10 == 9) {
            lights.push_back(*prepared);
        }
    }
    return lights;
}

LightShapeTree treeOf(const std::vector<PreparedLight>& lights) {
    std::vector<const PreparedLight*> shapes;
    for (const PreparedLight& light : lights) {
        shapes.push_back(&light);
    }
    return LightShapeTree(shapes);
}

/// The first of the nearest, by a look at every one.
LightShapeTree::Hit nearest(const std::vector<PreparedLight>& lights,
                            const LightShapeTree::Ray& ray) {
    LightShapeTree::Hit hit;
    hit.t = ray.tFar;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const float t =
            intersectLight<float>(lights[i], ray.origin, ray.direction, ray.tNear, hit.t);
        if (t > 0.0F && (hit.shape < 0 || t < hit.t)) {
            hit = {static_cast<std::int32_t>(i), t};
        }
    }
    return hit;
}

} // namespace

TEST_CASE("rays meet of many light shapes the nearest, to the bit") {
    for (const bool mixed : {false, true}) {
        for (const int count : {1, 3, 9, 100, 1500}) {
            CAPTURE(mixed);
            CAPTURE(count);
            const double spread = count > 100 ? 9.0 : 4.0;
            const std::vector<PreparedLight> lights = manyLights(count, mixed, spread);
            const LightShapeTree tree = treeOf(lights);
            REQUIRE_FALSE(tree.empty());
            TestRandom random(32);
            int met = 0, ties = 0;
            for (int i = 0; i < 6000; ++i) {
                const auto inside = [&] {
                    return static_cast<float>(spread * (2.4 * random.nextDouble() - 1.2));
                };
                LightShapeTree::Ray ray{{inside(), inside(), inside()},
                                        uniformSphere(random.nextFloat2()),
                                        0.0F,
                                        kInfinity};
                const std::size_t aim = static_cast<std::size_t>(
                    random.nextDouble() * static_cast<double>(lights.size()));
                if (i % 2 == 0) { // at a light, past it, or up to just before it
                    const Bounds& box = lights[aim].bounds;
                    ray.direction = box.center() - ray.origin +
                                    uniformSphere(random.nextFloat2()) * (0.7F * box.radius());
                    ray.tFar = i % 4 == 0 ? kInfinity : 2.0F * random.nextFloat();
                } else if (i % 3 == 0) { // along an axis, from a bound of a shape
                    ray.direction = {0.0F, 0.0F, i % 5 == 0 ? -1.0F : 1.0F};
                    ray.origin.x = lights[aim].bounds.upper.x;
                    ray.origin.y = lights[aim].bounds.center().y;
                }
                const LightShapeTree::Hit truth = nearest(lights, ray), hit = tree.intersect(ray);
                REQUIRE(hit.shape == truth.shape);
                REQUIRE(hit.t == truth.t);
                REQUIRE(tree.occluded(ray) == (truth.shape >= 0));
                met += hit.shape >= 0 ? 1 : 0;
                if (hit.shape >= 0) { // up to where it is, which is met, and to a hair before
                    ray.tFar = hit.t;
                    REQUIRE(tree.intersect(ray).shape == hit.shape);
                    ray.tFar = std::nextafter(hit.t, 0.0F);
                    REQUIRE(tree.intersect(ray).shape == -1);
                    ties += hit.shape + 1 < static_cast<std::int32_t>(lights.size()) &&
                                    lights[static_cast<std::size_t>(hit.shape)].bounds.lower ==
                                        lights[static_cast<std::size_t>(hit.shape) + 1].bounds.lower
                                ? 1
                                : 0;
                }
            }
            CHECK(met > 500);
            CHECK((ties > 0 || count < 10));
        }
    }
}

TEST_CASE("a tree of no light shapes meets nothing") {
    const LightShapeTree tree;
    CHECK(tree.empty());
    CHECK(tree.intersect({{0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 1.0F}, 0.0F, 5.0F}).shape == -1);
    CHECK_FALSE(tree.occluded({{0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 1.0F}, 0.0F, 5.0F}));
}
