// Estimators at their limits: densities near zero, weights of 0/0, paths of nearly no throughput;
// light sampling, scattering and both must agree.
#include "families.h"

#include <algorithm>
#include <memory>

#include "core/floatTraps.h"
#include "core/frame.h"
#include "integrate/kernel/kernelState.h"
#include "rendering.h"
#include "shading/bsdfCases.h"
#include "shading/lightSampler.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;
using test::TestScene;

/// The power heuristic against the same in long double, and both shares against 1.
void checkMisWeights(Report& report) {
    const float densities[] = {0.0F,  1e-38F, 1e-30F, 1e-20F, 1e-9F, 0.1F, 1.0F,
                               1.01F, 1e9F,   1e18F,  1e20F,  1e30F, 3e38F};
    for (const float a : densities) {
        for (const float b : densities) {
            // The ratio may be infinite: its inverse is the right zero then.
            const FloatTrapsMasked infinite;
            const float w = misWeight(a, b);
            const long double la = a, lb = b;
            const auto truth =
                static_cast<double>(a > 0.0F ? 1.0L / (1.0L + (lb / la) * (lb / la)) : 0.0L);
            const auto where = [&] { return Text().add("pdf", a).add("other", b).add("w", w); };
            report.error(std::abs(static_cast<double>(w) - truth), where);
            if (a > 0.0F && b > 0.0F) {
                report.error(std::abs(static_cast<double>(w + misWeight(b, a)) - 1.0), where);
            }
        }
    }
}

/// A floor in the shading frame under one light.
struct Bench {
    SurfaceParameters<float> surface;
    Light light;
    Float3 wo{0.0F, 0.0F, 1.0F};
    bool delta = false; ///< light samples have a weight of their own
};

enum class Strategy { kLight, kScattering, kBoth };

/// Batches of estimates of the light reflected to wo, by one strategy or both.
std::vector<double> estimates(const Bench& bench, Strategy strategy, int batches, int count,
                              std::uint64_t seed) {
    Diagnostics diagnostics;
    LightSampler lights;
    lights.commit({std::make_shared<const Light>(bench.light)}, Double3(0.0), 1.0F, {},
                  diagnostics);
    const LightReceiver receiver{Float3(0.0F), {0.0F, 0.0F, 1.0F}, false};
    const Bsdf<float> bsdf(bench.surface, true);
    TestRandom random(seed);
    std::vector<double> values;
    for (int b = 0; b < batches; ++b) {
        double sum = 0.0;
        for (int i = 0; i < count; ++i) {
            const float choice = random.nextFloat();
            const Float2 u = random.nextFloat2();
            if (strategy != Strategy::kScattering) {
                const LightSample s = lights.sample(receiver, choice, u);
                const BsdfValue<float> f = bsdf.evaluate(bench.wo, s.wi);
                if (s.pdf > 0.0F) {
                    const float w = strategy == Strategy::kBoth ? misWeight(s.pdf, f.pdf) : 1.0F;
                    sum += static_cast<double>(f.total().x * s.radiance.x * (w / s.pdf));
                }
            }
            if (strategy != Strategy::kLight) {
                const BsdfSample<float> s = bsdf.sample(bench.wo, choice, u);
                const float t = s.pdf > 0.0F && s.wi.z > 0.0F
                                    ? lights.intersectShape(0, receiver.p, s.wi, 0.0F, 1e30F)
                                    : -1.0F;
                if (t > 0.0F) {
                    const LightHit hit = lights.evaluateHit(0, receiver, s.wi, t);
                    const float w = strategy == Strategy::kBoth ? misWeight(s.pdf, hit.pdf) : 1.0F;
                    sum += static_cast<double>(s.weight.x * hit.radiance.x * w);
                }
            }
        }
        values.push_back(sum / count);
    }
    return values;
}

/// Standard score of the difference of two sets of independent estimates.
double scoreOf(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> difference;
    for (std::size_t i = 0; i < a.size(); ++i) {
        difference.push_back(a[i] - b[i]);
    }
    return std::abs(standardScore(difference, 0.0));
}

