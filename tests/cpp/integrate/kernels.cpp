// Kernels and batches: a path's record depends on its sample alone.
#include "integrate/kernels.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <functional>

#include <doctest/doctest.h>

#include "film/temporaryDirectory.h"
#include "integrate/kernel/raySort.h"
#include "scene/imageFiles.h"
#include "support/check.h"
#include "support/chiSquared.h"
#include "testScenes.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

constexpr Kernel kKernels[] = {Kernel::kScalar, Kernel::kAvx2, Kernel::kAvx512};

/// Lights of every shape, tilted: `count` of them.
void addLamps(TestScene& test, int count) {
    constexpr LightType kTypes[] = {LightType::kRect, LightType::kDisk, LightType::kCylinder,
                                    LightType::kSphere};
    for (int i = 0; i < count; ++i) {
        Light lamp;
        lamp.path = "/Lamp" + std::to_string(i);
        lamp.type = kTypes[i % 4];
        lamp.radiance = Rgb(4.0F, 3.0F, 5.0F);
        lamp.width = 0.6F;
        lamp.height = 0.4F;
        lamp.radius = 0.2F;
        lamp.length = 0.7F;
        lamp.toWorld.y = {0.0, 0.8, 0.6};
        lamp.toWorld.z = {0.0, -0.6, 0.8};
        lamp.toWorld.t = {0.5 * i - 2.0, 1.5, -2.0 - 0.2 * i};
        test.scene.setLight(lamp);
    }
    Light sun;
    sun.path = "/Sun";
    sun.type = LightType::kDistant;
    sun.radiance = Rgb(200.0F);
    sun.angle = 3.0F;
    test.scene.setLight(sun);
}

/// Diffuse, metal, instanced rough glass, emission and lights: with a cut-out, a sphere light and a
/// sky, or with `lamps` lights of all shapes.
void fillScene(TestScene& test, int lamps = 0) {
    test.add("/Floor", quadMesh({-9, -1, 4}, {18, 0, 0}, {0, 0, -18}),
             constantMaterial("/M/Floor", {0.6F, 0.5F, 0.4F}));
    Material metal = constantMaterial("/M/Metal", {0.9F, 0.7F, 0.3F});
    metal.metallic = MaterialInput(1.0F);
    metal.roughness = MaterialInput(0.0F);
    test.add("/Metal", sphereMesh(0.7F, 24, false), metal, translation(-1.2, -0.3, -3));
    Material glass = constantMaterial("/M/Glass", {0.9F, 0.95F, 1.0F});
    glass.opacity = MaterialInput(0.0F);
    glass.roughness = MaterialInput(0.2F);
    glass.clearcoat = MaterialInput(0.5F);
    test.addInstances("/Glass", sphereMesh(0.7F, 24, false), glass,
                      {translation(1.2, -0.3, -3), translation(0.2, 0.6, -4)});
    Material veil = constantMaterial("/M/Veil", {0.3F, 0.3F, 0.8F});
    veil.opacity = MaterialInput(0.4F);
    veil.opacityMode = OpacityMode::kPresence;
    if (lamps > 0) {
        addLamps(test, lamps);
    } else {
        test.add("/Veil", quadMesh({-2, -1, -2}, {1.5, 0, 0}, {0, 2, 0}), veil);
    }
    Material glow = constantMaterial("/M/Glow", {0.2F, 0.2F, 0.2F});
    glow.emissiveColor = MaterialInput(Rgb(3.0F, 2.0F, 1.0F));
    test.add("/Glow", quadMesh({0, -0.9F, -2.5F}, {0.4F, 0, 0}, {0, 0, 0.4F}), glow);
    Light lamp;
    lamp.path = "/Lamp";
    lamp.type = LightType::kSphere;
    lamp.radiance = Rgb(6.0F);
    lamp.diffuse = 0.7F;
    lamp.toWorld.t = {0.5, 2, -2};
    test.scene.setLight(lamp);
    test.add("/Wall", quadMesh({-9, -1, -6}, {18, 0, 0}, {0, 9, 0}),
             constantMaterial("/M/Wall", {0.7F, 0.7F, 0.7F}));
    test.add("/Ceiling", quadMesh({-9, 4, -6}, {18, 0, 0}, {0, 0, 12}),
             constantMaterial("/M/Wall", {0.7F, 0.7F, 0.7F}));
    test.addSky(Rgb(0.2F, 0.3F, 0.5F));
}

