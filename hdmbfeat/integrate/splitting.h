// Into how many paths one is split where it first scatters widely, for a view.
//
// Splitting shares the way there among several continuations. It pays where most of the noise comes
// from behind that vertex and most of the rays are spent before it, which is a matter of the scene:
// so both are measured, on a few pixels, unsplit and split, and what has less noise for its rays is
// taken, to a margin (the efficiency of Monte Carlo estimators; Arvo and Kirk 1990, "Particle
// transport and image synthesis", section 5). What is measured depends on the view alone,
// neither on threads nor kernels, frame nor seed, and has random numbers of its own: so the image
// stays unbiased.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "integrate/pathWorker.h"

namespace mbfeat {

/// A worker for batches of paths that become so many; any capacity.
using WorkerMaker = std::function<std::unique_ptr<PathWorker>(int branches)>;

struct SplittingView {
    const PathContext& context;
    int width = 0, height = 0; ///< of the display window, so that a part is what it is in the whole
    int leastSamples = 0;      ///< that each pixel gets, however soon the view ends
    int targetSamples = 0;     ///< that each has when a target error is first looked at
    float exposureScale = 1.0F;
};

/// 1, 2 or 4. One thread; 8,192 paths for each number that is tried, and 1 without a trial for
/// images that may end after fewer than 24,576 samples. With a target error, less noise than the
/// image as a whole may have after `targetSamples` counts for nothing. `stop` (may be empty) is
/// polled; true ends it early.
int fittedBranches(const SplittingView& view, const WorkerMaker& makeWorker, const StopCheck& stop);

} // namespace mbfeat
