// Russian roulette by what a path may still bring, beside what its pixel shows.
//
// What a path brings is its throughput times what arrives at its end. Of that the throughput up to
// and with the first scattering that spreads light widely is a factor of all that the pixel shows
// along it, too, so that it says nothing about whether to go on: the throughput since then counts.
#pragma once

#include "core/lane.h"
#include "core/vec.h"

namespace mbfeat {

/// What the throughput `carried` is to be multiplied by from here on: `scale` as it was, times the
/// square of the relative index that the path just crossed (radiance is scaled by its inverse), or
/// where the path has scattered widely for the `first` time what makes the throughput 1. A path
/// that is darker than a tenth by then is not kept any longer for it; `share` is what of the
/// throughput is a branch's since it is one of several, else 1.
template <class T>
T rouletteScale(const Mask<T>& first, const Vec3<T>& carried, const T& share, const T& scale) {
    constexpr float kDarkest = 0.1F;
    return select(first, T(1) / max(maxComponent(carried), T(kDarkest) * share), scale);
}

/// The probability to go on; 0 of a path that carries nothing.
template <class T>
T survivalProbability(const Vec3<T>& carried, const T& scale) {
    constexpr float kMostLikely = 0.95F;
    constexpr float kReluctance = 1.5F; // measured, see benchmarks.md
    return min(maxComponent(carried) * scale * T(kReluctance), T(kMostLikely));
}

} // namespace mbfeat