void checkStrategies(Report& report, const Bench& bench, bool scatteringCan) {
    const std::vector<double> both = estimates(bench, Strategy::kBoth, 256, 4096, 1);
    const std::vector<double> sampled = estimates(bench, Strategy::kLight, 256, 4096, 2);
    double brightness = 0.0;
    for (const double v : both) {
        brightness += v / 256.0;
    }
    report.require(brightness > 0.0, [] { return std::string("no light"); });
    report.error(scoreOf(both, sampled),
                 [&] { return "light sampling; " + std::string(Text().add("mean", brightness)); });
    if (scatteringCan) {
        const std::vector<double> scattered = estimates(bench, Strategy::kScattering, 256, 4096, 3);
        report.error(scoreOf(both, scattered),
                     [&] { return "scattering; " + std::string(Text().add("mean", brightness)); });
    }
}

Bench bench(float roughness, float metallic, float radius, double distance) {
    Bench b;
    b.surface.diffuseColor = Float3(0.8F);
    b.surface.roughness = roughness;
    b.surface.metallic = metallic;
    b.light.path = "/Light";
    b.light.type = LightType::kSphere;
    b.light.radius = radius;
    b.light.radiance = Rgb(3.0F);
    // Where the mirror image of the view is.
    const Float3 wo = test::direction(0.6, 0.0);
    b.wo = wo;
    b.light.toWorld.t = Double3(-wo.x, -wo.y, wo.z) * distance;
    return b;
}

void addStrategies(Catalogue& catalogue) {
    const auto add = [&](const std::string& name, const Bench& b, bool scatteringCan) {
        catalogue.push_back({"estimator/strategies-" + name,
                             "light reflected by light samples, by scattering and by both, scores "
                             "of the differences",
                             kLargestZ, kReasonZ,
                             [=](Report& report) { checkStrategies(report, b, scatteringCan); }});
    };
    add("rough-large-light", bench(1.0F, 0.0F, 1.0F, 2.0), true);
    add("glossy-small-light", bench(0.3F, 1.0F, 0.05F, 2.0), true);
    add("narrow-lobe-large-light", bench(0.03F, 1.0F, 1.0F, 1.5), true);
    add("narrow-lobe-small-light", bench(0.05F, 1.0F, 3e-3F, 2.0), true);
    add("light-of-1e-6", bench(0.3F, 1.0F, 1e-6F, 1.0), false);
    Bench grazing = bench(0.2F, 1.0F, 0.3F, 2.0);
    grazing.wo = test::direction(0.01, 0.0);
    grazing.light.toWorld.t = {-2.0, 0.0, 0.1}; // half below the horizon
    add("half-set-light-grazing", grazing, true);
    Bench plastic = bench(0.1F, 0.0F, 0.5F, 1.0);
    plastic.surface.clearcoat = 1.0F;
    plastic.surface.clearcoatRoughness = 0.0F;
    add("plastic-under-smooth-coat", plastic, false);
}

/// Inside of a closed grey emitter: e / (1 - a), whatever roulette does.
Estimate renderInside(float albedo, int rouletteStart, std::uint64_t seed, int samples,
                      int maxBounces) {
    TestScene test;
    Material material = test::constantMaterial("/M", Rgb(albedo));
    material.emissiveColor = MaterialInput(Rgb(1.0F));
    test.add("/Ball", facetedSphere(1.0F, 32, true), material);
    RenderOptions options = plainOptions(samples, maxBounces);
    options.russianRouletteStart = rouletteStart;
    options.seed = seed;
    return trace(test, test::testCamera({0, 0, 0.3}, 1.0F), 16, 16, options);
}

