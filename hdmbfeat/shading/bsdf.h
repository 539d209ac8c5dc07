// The scattering of UsdPreviewSurface as a closure over a lane type: evaluate, sample and pdf of
// the same mixture of lobes.
//
// Directions are unit vectors in the shading frame (core/frame.h): +z is the shading normal on the
// side that wo is on, so wo.z > 0. wi.z > 0 reflects, wi.z < 0 transmits.
#pragma once

#include <cstdint>

#include "core/vec.h"

namespace mbfeat {

/// Lobes rougher than this spread light widely.
inline constexpr float kWideRoughness = 0.3F;

/// The inputs of UsdPreviewSurface after all look-ups, in range (evaluateMaterial clamps them).
template <class T>
struct SurfaceParameters {
    Vec3<T> diffuseColor{T(0.18F)};
    Vec3<T> emission{T(0)};
    Vec3<T> specularColor{T(0)}; ///< F0 of the specular workflow
    Mask<T> useSpecularWorkflow = Mask<T>(false);
    T metallic{T(0)};
    T roughness{T(0.5F)};
    T clearcoat{T(0)};
    T clearcoatRoughness{T(0.01F)};
    T opacity{T(1)}; ///< 1 - opacity is the weight of refraction (transparent mode)
    T ior{T(1.5F)};
    Vec3<T> tangentNormal{T(0), T(0), T(1)}; ///< normal map value, tangent space
};

/// f * |cos(theta_i)| and the density of sampling wi, per solid angle. Delta lobes are not part.
/// The diffuse part is kept apart for lights whose diffuse and specular multipliers differ.
template <class T>
struct BsdfValue {
    Vec3<T> diffuse{T(0)};
    Vec3<T> specular{T(0)}; ///< every glossy lobe, reflected and transmitted
    T pdf{T(0)};
    Vec3<T> total() const { return diffuse + specular; }
};

template <class T>
struct BsdfSample {
    Vec3<T> wi{T(0), T(0), T(1)};
    Vec3<T> weight{T(0)}; ///< f |cos| / pdf of the whole mixture; of the lobe alone if delta
    T pdf{T(0)};          ///< solid angle density; 0: absorbed. Of a delta lobe: its probability
    Mask<T> delta = Mask<T>(false);
    Mask<T> transmitted = Mask<T>(false);
    Mask<T> diffuse = Mask<T>(false);
    T roughness{T(0)}; ///< of the lobe sampled; 1 for diffuse
    T eta{T(1)};       ///< relative index crossed, for Russian roulette; 1 when reflected
    /// Colour of the delta lobe without Fresnel and choice (tint), for the first-non-delta
    /// features.
    Vec3<T> tint{T(1)};
};

/// Parts of the closure that a kernel may leave out where no surface has them. Without any of them
/// nothing reflects either: see shading/diffuseSurface.h.
enum BsdfPart : std::uint32_t {
    kBsdfReflection = 1U << 0U,       ///< an interface that reflects: ior is not 1, or metal
    kBsdfTransmission = 1U << 1U,     ///< opacity below 1
    kBsdfClearcoat = 1U << 2U,        ///< clearcoat above 0
    kBsdfSpecularWorkflow = 1U << 3U, ///< useSpecularWorkflow
};
inline constexpr std::uint32_t kAllBsdfParts = 15U;

// The closure itself, class Bsdf<T>, is in shading/previewSurface.h.

} // namespace mbfeat
