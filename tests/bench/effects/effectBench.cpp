// Traces paths of a small scene by a kernel of a module, inside a function whose instructions can
// be counted: valgrind --tool=callgrind --toggle-collect=benchTrace effectBench MODULE SCENE
#define DOCTEST_CONFIG_IMPLEMENT
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include <dlfcn.h>
#include <doctest/doctest.h>

#include "benchScenes.h"
#include "integrate/effectParts.h"
#include "integrate/kernels.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

using Factory = PathWorker* (*)(int capacity, int branches, bool allFields,
                                std::uint32_t recordFlags, std::uint32_t parts);

constexpr int kSide = 24, kSamples = 4;

Factory load(const char* file) {
    void* const module = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) {
        std::fprintf(stderr, "%s\n", dlerror());
        return nullptr;
    }
    return reinterpret_cast<Factory>(dlsym(module, "makeBenchWorker"));
}

} // namespace

extern "C" __attribute__((noinline)) bool benchTrace(const Integrator& integrator,
                                                     PathWorker& worker,
                                                     const std::vector<PixelSample>& samples) {
    return integrator.trace(worker, samples.data(), static_cast<int>(samples.size()), {});
}

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "effectBench MODULE diffuse|opaque|glass|coated|full|everything\n");
        return 2;
    }
    const Factory factory = load(argv[1]);
    if (factory == nullptr) {
        return 1;
    }
    TestScene test;
    fillBenchScene(test, argv[2]);
    const bool everything = std::strcmp(argv[2], "everything") == 0;
    Integrator integrator(test.scene);
    IntegratorRequest request;
    request.options = exactOptions(kSamples);
    request.options.kernel = Kernel::kAvx2;
    request.options.splitting = 1; // what effects cost, whatever pays here
    if (everything) {
        request.recordFlags = recordFlagsOf(EffectSet::all());
        request.primvars = {"st"};
        request.options.effects.forced = Effect::kPathSamples; // is the film's, not the kernel's
    }
    ImageWindow window;
    window.width = window.height = kSide;
    window.data = {0, 0, kSide, kSide};
    if (!integrator.commit(request.options, {}) ||
        integrator.setView(benchCamera(argv[2]), window, request)) {
        return 1;
    }
    const EffectSet effects = integrator.kernel().handled;
    const std::uint32_t parts = choosePrebuilt(Kernel::kAvx2, closureParts(effects));
    const std::unique_ptr<PathWorker> worker(
        factory(kSide * kSide * kSamples, 1, everything, request.recordFlags, parts));
    std::vector<PixelSample> samples;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            for (std::uint32_t s = 0; s < kSamples; ++s) {
                samples.push_back({x, y, s});
            }
        }
    }
    if (!benchTrace(integrator, *worker, samples)) {
        return 1;
    }
    // A check that all kernels did the same work, and what is left out can be.
    double sum = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        sum += static_cast<double>(worker->records()[i].radiance.y);
    }
    std::printf("%s|%.17g", prebuiltName(parts), sum);
    for (const std::string& name : effectNames(effects)) {
        std::printf("|%s", name.c_str());
    }
    std::printf("\n");
    return 0;
}
