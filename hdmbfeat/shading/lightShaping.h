// UsdLux ShapingAPI: factors on the emission of a light by direction. Templates on the lane type.
#pragma once

#include "core/vec.h"
#include "scene/light.h"

namespace mbfeat {

/// Hermite step from 0 at a to 1 at b > a.
template <class T>
T smoothStep(T x, T a, T b) {
    const T t = clamp((x - a) / (b - a), T(0), T(1));
    return t * t * (T(3) - T(2) * t);
}

/// Shaping prepared for evaluation. Angles are measured in world space between the emitted
/// direction and the image of the light's -z axis, also under non-uniform scale.
///
/// With f = |cos|^focus the colour is lerp(f, focusTint, 1). The cone lets everything pass up to
/// (1 - softness) x angle, nothing beyond the angle, and falls smoothly in between. A cone of 90
/// degrees without softness is what lights without the API report, so it does not cut.
template <class T>
struct ShapingFunction {
    using S = Scalar<T>;
    bool hasFocus = false, hasCone = false;
    S focus = S(0);
    Vec3<S> tint{S(0)};
    S cutoff = S(0), smoothStart = S(0); ///< radians

    ShapingFunction() = default;
    explicit ShapingFunction(const LightShaping& shaping) {
        hasFocus = shaping.focus > 0.0F;
        focus = S(shaping.focus);
        tint = Vec3<S>(shaping.focusTint);
        const S softness = S(std::clamp(shaping.coneSoftness, 0.0F, 1.0F));
        const bool untouched = shaping.coneAngle == 90.0F && !(softness > S(0));
        hasCone = !untouched && shaping.coneAngle < 180.0F;
        cutoff = S(max(shaping.coneAngle, 0.0F)) * S(kPi / 180.0F);
        smoothStart = cutoff * (S(1) - softness);
    }

    bool isOn() const { return hasFocus || hasCone; }

    /// The factor for an angle to the axis whose cosine is given.
    Vec3<T> evaluate(T cosAxis) const {
        Vec3<T> factor{T(1)};
        if (hasFocus) {
            const T f = pow(max(abs(cosAxis), T(std::numeric_limits<S>::min())), T(focus));
            factor = {lerp(f, T(tint.x), T(1)), lerp(f, T(tint.y), T(1)), lerp(f, T(tint.z), T(1))};
        }
        if (hasCone) {
            const T angle = acos(clamp(cosAxis, T(-1), T(1)));
            const T soft = smoothStart < cutoff
                               ? T(1) - smoothStep(angle, T(smoothStart), T(cutoff))
                               : select(angle <= T(cutoff), T(1), T(0));
            factor *= soft;
        }
        return factor;
    }
};

} // namespace mbfeat