/// Traces 23 x 17 pixels of a scene, four samples each, in batches of at most `batch`, and hands
/// over each record. `prebuilt`, where it is not null, becomes the name of the kernel's set of
/// parts.
void traceScene(TestScene& test, const RenderOptions& options, std::uint32_t recordFlags,
                std::size_t batch, std::string* prebuilt,
                const std::function<void(const PathRecord&)>& take) {
    Integrator integrator(test.scene);
    IntegratorRequest request;
    request.options = options;
    request.options.pixelFilter = PixelFilter::kMitchell;
    request.options.pixelFilterWidth = 4.0F;
    request.recordFlags = recordFlags;
    constexpr int kColumns = 23, kRows = 17;
    prepareView(integrator, request, testCamera({0, 0.5, 2}, 0.7F), kColumns, kRows);
    if (prebuilt != nullptr) {
        *prebuilt = integrator.kernel().prebuilt;
    }
    const std::unique_ptr<PathWorker> worker = integrator.makeWorker();
    REQUIRE(batch <= static_cast<std::size_t>(worker->capacity()));

    std::vector<PixelSample> samples;
    for (int y = 0; y < kRows; ++y) {
        for (int x = 0; x < kColumns; ++x) {
            for (std::uint32_t s = 0; s < 4; ++s) {
                samples.push_back({x, y, s});
            }
        }
    }
    for (std::size_t i = 0; i < samples.size(); i += batch) {
        const auto count = static_cast<int>(std::min(batch, samples.size() - i));
        REQUIRE(integrator.trace(*worker, samples.data() + i, count, {}));
        for (int k = 0; k < count; ++k) {
            take(worker->records()[static_cast<std::size_t>(k)]);
        }
    }
}

/// With all that can be recorded.
std::vector<PathRecord> recordsOf(TestScene& test, const RenderOptions& options,
                                  std::size_t batch = 1000, std::string* prebuilt = nullptr) {
    constexpr std::uint32_t kAll = kRecordFeatures | kRecordContributions | kRecordExtended |
                                   kRecordFirstNonDelta | kRecordFirstHit | kRecordPrimvars;
    std::vector<PathRecord> result;
    traceScene(test, options, kAll, batch, prebuilt,
               [&](const PathRecord& record) { result.push_back(record); });
    return result;
}

/// What paths that may split bring: red, green, blue and the depth of the first hit of each.
std::vector<float> valuesOf(TestScene& test, const RenderOptions& options, std::size_t batch) {
    std::vector<float> result;
    traceScene(test, options, kRecordFirstHit, batch, nullptr, [&](const PathRecord& record) {
        result.insert(result.end(), {record.radiance.x, record.radiance.y, record.radiance.z,
                                     record.cameraDepth});
    });
    return result;
}

RenderOptions optionsOf(Kernel kernel) {
    RenderOptions options = exactOptions(4);
    options.kernel = kernel;
    return options;
}

std::vector<PathRecord> records(Kernel kernel, std::size_t batch, int lamps = 0) {
    TestScene test;
    fillScene(test, lamps);
    return recordsOf(test, optionsOf(kernel), batch);
}

/// Number of records that differ in any bit of their values.
int different(const std::vector<PathRecord>& a, const std::vector<PathRecord>& b) {
    REQUIRE(a.size() == b.size());
    int count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        // All but the flag and the padding.
        const auto same = [&](std::size_t begin, std::size_t end) {
            return std::memcmp(reinterpret_cast<const char*>(&a[i]) + begin,
                               reinterpret_cast<const char*>(&b[i]) + begin, end - begin) == 0;
        };
        const bool equal = same(0, offsetof(PathRecord, nonFinite)) &&
                           same(offsetof(PathRecord, features), offsetof(PathRecord, primvars));
        count += equal ? 0 : 1;
    }
    return count;
}

} // namespace

TEST_CASE("the widest kernel that the processor runs is chosen") {
    const bool wide = wideKernelIsBuilt() && __builtin_cpu_supports("avx512f") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    CHECK(chooseKernel(Kernel::kAuto) == (wide ? Kernel::kAvx512 : Kernel::kAvx2));
    CHECK(chooseKernel(Kernel::kScalar) == Kernel::kScalar);
    CHECK(chooseKernel(Kernel::kAvx2) == Kernel::kAvx2);
    CHECK(kernelProblem(Kernel::kAuto).empty());
    CHECK(kernelProblem(Kernel::kAvx512).empty() == wide);
}

TEST_CASE("every kernel gives every path the same bits") {
    const std::vector<PathRecord> reference = records(Kernel::kScalar, 1000);
    int reached = 0;
    for (const PathRecord& record : reference) {
        reached += record.vertexCount > 3 ? 1 : 0;
    }
    CHECK(reached > 200); // else the scene proves little
    for (const Kernel kernel : kKernels) {
        CAPTURE(kernelName(chooseKernel(kernel)));
        CHECK(different(records(kernel, 1000), reference) == 0);
    }
}

