// Where the rendered image is the better one: how much of it to take over a reconstruction.
//
// A reconstruction is biased, and does not get better for ever with more samples; the rendered
// image does. Of an unbiased estimate y with known variance and a biased one z, the mix z + k (y -
// z) with k = max(0, 1 - sum variance / sum (y - z)^2), sums over a neighbourhood, has a smaller
// error than y whatever z is (James and Stein 1961; for renderings Gu, Iglesias-Guitian and Moon
// 2022, "Neural James-Stein Combiner for Unbiased and Biased Renderings"): where the two differ by
// no more than noise explains z is kept, and where they differ by bias y is taken.
#pragma once

#include <vector>

namespace mbfeat {

/// Planes [3][height][width] of the caller: the rendered colour, the variance of its pixels' means,
/// and the reconstruction.
struct CombineInput {
    int width = 0, height = 0;
    const float* rendered = nullptr;
    const float* variance = nullptr;
    const float* reconstructed = nullptr;
};

/// k of every pixel, 0..1, [height][width]. Errors count relative to the reconstruction's
/// brightness, so that no bright pixel speaks for its neighbours.
std::vector<float> combineWeights(const CombineInput& input);

} // namespace mbfeat
