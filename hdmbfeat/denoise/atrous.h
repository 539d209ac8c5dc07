// Edge-stopping passes after the splat, wider from pass to pass (the à-trous wavelet transform).
//
// Each pass makes a pixel the weighted mean of 5 x 5 pixels that lie a dilation apart. Their logits
// are spatial - sharpness |f(x) - f(y)|^2, with features f of the unit, of which guides are scaled
// as the pixel says; the pixel's own logit is given for each pixel. So light spreads over what is
// alike and stops at edges. After Dammertz, Sewtz, Hanika and Lensch 2010, "Edge-avoiding À-Trous
// wavelet transform for fast global illumination filtering", with the learned features of Isik et
// al. 2021, "Interactive Monte Carlo denoising using affinity of neural features".
#pragma once

#include <atomic>

#include "denoise/splat.h"

namespace mbfeat {

class ThreadPool;

namespace atrous {
inline constexpr int kSide = 5, kRadius = kSide / 2, kTaps = kSide * kSide, kMiddle = kTaps / 2;
} // namespace atrous

/// One pass of one unit. Planes [height][width] are of the caller, float32.
struct ATrousPass {
    int width = 0, height = 0;
    int lights = 0, alikeChannels = 0;
    int dilation = 1;
    const float* light = nullptr;   ///< [lights] planes, what is filtered
    const float* alike = nullptr;   ///< [alikeChannels] planes
    int guides = 0;                 ///< the last of these, see SplatInput
    const float* scales = nullptr;  ///< planes by group, that a pixel has for what it reads
    const float* centre = nullptr;  ///< a plane: logits of the pixels themselves
    const float* spatial = nullptr; ///< [kTaps] logits; that of the middle is added to the centre's
    float sharpness = 1.0F;
    float* out = nullptr; ///< [lights] planes, not those of `light`
};

/// Writes the area's pixels of `out`; those of `light` that it reads lie up to twice the dilation
/// around. What is outside the image counts nothing. A pixel does not depend on threads or areas;
/// lanes agree to rounding. False when `stop` (may be null) ended it.
bool filter(const ATrousPass& pass, const SplatTile& area, ThreadPool& pool,
            const std::atomic<bool>* stop, SplatLanes lanes);

} // namespace mbfeat