TEST_CASE("and so with few lights, which are met one by one, and many") {
    for (const int lamps : {4, 13}) {
        CAPTURE(lamps);
        const std::vector<PathRecord> reference = records(Kernel::kScalar, 1000, lamps);
        for (const Kernel kernel : kKernels) {
            CAPTURE(kernelName(chooseKernel(kernel)));
            CHECK(different(records(kernel, 1000, lamps), reference) == 0);
        }
    }
}

TEST_CASE("and so under a sky with an image, alone and among other lights") {
    const TemporaryDirectory folder;
    constexpr int kWidth = 40, kHeight = 20;
    for (const bool isHalf : {false, true}) {
        std::vector<float> texels(static_cast<std::size_t>(kWidth) * kHeight, 0.3F);
        texels[5 * kWidth + 12] = 90.0F;
        std::vector<float> red = texels;
        red[3 * kWidth + 30] = 20.0F;
        const Imf::PixelType type = isHalf ? Imf::HALF : Imf::FLOAT;
        writeExr(folder.file(isHalf ? "half.exr" : "float.exr"), Imf::Header(kWidth, kHeight),
                 {{"R", type, red}, {"G", type, texels}, {"B", type, texels}});
    }
    // With shadows and without, seen and hidden, with multipliers: `kind` says which.
    for (int kind = 0; kind < 6; ++kind) {
        CAPTURE(kind);
        TestScene test;
        if (kind == 0) {
            test.add("/Floor", quadMesh({-9, -1, 4}, {18, 0, 0}, {0, 0, -18}),
                     constantMaterial("/M/Floor", {0.6F, 0.5F, 0.4F}));
            test.add("/Ball", sphereMesh(0.7F, 24, false),
                     constantMaterial("/M/Ball", {0.7F, 0.8F, 0.4F}), translation(0.2, 0, -2));
        } else {
            fillScene(test, kind % 2 == 0 ? 0 : 5);
            test.scene.removeGeometry("/Ceiling");
        }
        Light sky;
        sky.path = "/Sky";
        sky.type = LightType::kDome;
        sky.radiance = Rgb(0.6F, 0.7F, 0.8F);
        sky.toWorld.x = {0.0, 0.0, -1.0};
        sky.toWorld.z = {1.0, 0.0, 0.0};
        sky.hasTexture = true;
        sky.texture.path = folder.file(kind % 3 == 1 ? "half.exr" : "float.exr");
        sky.castsShadows = kind != 2;
        sky.visibleToCamera = kind != 3;
        sky.specular = kind == 4 ? 0.25F : 1.0F;
        test.scene.setLight(sky);
        const std::vector<PathRecord> reference = recordsOf(test, optionsOf(Kernel::kScalar));
        CHECK(std::any_of(test.scene.lights().begin(), test.scene.lights().end(),
                          [](const auto& light) { return light->image != nullptr; }));
        for (const Kernel kernel : {Kernel::kAvx2, Kernel::kAvx512}) {
            CAPTURE(kernelName(chooseKernel(kernel)));
            CHECK(different(recordsOf(test, optionsOf(kernel)), reference) == 0);
            CHECK(different(recordsOf(test, optionsOf(kernel), 7), reference) == 0);
        }
    }
}

TEST_CASE("the camera sees the skies that are not hidden from it, and all of them light") {
    for (const Kernel kernel : kKernels) {
        CAPTURE(kernelName(chooseKernel(kernel)));
        const auto recordsUnder = [&](bool isSeen) {
            TestScene test;
            test.add("/Floor", quadMesh({-9, -1, 4}, {18, 0, 0}, {0, 0, -18}),
                     constantMaterial("/M/Floor", {0.6F, 0.5F, 0.4F}));
            for (const bool isFirst : {true, false}) {
                Light sky;
                sky.path = isFirst ? "/First" : "/Second";
                sky.type = LightType::kDome;
                sky.radiance = isFirst ? Rgb(0.25F) : Rgb(0.0F, 0.5F, 1.0F);
                sky.visibleToCamera = isFirst || isSeen;
                test.scene.setLight(sky);
            }
            return recordsOf(test, optionsOf(kernel));
        };
        for (const bool isSeen : {true, false}) {
            CAPTURE(isSeen);
            const Rgb expected = isSeen ? Rgb(0.25F, 0.75F, 1.25F) : Rgb(0.25F);
            int above = 0, lit = 0;
            for (const PathRecord& record : recordsUnder(isSeen)) {
                if (record.alpha == 0.0F) {
                    ++above;
                    CHECK(isNear(record.radiance.x, expected.x, 1e-6));
                    CHECK(isNear(record.radiance.y, expected.y, 1e-6));
                    CHECK(isNear(record.radiance.z, expected.z, 1e-6));
                } else {
                    lit += record.radiance.z > 0.3F ? 1 : 0; // more than the first alone can do
                }
            }
            CHECK(above > 0);
            CHECK(lit > 0);
        }
    }
}

