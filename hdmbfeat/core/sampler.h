// Random numbers keyed on (pixel, sample, dimension, seed, frame): nothing else, so an image does
// not depend on threads, tiles or the order of work, and dropping a dimension shifts no other.
//
// Padded Owen-scrambled Sobol (0,2)-sequences with the index shuffled per dimension pair (Burley
// 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4)). All arithmetic is on 32-bit integers,
// so that it runs on SIMD lanes; every lane gets what the scalar code gets.
#pragma once

#include <cstdint>

#include "core/laneMemory.h"
#include "core/vec.h"

namespace mbfeat {

/// Bit of a sample's index: a second sequence of points, independent of the one without it.
inline constexpr std::uint32_t kSecondSequence = 1U << 31U;

/// Index of sample `sample` of a pixel whose samples alternate between both sequences, so that the
/// difference of the two halves tells their error: points of one sequence are not independent.
inline std::uint32_t alternatingIndex(std::uint32_t sample) {
    return (sample >> 1U) | ((sample & 1U) != 0 ? kSecondSequence : 0U);
}

/// 0 or 1: the sequence that the sample belongs to.
inline int sequenceOf(std::uint32_t index) {
    return static_cast<int>(index >> 31U);
}

/// What the numbers of one pixel sample are keyed on, hashed to 64 bits in two words.
struct SamplerKey {
    std::uint32_t low = 0, high = 0;
    std::uint32_t index = 0; ///< sample index, bits reversed

    /// `pixel` is the display-window pixel, which may be negative with overscan.
    static SamplerKey make(int pixelX, int pixelY, std::uint32_t sampleIndex, std::uint64_t seed,
                           std::int64_t frame);
};

namespace sampling {

template <class U>
U reverseBits(U x) {
    x = (x >> 24) | ((x >> 8) & U(0x0000FF00U)) | ((x & U(0x0000FF00U)) << 8) | (x << 24);
    x = ((x & U(0x0F0F0F0FU)) << 4) | ((x >> 4) & U(0x0F0F0F0FU));
    x = ((x & U(0x33333333U)) << 2) | ((x >> 2) & U(0x33333333U));
    return ((x & U(0x55555555U)) << 1) | ((x >> 1) & U(0x55555555U));
}

/// A bijection of 32 bits with nearly full avalanche (C. Wellons' "hash-prospector", its
/// "lowbias32" multipliers).
template <class U>
U mix32(U x) {
    x ^= x >> 16;
    x *= U(0x7FEB352DU);
    x ^= x >> 15;
    x *= U(0x846CA68BU);
    return x ^ (x >> 16);
}

/// Owen scrambling of a number whose digits are stored least significant bit first: every bit is
/// flipped by a random function of the bits below it. A hash of Laine and Karras' kind (Laine and
/// Karras 2011, section 3; Burley 2020, section 3.2): additions of seeds, multiplications by odd
/// numbers and x ^= x * even only carry upwards. The constants were searched for the least bias of
/// "bit j flips when bit i < j does": 0.0008 root mean square over 400000 seeds, where a perfect
/// scrambling measures 0.0008 too.
template <class U>
U owenScrambleReversed(U x, const U& low, const U& high) {
    x ^= x * U(0x68BAA746U);
    x += low;
    x *= high | U(1U);
    x ^= x * U(0x9540BE54U);
    x += high;
    return x ^ (x * U(0x8E4240ECU));
}

/// Digits of the second Sobol dimension, least significant bit first. Its generator matrix is
/// Pascal's triangle modulo 2, the fifth Kronecker power of ((1, 1), (0, 1)), so the product with
/// the index falls into five steps.
template <class U>
U sobolSecondReversed(U index) {
    index ^= (index >> 1) & U(0x55555555U);
    index ^= (index >> 2) & U(0x33333333U);
    index ^= (index >> 4) & U(0x0F0F0F0FU);
    index ^= (index >> 8) & U(0x00FF00FFU);
    return index ^ ((index >> 16) & U(0x0000FFFFU));
}

} // namespace sampling

/// Points of pixel samples, one a lane. Stateless: every call gives the same number for the same
/// dimension. Values are in [0, 1).
template <class T>
class LaneSampler {
public:
    using U = UintLane<T>;

    LaneSampler(const U& low, const U& high, const U& index)
        : low_(low),
          high_(high),
          index_(index) {}

    T get1D(std::uint32_t dimension) const {
        const Seed seed = seedOf(2U * dimension);
        // The shuffle is an Owen scrambling of the index (Burley 2020, section 3.3): aligned blocks
        // of 2^k indices stay together, so every such block is still a net.
        const U n =
            sampling::reverseBits(sampling::owenScrambleReversed(index_, seed.low, seed.high));
        return scrambled(n, next(seed, 0x9E3779B9U));
    }

    /// A well-distributed pair; uses up `dimension` and `dimension + 1`.
    Vec2<T> get2D(std::uint32_t dimension) const {
        const Seed seed = seedOf(2U * dimension + 1U);
        const U n =
            sampling::reverseBits(sampling::owenScrambleReversed(index_, seed.low, seed.high));
        return {scrambled(n, next(seed, 0x9E3779B9U)),
                scrambled(sampling::sobolSecondReversed(n), next(seed, 0x3C6EF372U))};
    }

private:
    struct Seed {
        U low, high;
    };

    Seed seedOf(std::uint32_t dimension) const {
        const U low = sampling::mix32(U(low_ + U((dimension + 1U) * 0x9E3779B9U)));
        return {low, sampling::mix32(U(high_ ^ low))};
    }
    static Seed next(const Seed& seed, std::uint32_t step) {
        const U low = sampling::mix32(U(seed.low + U(step)));
        return {low, sampling::mix32(U(seed.high ^ low))};
    }
    static T scrambled(const U& n, const Seed& seed) {
        const U x = sampling::reverseBits(sampling::owenScrambleReversed(n, seed.low, seed.high));
        // Exact: the upper 24 bits.
        return toFloat(toSigned(U(x >> 8))) * T(0x1p-24F);
    }

    U low_, high_, index_;
};

/// The points of one pixel sample.
class Sampler : public LaneSampler<float> {
public:
    explicit Sampler(const SamplerKey& key) : LaneSampler<float>(key.low, key.high, key.index) {}
    Sampler(int pixelX, int pixelY, std::uint32_t sampleIndex, std::uint64_t seed,
            std::int64_t frame)
        : Sampler(SamplerKey::make(pixelX, pixelY, sampleIndex, seed, frame)) {}
};

} // namespace mbfeat
