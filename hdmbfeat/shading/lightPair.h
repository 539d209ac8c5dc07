// The choice between one light in the scene and one at infinity, as most scenes have them: for many
// receivers at a time. The same floats as LightChoice::sample() of each.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/laneMemory.h"
#include "shading/lightImportance.h"

namespace mbfeat {

/// Neither the lights at infinity nor those in the scene are chosen less often than this where both
/// can light. Nothing is known of what stands before either, and of where in the tree's bounds the
/// lights are; so much bounds the noise of a wrong guess.
inline constexpr double kLeastShare = 0.1;

/// The probability of lights at infinity beside those in the scene, by the irradiance that either
/// can give.
inline float infiniteShare(double near, double far) {
    return static_cast<float>(std::clamp(far / (near + far), kLeastShare, 1.0 - kLeastShare));
}

/// A random number of 53 bits out of one of 24 bits, which come first. Where lights are many, 24
/// are too few: one of a million would have 17 numbers to be chosen by. The others are mixed from
/// the number and the receiver (SplitMix64, Steele et al. 2014).
inline double moreBits(float u, const Float3& p) {
    std::uint32_t words[4];
    const float floats[4] = {u, p.x, p.y, p.z};
    std::memcpy(words, floats, sizeof(words));
    std::uint64_t x =
        (static_cast<std::uint64_t>(words[0]) << 32U | words[1]) ^
        (static_cast<std::uint64_t>(words[2]) << 32U | words[3]) * 0x9E3779B97F4A7C15ULL;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
    return static_cast<double>(u) + static_cast<double>(x >> 35U) * 0x1p-53;
}

template <class T>
struct LightPairPick {
    Mask<T> infinite; ///< that at infinity is chosen
    T probability;    ///< 0: neither lights the receiver
};

struct LightPair {
    std::uint32_t localEntry = 0, infiniteEntry = 0;
    ClusterLanes<float> local; ///< as in its node of the tree
    float leastInverse = 0.0F;
    Float3 axis;         ///< towards the light at infinity
    float lowest = 0.0F; ///< cosine to the normal below which nothing of it arrives
    float strength = 0.0F;
    double localScale = 0.0, infiniteScale = 0.0; ///< of weights to irradiances

    template <class T>
    LightPairPick<T> pick(const Vec3<T>& p, const Vec3<T>& n, const Mask<T>& twoSided,
                          const T& u) const {
        const ClusterLanes<T> cluster{
            Vec3<T>(local.center), T(local.radius),     Vec3<T>(local.axis), T(local.cosSpread),
            T(local.sinSpread),    T(local.cosFalloff), T(local.strength)};
        const LaneBuffer<T> near(importanceAt(cluster, p, n, twoSided, T(leastInverse)));
        const T along = fma(n.x, T(axis.x), fma(n.y, T(axis.y), n.z * T(axis.z)));
        const LaneBuffer<T> far(select(along >= T(lowest) || twoSided, T(strength), T(0)));
        const LaneBuffer3<T> place(p);
        const LaneBuffer<T> number(u);
        LaneBuffer<T> infinite, probability;
        for (int i = 0; i < LaneTraits<T>::kWidth; ++i) {
            const bool isNear = isWeight(near[i]), isFar = isWeight(far[i]);
            float share = isFar ? 1.0F : 0.0F;
            if (isNear && isFar) {
                share = infiniteShare(static_cast<double>(near[i]) * localScale,
                                      static_cast<double>(far[i]) * infiniteScale);
            }
            const bool chosen = moreBits(number[i], place.get(i)) < static_cast<double>(share);
            infinite[i] = chosen ? 1.0F : 0.0F;
            probability[i] = chosen ? share : isNear ? 1.0F - share : 0.0F;
        }
        return {infinite.lanes() != T(0), probability.lanes()};
    }

private:
    static bool isWeight(float weight) {
        return weight > 0.0F && weight < std::numeric_limits<float>::infinity();
    }
};

} // namespace mbfeat
