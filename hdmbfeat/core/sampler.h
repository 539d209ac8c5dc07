// Random numbers keyed on (pixel, sample, dimension, seed, frame): nothing else, so an image does
// not depend on threads, tiles or the order of work, and dropping a dimension shifts no other.
#pragma once

#include <cstdint>

#include "core/vec.h"

namespace mbfeat {

/// Points of one pixel sample: padded Owen-scrambled Sobol (0,2)-sequences with the index shuffled
/// per dimension pair (Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4)).
/// Stateless: every call gives the same number for the same dimension. Values are in [0, 1).
class Sampler {
public:
    /// `pixel` is the display-window pixel, which may be negative with overscan.
    Sampler(int pixelX, int pixelY, std::uint32_t sampleIndex, std::uint64_t seed,
            std::int64_t frame);

    float get1D(std::uint32_t dimension) const;
    /// A well-distributed pair; uses up `dimension` and `dimension + 1`.
    Float2 get2D(std::uint32_t dimension) const;

private:
    std::uint64_t key_;
    std::uint32_t index_; ///< sample index, bits reversed
};

} // namespace mbfeat
