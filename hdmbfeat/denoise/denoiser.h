// Reconstructs an image from the paths of its pixels, with a trained network and kernel splatting.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "denoise/channels.h"
#include "denoise/model.h"
#include "denoise/pathSums.h"

namespace mbfeat {

struct DenoiseOptions {
    int threads = 0;     ///< 0: one a core
    int tile = 0;        ///< side in pixels; 0: from `memory`
    double memory = 3.0; ///< GiB that the network's run may take
    ShownFeatures shown = ShownFeatures::kAll;
    /// First fields of the colours to reconstruct, all with the same kernels, so that colours which
    /// add up before still do: "R", "mbfeat:contribution:0.R", ...
    std::vector<std::string> lights = {"R"};
    const std::atomic<bool>* stop = nullptr;
};

struct DenoiseResult {
    std::vector<float> image; ///< [lights][3][height][width], linear
    bool stopped = false;     ///< asked to; the image is not whole
    int tiles = 0, tileSize = 0;
    std::uint64_t repaired = 0; ///< paths that were left out because they are not finite
    std::uint64_t empty = 0;    ///< pixels without any usable path: black
    double gatherSeconds = 0.0; ///< paths to network channels, and their sums by class
    double inferenceSeconds = 0.0;
    double splatSeconds = 0.0;
};

/// Reconstructs from kept paths, with any model. Errors name the model or what the paths lack. Any
/// thread; one call uses `threads` threads of its own.
Result<DenoiseResult> denoise(const std::shared_ptr<const DenoiseModel>& model,
                              const PathSamples& paths, const DenoiseOptions& options);

/// Reconstructs from a layered model's sums; of the options `shown` and `lights` are the sums' own.
Result<DenoiseResult> denoise(const PathSums& sums, const DenoiseOptions& options);

/// Sums for paths of these fields, empty; an error where the model is not layered or the paths lack
/// something.
Result<std::unique_ptr<PathSums>> makePathSums(const std::shared_ptr<const DenoiseModel>& model,
                                               const PathSamples& paths,
                                               const DenoiseOptions& options);

} // namespace mbfeat
