// What the values that authors give become: channels, ranges, unit normals. Templates on the lane
// type, so that one hit alone and many at a time get the same bits.
#pragma once

#include <array>
#include <cstddef>

#include "core/lane.h"
#include "core/vec.h"
#include "shading/material.h"

namespace mbfeat {

/// What values are brought to: NaN is the fallback, the specification's default.
namespace material {
struct Range {
    float least, most, fallback;
};
/// Radiance beyond this is treated as a mistake that must not overflow float sums.
inline constexpr float kMostEmission = 1e12F;
inline constexpr Range kDiffuse{0.0F, 1.0F, 0.18F};
inline constexpr Range kEmission{0.0F, kMostEmission, 0.0F};
inline constexpr Range kSpecular{0.0F, 1.0F, 0.0F};
inline constexpr Range kMetallic{0.0F, 1.0F, 0.0F};
inline constexpr Range kRoughness{0.0F, 1.0F, 0.5F};
inline constexpr Range kClearcoat{0.0F, 1.0F, 0.0F};
inline constexpr Range kClearcoatRoughness{0.0F, 1.0F, 0.01F};
inline constexpr Range kOpacity{0.0F, 1.0F, 1.0F};
inline constexpr Range kThreshold{0.0F, 1.0F, 0.0F};
inline constexpr Range kIor{0.01F, 100.0F, 1.5F};
/// Tangent-space normals outside of these lengths have no direction: (0, 0, 1) stands for them.
inline constexpr float kShortestNormal = 1e-6F;
inline constexpr float kLongestNormal = 1e18F; ///< a component; its square would overflow

/// As std::min and std::max take zeros, which have a sign.
template <class T>
T inRange(const T& value, const Range& range) {
    const T least(range.least), most(range.most);
    const T risen = select(value < least, least, value);
    const T bounded = select(most < risen, most, risen);
    return select(value == value, bounded, T(range.fallback));
}

template <class T>
Vec3<T> inRange(const Vec3<T>& value, const Range& range) {
    return {inRange(value.x, range), inRange(value.y, range), inRange(value.z, range)};
}

/// A tangent-space normal of unit length; (0, 0, 1) where there is no direction in the value.
template <class T>
Vec3<T> unitNormal(const Vec3<T>& value) {
    // Zero times anything finite is zero.
    const T zeros = value.x * T(0) + value.y * T(0) + value.z * T(0);
    const Mask<T> usable = zeros == T(0) && !(maxComponent(abs(value)) > T(kLongestNormal));
    const T norm = length(value);
    const Mask<T> directed = usable && norm > T(kShortestNormal);
    return select<T>(directed, value / select(directed, norm, T(1)), Vec3<T>(T(0), T(0), T(1)));
}

/// Three channels of a texture's value from `first` on; beyond the last one it is repeated.
template <class T>
Vec3<T> channels(const Vec4<T>& value, int first) {
    const std::array<T, 4> all = {value.x, value.y, value.z, value.w};
    const auto at = [&](int channel) { return all[static_cast<std::size_t>(min(channel, 3))]; };
    return {at(first), at(first + 1), at(first + 2)};
}

/// Writes one input into the parameters, in range. Opacity inputs are kept by evaluateOpacity().
/// Float traps are to be masked: the value is anything.
template <class T>
void store(MaterialSlot slot, const Vec3<T>& value, SurfaceParameters<T>& p) {
    switch (slot) {
    case MaterialSlot::kDiffuseColor:
        p.diffuseColor = inRange(value, kDiffuse);
        break;
    case MaterialSlot::kEmissiveColor:
        p.emission = inRange(value, kEmission);
        break;
    case MaterialSlot::kSpecularColor:
        p.specularColor = inRange(value, kSpecular);
        break;
    case MaterialSlot::kMetallic:
        p.metallic = inRange(value.x, kMetallic);
        break;
    case MaterialSlot::kRoughness:
        p.roughness = inRange(value.x, kRoughness);
        break;
    case MaterialSlot::kClearcoat:
        p.clearcoat = inRange(value.x, kClearcoat);
        break;
    case MaterialSlot::kClearcoatRoughness:
        p.clearcoatRoughness = inRange(value.x, kClearcoatRoughness);
        break;
    case MaterialSlot::kOpacity:
        p.opacity = inRange(value.x, kOpacity);
        break;
    case MaterialSlot::kOpacityThreshold:
        break;
    case MaterialSlot::kIor:
        p.ior = inRange(value.x, kIor);
        break;
    case MaterialSlot::kNormal:
        p.tangentNormal = unitNormal(value);
        break;
    }
}

} // namespace material

} // namespace mbfeat