void addRoulette(Catalogue& catalogue) {
    for (const auto& [name, albedo] : {std::pair("1e-30", 1e-30F), std::pair("1e-6", 1e-6F),
                                       std::pair("0.5", 0.5F), std::pair("0.95", 0.95F)}) {
        catalogue.push_back({std::string("estimator/roulette-albedo-") + name,
                             "radiance inside a closed emitter against e / (1 - albedo), roulette "
                             "from the first vertex, score",
                             kLargestZ, kReasonZ, [albedo = albedo](Report& report) {
                                 const Estimate e = renderInside(albedo, 0, 1, 256, 1024);
                                 report.error(score(e, 1.0 / (1.0 - static_cast<double>(albedo))));
                                 report.picture(e.picture("inside"));
                             }});
    }
    catalogue.push_back({"estimator/roulette-on-and-off",
                         "roulette from the first vertex against none, score of the difference",
                         kLargestZ, kReasonZ, [](Report& report) {
                             const Estimate on = renderInside(0.7F, 0, 1, 128, 64);
                             const Estimate off = renderInside(0.7F, 64, 2, 128, 64);
                             report.error(score(on, off));
                         }});
}

/// A lamp whose light reaches the receiver through a slit, or hardly at all.
void checkShadowless(Report& report) {
    const auto render = [](bool shadows, std::uint64_t seed) {
        TestScene test;
        test.add("/Floor", test::quadMesh({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}),
                 test::constantMaterial("/M", Rgb(0.5F)));
        Light lamp;
        lamp.path = "/Lamp";
        lamp.type = LightType::kSphere;
        lamp.radius = 0.5F;
        lamp.toWorld.t = {0, 2, 0};
        lamp.castsShadows = shadows;
        test.scene.setLight(lamp);
        Camera camera = test::testCamera({0, 1, 0}, 0.5F);
        camera.toWorld.y = {0, 0, -1};
        camera.toWorld.z = {0, 1, 0};
        RenderOptions options = plainOptions(256, 1);
        options.seed = seed;
        return trace(test, camera, 16, 16, options);
    };
    report.error(score(render(true, 1), render(false, 2)));
}

/// The same scene by float lanes of any width: bit for bit.
void checkKernels(Report& report) {
    const auto render = [](Kernel kernel) {
        TestScene test;
        Material glass = test::constantMaterial("/M/Glass", Rgb(1.0F));
        glass.opacity = MaterialInput(0.0F);
        glass.roughness = MaterialInput(1e-3F);
        glass.ior = MaterialInput(10.0F);
        test.add("/Ball", facetedSphere(1.0F, 24), glass, skew(1.0));
        Material metal = test::constantMaterial("/M/Metal", Rgb(1.0F));
        metal.metallic = MaterialInput(1.0F);
        metal.roughness = MaterialInput(0.0142F);
        test.add("/Floor", test::quadMesh({-9, -1, 9}, {18, 0, 0}, {0, 0, -18}), metal);
        Light sun;
        sun.path = "/Sun";
        sun.type = LightType::kDistant;
        sun.angle = 1e-3F;
        sun.radiance = Rgb(1e9F);
        test.scene.setLight(sun);
        test.addSky(Rgb(1e-20F));
        RenderOptions options = plainOptions(64, 32);
        options.kernel = kernel;
        return trace(test, test::testCamera({0, 0.5, 5}, 0.5F), 16, 16, options).grey();
    };
    const std::vector<double> scalar = render(Kernel::kScalar);
    const std::vector<double> wide = render(Kernel::kAuto);
    for (std::size_t i = 0; i < scalar.size(); ++i) {
        report.error(std::abs(scalar[i] - wide[i]),
                     [&] { return Text().add("scalar", scalar[i]).add("lanes", wide[i]); });
    }
}

} // namespace

void addEstimators(Catalogue& catalogue) {
    catalogue.push_back({"estimator/mis-weights",
                         "power heuristic of densities from 0 to 3e38 against long double, and "
                         "both shares against 1",
                         3e-7, "a quotient, its square and an inverse: four roundings",
                         checkMisWeights});
    addStrategies(catalogue);
    addRoulette(catalogue);
    catalogue.push_back({"estimator/light-samples-alone",
                         "a lamp without shadows in the open, which light samples alone find, "
                         "against one with, score of the difference",
                         kLargestZ, kReasonZ, checkShadowless});
    catalogue.push_back({"estimator/kernels-at-limits",
                         "lanes against the scalar kernel on glass of index 10, a narrow lobe and "
                         "a sun of 1e9",
                         0.0, "every kernel gives every path the same bits", checkKernels});
}

} // namespace mbfeat::stability
