// Hits of several paths side by side: what the scene holds of each, transposed to lanes.
#pragma once

#include <cstdint>

#include "core/laneMemory.h"
#include "integrate/accel.h"
#include "integrate/surfacePoint.h"
#include "shading/lightSampler.h"
#include "shading/material.h"

namespace mbfeat {

/// Plain structures of floats become structures of lanes, value by value: X<float> and X<T> must
/// hold the same number of values and nothing else.
template <class T, template <class> class X>
class Transposer {
public:
    static constexpr std::size_t kValues = sizeof(X<float>) / sizeof(float);
    static_assert(sizeof(X<T>) == kValues * sizeof(T), "only lanes inside");

    void set(int lane, const X<float>& value) {
        const auto* from = reinterpret_cast<const float*>(&value);
        for (std::size_t i = 0; i < kValues; ++i) {
            values_[i][lane] = from[i];
        }
    }
    X<T> lanes() const {
        X<T> result;
        auto* to = reinterpret_cast<T*>(&result);
        for (std::size_t i = 0; i < kValues; ++i) {
            to[i] = values_[i].lanes();
        }
        return result;
    }

private:
    LaneBuffer<T> values_[kValues];
};

/// a where m holds, else b, value by value.
template <class T, template <class> class X>
X<T> blend(const Mask<T>& m, const X<T>& a, const X<T>& b) {
    static_assert(sizeof(X<T>) == sizeof(X<float>) / sizeof(float) * sizeof(T),
                  "only lanes inside");
    X<T> result;
    const auto* fromA = reinterpret_cast<const T*>(&a);
    const auto* fromB = reinterpret_cast<const T*>(&b);
    auto* to = reinterpret_cast<T*>(&result);
    for (std::size_t i = 0; i < sizeof(X<float>) / sizeof(float); ++i) {
        to[i] = select(m, fromA[i], fromB[i]);
    }
    return result;
}

/// SurfaceParameters without its mask, which is no float.
template <class T>
struct MaterialValues {
    Vec3<T> diffuseColor, emission, specularColor, tangentNormal;
    T specularWorkflow, metallic, roughness, clearcoat, clearcoatRoughness, opacity, ior;
};

inline MaterialValues<float> materialValues(const SurfaceParameters<float>& p) {
    return {p.diffuseColor,
            p.emission,
            p.specularColor,
            p.tangentNormal,
            p.useSpecularWorkflow ? 1.0F : 0.0F,
            p.metallic,
            p.roughness,
            p.clearcoat,
            p.clearcoatRoughness,
            p.opacity,
            p.ior};
}

template <class T>
SurfaceParameters<T> surfaceParameters(const MaterialValues<T>& v) {
    SurfaceParameters<T> p;
    p.diffuseColor = v.diffuseColor;
    p.emission = v.emission;
    p.specularColor = v.specularColor;
    p.tangentNormal = v.tangentNormal;
    p.useSpecularWorkflow = v.specularWorkflow > T(0.5F);
    p.metallic = v.metallic;
    p.roughness = v.roughness;
    p.clearcoat = v.clearcoat;
    p.clearcoatRoughness = v.clearcoatRoughness;
    p.opacity = v.opacity;
    p.ior = v.ior;
    return p;
}

/// The same constants in every lane.
template <class T>
SurfaceParameters<T> surfaceParameters(const SurfaceParameters<float>& constants) {
    const MaterialValues<float> values = materialValues(constants);
    MaterialValues<T> lanes;
    const auto* from = reinterpret_cast<const float*>(&values);
    auto* to = reinterpret_cast<T*>(&lanes);
    for (std::size_t i = 0; i < sizeof(values) / sizeof(float); ++i) {
        to[i] = T(from[i]);
    }
    return surfaceParameters<T>(lanes);
}

/// LightSample as far as shading needs it.
template <class T>
struct LightValues {
    Vec3<T> wi;
    T distance;
    Vec3<T> radiance;
    T pdf, delta, castsShadows, diffuse, specular;
    Vec3<T> point, pointError, normal;
};

inline LightValues<float> lightValues(const LightSample& s, const Rgb& radiance) {
    return {s.wi,
            s.distance,
            radiance,
            s.pdf,
            s.delta ? 1.0F : 0.0F,
            s.castsShadows ? 1.0F : 0.0F,
            s.diffuse,
            s.specular,
            s.point,
            s.pointError,
            s.normal};
}

} // namespace mbfeat
