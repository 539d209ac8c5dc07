// Kernel splatting, the network's last layer included: every unit (a sample, or a class of samples)
// spreads its light over the pixels around it.
//
// A unit's logits at a pixel are weight x hidden + bias, k x k of them. Tap (j, i) belongs to the
// pixel r - j rows and r - i columns further, r = k / 2. A pixel is the mean of all that reaches
// it, weighted by the softmax of the logits over units and taps (Gharbi et al. 2019, "Sample-based
// Monte Carlo Denoising using a Kernel-Splatting Network", equation 3). The logits of a whole image
// never exist: they are made where they are used. With `alike`, the squared distance of a unit's
// features at a pixel from its own where a tap goes is taken off the logit (after Isik et al. 2021,
// "Interactive Monte Carlo denoising using affinity of neural features"). Each pixel carries the
// largest logit so far and its sums are scaled down when a later one exceeds it, so that no logit
// can overflow.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace mbfeat {

class ThreadPool;

/// Features that need no learning: albedo, normal, depth and, where there are eight, roughness,
/// each of which has a scale.
namespace guides {
inline constexpr int kWithoutRoughness = 7, kCount = 8;
/// Whether there may be so many; none is for the caller to tell.
inline constexpr bool isCount(int count) {
    return count == kWithoutRoughness || count == kCount;
}
/// The group of the i-th of them.
inline constexpr int group(int i) {
    return i < 6 ? i / 3 : i - 4;
}
/// How many groups so many of them have.
inline constexpr int groups(int count) {
    return count == 0 ? 0 : group(count - 1) + 1;
}
/// How many of them have so many groups; 0 where none do.
inline constexpr int ofGroups(int count) {
    return count == groups(kCount)              ? kCount
           : count == groups(kWithoutRoughness) ? kWithoutRoughness
                                                : 0;
}
} // namespace guides

/// Arrays are of the caller, row-major, float32.
struct SplatInput {
    int units = 0, channels = 0, lights = 0; ///< hidden channels; values that are spread
    int width = 0, height = 0;
    int kernel = 1;                ///< k, odd
    const float* hidden = nullptr; ///< [units][channels][height][width]
    const float* light = nullptr;  ///< [units][lights][height][width]
    const float* weight = nullptr; ///< [k k][channels]
    const float* bias = nullptr;   ///< [k k]
    int alikeChannels = 0;
    const float* alike = nullptr; ///< [units][alikeChannels][height][width]
    /// The last of these, none or as guides::isCount() says: their differences are multiplied by
    /// `scales` [units][guides::groups()][height][width] of the pixel to which a tap goes.
    int guides = 0;
    const float* scales = nullptr;
    /// Demodulation, of units apart: the second half of the lights is the first divided by the
    /// unit's albedo. What arrives of it is multiplied by `divisor` [units][3][height][width], the
    /// albedo at the pixel, 0 where the unit has none, and counts as much as `gate`
    /// [units][height][width] says, the first half for the rest. Null: all lights are as they are.
    const float* gate = nullptr;
    const float* divisor = nullptr;
    const float* presence =
        nullptr;        ///< [units][height][width], 0 where there is no unit; may be null
    bool apart = false; ///< a softmax for each unit, and the images added
    /// With `apart`: the images are left as they are, for joinUnits().
    bool separate = false;
};

/// Part of an image, in pixels.
struct SplatTile {
    int x0, y0, x1, y1;
};

enum class SplatLanes : std::uint8_t { kScalar, kNarrow, kWide };

/// The widest lanes that this processor and build have.
SplatLanes widestSplatLanes();

/// Writes the area's pixels of `out` [lights][height][width], with a gate half as many lights, or
/// where units are separate [units][lights][height][width]; 0 where nothing arrives. Tiles are
/// shared among the pool's threads: a pixel is computed by one thread, from its inputs in a fixed
/// order, so that the result depends neither on threads nor on tiles. Lanes agree to rounding.
/// False when `stop` (may be null) ended it.
bool splat(const SplatInput& input, const SplatTile& area, float* out, ThreadPool& pool,
           const std::atomic<bool>* stop, SplatLanes lanes);

/// Adds the area's pixels of images that were left separate, as splat() does otherwise: of
/// `separate` [units][lights][height][width] to `out` [lights][height][width], with a gate half as
/// many lights.
void joinUnits(const SplatInput& input, const SplatTile& area, const float* separate, float* out);

/// What a unit gives to a pixel whose gate and divisor there are: of a plain and a divided light.
float modulatedLight(const SplatInput& input, float plain, float divided, int unit, int colour,
                     std::size_t pixel);

} // namespace mbfeat
