#include "integrate/splitting.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/sampler.h"

namespace mbfeat {

namespace {

constexpr std::size_t kPixels = 1024;
constexpr std::size_t kSamples = 4;   ///< of each, twice
constexpr double kRaysOfSample = 1.5; ///< what a sample costs beside its rays, in rays
/// Of few samples the way to the split is stratified worse than of many: the trial finds splitting
/// about a tenth worse than it is (benchmarks.md).
constexpr double kBias = 1.05;
constexpr double kDark = 0.01; ///< what squared errors are relative to at least, as for relMSE

/// Pixels spread over the image, and the samples of each side by side.
std::vector<PixelSample> trialSamples(int width, int height) {
    // Steps of the additive recurrence whose points in the square lie farthest apart (Roberts 2018,
    // "The unreasonable effectiveness of quasirandom sequences").
    constexpr double kStepX = 0.7548776662466927, kStepY = 0.5698402909980532;
    std::vector<PixelSample> samples;
    double u = 0.5, v = 0.5;
    for (std::size_t i = 0; i < kPixels; ++i) {
        u = std::fmod(u + kStepX, 1.0);
        v = std::fmod(v + kStepY, 1.0);
        for (std::size_t s = 0; s < kSamples; ++s) {
            // Blocks of indices of their own, since small images have fewer pixels than that.
            samples.push_back({static_cast<int>(u * width), static_cast<int>(v * height),
                               static_cast<std::uint32_t>(kSamples * i + s)});
        }
    }
    return samples;
}

/// Mean radiance of each pixel's samples.
std::vector<Rgb> trialMeans(const PathContext& context, const std::vector<PixelSample>& samples,
                            std::uint32_t seed, PathWorker& worker) {
    RenderOptions options = context.options;
    options.seed = seed;
    const PathContext trial{context.accel,       context.lights, context.camera,
                            context.filter,      options,        context.primvars,
                            context.recordFlags, context.frame,  context.effects};
    const auto capacity = static_cast<std::size_t>(worker.capacity());
    std::vector<Rgb> means(kPixels, Rgb(0.0F));
    for (std::size_t first = 0; first < samples.size(); first += capacity) {
        const std::size_t count = std::min(capacity, samples.size() - first);
        worker.trace(trial, samples.data() + first, static_cast<int>(count), {});
        const PathRecords records = worker.records();
        for (std::size_t i = 0; i < count; ++i) {
            const Rgb& radiance = records[i].radiance;
            means[(first + i) / kSamples] +=
                isFinite(radiance) ? radiance * (1.0F / kSamples) : Rgb(0.0F);
        }
    }
    return means;
}

/// Squared differences between two estimates of each pixel, relative to its squared mean, times the
/// rays that both took. Samples of an estimate are stratified: their own spread would count what
/// varies within a pixel, which they average out and splitting does not.
double noiseTimesRays(const PathContext& context, const std::vector<PixelSample>& samples,
                      float exposureScale, PathWorker& worker) {
    const std::uint32_t seed =
        sampling::mix32(static_cast<std::uint32_t>(context.options.seed) ^ 0x51B7A2D5U);
    const std::vector<Rgb> first = trialMeans(context, samples, seed, worker);
    const std::vector<Rgb> second = trialMeans(context, samples, seed + 1U, worker);
    double noise = 0.0;
    for (std::size_t i = 0; i < kPixels; ++i) {
        for (int c = 0; c < 3; ++c) {
            const double scale = 0.5 * static_cast<double>(exposureScale);
            const double mean = scale * static_cast<double>(first[i][c] + second[i][c]);
            const double half = scale * static_cast<double>(first[i][c] - second[i][c]);
            noise += half * half / (mean * mean + kDark);
        }
    }
    const PathCounts counts = worker.counts();
    const double rays = static_cast<double>(counts.rays + counts.shadowRays);
    return noise * (rays + kRaysOfSample * static_cast<double>(2 * samples.size()));
}

} // namespace

int fittedBranches(const PathContext& context, int width, int height, float exposureScale,
                   const WorkerMaker& makeWorker) {
    if (context.options.maxBounces < 2) {
        return 1; // nothing is behind the first vertex but what lights send there
    }
    const std::vector<PixelSample> samples = trialSamples(width, height);
    const double whole = noiseTimesRays(context, samples, exposureScale, *makeWorker(1));
    const double split = noiseTimesRays(context, samples, exposureScale, *makeWorker(2));
    return split < kBias * whole ? 2 : 1;
}

} // namespace mbfeat