TEST_CASE("and so where paths split, whatever else is in the batch") {
    for (const int branches : {2, 3}) {
        CAPTURE(branches);
        TestScene test;
        fillScene(test, 0);
        RenderOptions options = optionsOf(Kernel::kScalar);
        options.splitting = branches;
        const std::vector<float> reference = valuesOf(test, options, 500);
        options.splitting = 1;
        CHECK(valuesOf(test, options, 500) != reference);
        options.splitting = branches;
        for (const Kernel kernel : kKernels) {
            CAPTURE(kernelName(chooseKernel(kernel)));
            options.kernel = kernel;
            for (const std::size_t batch : {std::size_t{7}, std::size_t{500}}) {
                CAPTURE(batch);
                CHECK(valuesOf(test, options, batch) == reference);
            }
        }
    }
}

TEST_CASE("paths that are recorded do not split") {
    TestScene test;
    fillScene(test, 0);
    RenderOptions options = optionsOf(Kernel::kAuto);
    options.splitting = 1;
    const std::vector<PathRecord> reference = recordsOf(test, options);
    options.splitting = 4;
    CHECK(different(recordsOf(test, options), reference) == 0);
}

TEST_CASE("a path's record does not depend on what else is in its batch") {
    for (const Kernel kernel : kKernels) {
        CAPTURE(kernelName(chooseKernel(kernel)));
        const std::vector<PathRecord> reference = records(kernel, 1000);
        for (const std::size_t batch : {std::size_t{1}, std::size_t{7}, std::size_t{100}}) {
            CAPTURE(batch);
            CHECK(different(records(kernel, batch), reference) == 0);
        }
    }
}

TEST_CASE("a kernel without what the scene does not call for gives every path the same bits") {
    struct Case {
        const char* prebuilt;
        std::function<void(TestScene&)> fill;
    };
    const auto wall = [](TestScene& test, const Material& material) {
        test.add("/Wall", quadMesh({-2, -1, -4}, {4, 0, 0}, {0, 3, 0}), material);
        test.add("/Floor", quadMesh({-9, -1, 4}, {18, 0, 0}, {0, 0, -18}),
                 constantMaterial("/M/Floor", {0.6F, 0.5F, 0.4F}));
        test.add("/Ball", sphereMesh(0.7F, 24, false), material, translation(0.2, 0, -2));
        test.addSky(Rgb(0.2F, 0.3F, 0.5F));
    };
    const Case cases[] = {
        {"diffuse",
         [&](TestScene& test) {
             wall(test, constantMaterial("/M/A", {0.8F, 0.3F, 0.2F}));
             test.scene.removeLight("/Sky");
             test.addLamp(2.0);
         }},
        {"diffuse",
         [&](TestScene& test) {
             Material material = constantMaterial("/M/A", {0.0F, 0.3F, 0.2F});
             material.clearcoat = MaterialInput(1.0F);
             material.emissiveColor = MaterialInput(Rgb(0.5F));
             wall(test, material);
             test.addLamp(2.0);
         }},
        {"opaque",
         [&](TestScene& test) {
             Material material = constantMaterial("/M/A", {0.8F, 0.7F, 0.2F});
             material.metallic = MaterialInput(0.6F);
             material.roughness = MaterialInput(0.1F);
             wall(test, material);
             addLamps(test, 3);
         }},
        {"glass",
         [&](TestScene& test) {
             Material material = constantMaterial("/M/A", {0.9F, 0.7F, 0.8F});
             material.opacity = MaterialInput(0.3F);
             material.ior = MaterialInput(1.4F);
             material.roughness = MaterialInput(0.0F);
             wall(test, material);
         }},
        {"coated",
         [&](TestScene& test) {
             Material material = constantMaterial("/M/A", {0.3F, 0.3F, 0.8F});
             material.useSpecularWorkflow = true;
             material.specularColor = MaterialInput(Rgb(0.2F, 0.3F, 0.1F));
             wall(test, material);
             addLamps(test, 12);
         }},
        {"full", [](TestScene& test) { fillScene(test, 3); }},
        {"full", [](TestScene& test) { fillScene(test); }},
    };
    for (const Case& c : cases) {
        CAPTURE(c.prebuilt);
        TestScene test;
        c.fill(test);
        for (const Kernel kernel : {Kernel::kAvx2, Kernel::kAvx512}) {
            CAPTURE(kernelName(chooseKernel(kernel)));
            RenderOptions options = optionsOf(kernel);
            std::string chosen, forced;
            const std::vector<PathRecord> own = recordsOf(test, options, 1000, &chosen);
            CHECK(chosen == c.prebuilt);
            options.effects.full = true;
            CHECK(different(recordsOf(test, options, 1000, &forced), own) == 0);
            CHECK(forced == "full");
            // One effect after the other, too: no handling of what is absent changes anything.
            options.effects.full = false;
            for (const EffectDescriptor& row : effectTable()) {
                CAPTURE(row.name);
                options.effects.forced = row.effect;
                CHECK(different(recordsOf(test, options), own) == 0);
            }
        }
        CHECK(different(recordsOf(test, optionsOf(Kernel::kScalar)),
                        recordsOf(test, optionsOf(Kernel::kAvx2))) == 0);
    }
}

