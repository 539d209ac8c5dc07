#include "integrate/splitting.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/sampler.h"

namespace mbfeat {

namespace {

constexpr std::size_t kPixels = 1024;
constexpr std::size_t kSamples = 4;   ///< of each, twice
constexpr double kRaysOfSample = 1.5; ///< what a sample costs beside its rays, in rays
/// Two branches are taken below so many times the noise times rays of one, four below that of two.
/// Of few samples the way to the split is stratified worse than of many: the trial finds the first
/// of these steps about a tenth worse than it is (benchmarks.md).
constexpr double kBiasOfTwo = 1.05;
constexpr double kDark = 0.01; ///< what squared errors are relative to at least, as for relMSE
constexpr int kMostBranches = 4;
/// A trial of all numbers of branches has no more paths than the image itself.
constexpr double kLeastPaths = 3.0 * 2 * kPixels * kSamples;

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

/// Mean radiance of each pixel's samples; nothing when it was stopped.
std::vector<Rgb> trialMeans(const PathContext& context, const std::vector<PixelSample>& samples,
                            std::uint64_t seed, PathWorker& worker, const StopCheck& stop) {
    RenderOptions options = context.options;
    options.seed = seed;
    PathContext trial = context.with(options);
    trial.frame = 0;
    const auto capacity = static_cast<std::size_t>(worker.capacity());
    std::vector<Rgb> means(kPixels, Rgb(0.0F));
    for (std::size_t first = 0; first < samples.size(); first += capacity) {
        const std::size_t count = std::min(capacity, samples.size() - first);
        if (!worker.trace(trial, samples.data() + first, static_cast<int>(count), stop)) {
            return {};
        }
        const PathRecords records = worker.records();
        for (std::size_t i = 0; i < count; ++i) {
            const Rgb& radiance = records[i].radiance;
            means[(first + i) / kSamples] +=
                isFinite(radiance) ? radiance * (1.0F / kSamples) : Rgb(0.0F);
        }
    }
    return means;
}

struct Trial {
    double noise = 0.0, rays = 0.0;

    /// What an image of that noise takes, or one whose noise may be `enough`.
    double cost(double enough) const { return std::max(noise, enough) * rays; }
};

/// The noise of a trial of which a view is about at its target error, as a whole, when that is
/// first looked at: noise is added up over kPixels and three colours, of two times kSamples. The
/// error that ends a view (film/errorEstimate.h) has a sturdier denominator, and its noisiest parts
/// have to be below the target too: they may go on for long with paths that this leaves whole.
double noiseAtTarget(const SplittingView& view) {
    const double target = view.context.options.targetError;
    const double samples = static_cast<double>(view.targetSamples) / (2 * kSamples);
    return 3.0 * kPixels * target * target * samples;
}

/// Noise: squared differences between two estimates of each pixel, relative to its squared mean.
/// Samples of an estimate are stratified: their own spread would count what varies within a pixel,
/// which they average out and splitting does not. Nothing when it was stopped.
std::optional<Trial> tried(const SplittingView& view, const std::vector<PixelSample>& samples,
                           PathWorker& worker, const StopCheck& stop) {
    const PathContext& context = view.context;
    // Whatever the image's: then images of one view are alike, and may be averaged.
    constexpr std::uint64_t kSeed = 0x51B7A2D5;
    const std::vector<Rgb> first = trialMeans(context, samples, kSeed, worker, stop);
    const std::vector<Rgb> second = trialMeans(context, samples, kSeed + 1, worker, stop);
    if (first.empty() || second.empty()) {
        return std::nullopt;
    }
    double noise = 0.0;
    for (std::size_t i = 0; i < kPixels; ++i) {
        for (int c = 0; c < 3; ++c) {
            const double scale = 0.5 * static_cast<double>(view.exposureScale);
            const double mean = scale * static_cast<double>(first[i][c] + second[i][c]);
            const double half = scale * static_cast<double>(first[i][c] - second[i][c]);
            noise += half * half / (mean * mean + kDark);
        }
    }
    const PathCounts counts = worker.counts();
    const double rays = static_cast<double>(counts.rays + counts.shadowRays);
    return Trial{noise, rays + kRaysOfSample * static_cast<double>(2 * samples.size())};
}

} // namespace

int fittedBranches(const SplittingView& view, const WorkerMaker& makeWorker,
                   const StopCheck& stop) {
    const double paths = static_cast<double>(view.width) * view.height * view.leastSamples;
    // Nothing is behind the first vertex but what lights send there, or a trial takes as long.
    if (view.context.options.maxBounces < 2 || paths < kLeastPaths) {
        return 1;
    }
    const std::vector<PixelSample> samples = trialSamples(view.width, view.height);
    const auto trial = [&](int branches) {
        return tried(view, samples, *makeWorker(branches), stop);
    };
    const double enough = noiseAtTarget(view);
    const std::optional<Trial> whole = trial(1);
    if (!whole || whole->noise <= enough) {
        return 1;
    }
    int best = 1;
    double least = whole->cost(enough);
    for (int branches = 2; branches <= kMostBranches; branches *= 2) {
        const std::optional<Trial> split = trial(branches);
        if (!split || split->cost(enough) >= (branches == 2 ? kBiasOfTwo : 1.0) * least) {
            break;
        }
        best = branches;
        least = split->cost(enough);
    }
    return best;
}

} // namespace mbfeat
