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
/// can give and scattering would not find.
inline float infiniteShare(double near, double far) {
    // Not std::clamp(), which loops over lanes could not be made of.
    const double share = far / (near + far);
    return static_cast<float>(std::min(std::max(share, kLeastShare), 1.0 - kLeastShare));
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
        const T near = importanceAt(cluster, p, n, twoSided, T(leastInverse));
        const T along = fma(n.x, T(axis.x), fma(n.y, T(axis.y), n.z * T(axis.z)));
        const T far = select(along >= T(lowest) || twoSided, T(strength), T(0));
        const Mask<T> isNear = isWeight(near), isFar = isWeight(far);
        const T share = select(isFar, select(isNear, shares(near, far), T(1)), T(0));
        const Mask<T> infinite = isBelow(u, share, p);
        return {infinite, select(infinite, share, select(isNear, T(1) - share, T(0)))};
    }

private:
    template <class T>
    static Mask<T> isWeight(const T& weight) {
        return weight > T(0) && weight < T(std::numeric_limits<float>::infinity());
    }

    /// infiniteShare() of each lane. In double, as that is: compilers make SIMD of this.
    template <class T>
    T shares(const T& near, const T& far) const {
        const LaneBuffer<T> nears(near), fars(far);
        LaneBuffer<T> result;
        for (int i = 0; i < LaneTraits<T>::kWidth; ++i) {
            result[i] = infiniteShare(static_cast<double>(nears[i]) * localScale,
                                      static_cast<double>(fars[i]) * infiniteScale);
        }
        return result.lanes();
    }

    /// Whether moreBits(u, p) is below the share. What they add is below the last bit of u, so that
    /// they are hardly ever asked for.
    template <class T>
    static Mask<T> isBelow(const T& u, const T& share, const Vec3<T>& p) {
        const Mask<T> below = u + T(0x1p-24F) <= share;
        const std::uint32_t open = laneBits(!below && u < share);
        if (open == 0) {
            return below;
        }
        const LaneBuffer<T> number(u), limit(share);
        const LaneBuffer3<T> place(p);
        std::uint32_t bits = laneBits(below);
        for (int i = 0; i < LaneTraits<T>::kWidth; ++i) {
            const bool isOpen = ((open >> static_cast<unsigned>(i)) & 1U) != 0;
            if (isOpen && moreBits(number[i], place.get(i)) < static_cast<double>(limit[i])) {
                bits |= std::uint32_t{1} << i;
            }
        }
        return maskOfBits<T>(bits);
    }
};

} // namespace mbfeat