TEST_CASE("limits on kinds of scattering are the same to the bit in all kernels") {
    TestScene test;
    fillScene(test, 4);
    RenderOptions options = optionsOf(Kernel::kScalar);
    const std::vector<PathRecord> unlimited = recordsOf(test, options);
    options.maxDiffuse = 1;
    options.maxTransmission = 2;
    options.caustics = false;
    const std::vector<PathRecord> reference = recordsOf(test, options);
    CHECK(different(unlimited, reference) > 100);
    for (const Kernel kernel : {Kernel::kAvx2, Kernel::kAvx512}) {
        options.kernel = kernel;
        CHECK(different(recordsOf(test, options), reference) == 0);
    }
}

TEST_CASE("a limit on what no surface does changes nothing") {
    TestScene test;
    Material metal = constantMaterial("/M/Metal", {0.9F, 0.7F, 0.3F});
    metal.metallic = MaterialInput(0.5F);
    metal.roughness = MaterialInput(0.2F);
    test.add("/Ball", sphereMesh(0.7F, 24, false), metal, translation(0, 0, -2));
    test.add("/Wall", quadMesh({-2, -1, -4}, {4, 0, 0}, {0, 3, 0}), metal);
    addLamps(test, 3);
    RenderOptions options = optionsOf(Kernel::kAuto);
    const std::vector<PathRecord> unlimited = recordsOf(test, options);
    options.maxTransmission = 0;
    REQUIRE(options.limitsKinds());
    CHECK(different(recordsOf(test, options), unlimited) == 0);
}

TEST_CASE("a batch that is told to stop says so") {
    TestScene test;
    fillScene(test);
    Integrator integrator(test.scene);
    IntegratorRequest request;
    request.options = exactOptions(1);
    prepareView(integrator, request, testCamera({0, 0.5, 2}, 0.7F), 4, 4);
    const std::unique_ptr<PathWorker> worker = integrator.makeWorker();
    const PixelSample sample{1, 1, 0};
    CHECK_FALSE(integrator.trace(*worker, &sample, 1, [] { return true; }));
    CHECK(integrator.statistics().paths == 0);
    CHECK(integrator.trace(*worker, &sample, 1, [] { return false; }));
    CHECK(integrator.statistics().paths == 1);
}

TEST_CASE("sorting rays loses none and brings those of one octant together") {
    TestRandom random(5);
    std::vector<RayPlace> rays;
    std::vector<std::int32_t> list;
    for (std::int32_t i = 0; i < 5000; ++i) {
        const auto number = [&] { return static_cast<float>(4.0 * random.nextDouble() - 2.0); };
        rays.push_back({{number(), number(), number()}, {number(), number(), number()}});
        list.push_back(i);
    }
    Bounds bounds;
    bounds.add(Float3(-1.0F)); // rays may start outside
    bounds.add(Float3(1.0F));
    RaySorter sorter;
    sorter.sort(list, bounds, [&](std::int32_t i) { return rays[static_cast<std::size_t>(i)]; });
    std::vector<bool> seen(rays.size(), false);
    int changes = 0;
    int before = -1;
    for (const std::int32_t i : list) {
        const auto index = static_cast<std::size_t>(i);
        CHECK_FALSE(seen[index]);
        seen[index] = true;
        const Float3& d = rays[index].direction;
        const int octant = (d.x < 0.0F ? 1 : 0) + (d.y < 0.0F ? 2 : 0) + (d.z < 0.0F ? 4 : 0);
        changes += octant != before ? 1 : 0;
        before = octant;
    }
    CHECK(changes == 8);
}
