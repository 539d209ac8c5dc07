// The GGX distribution of microfacet normals, isotropic, with Smith shadowing.
//
// Directions are in the shading frame. Squared tangents are taken from x and y, never from
// 1 - z^2, so that a lobe of width alpha stays accurate down to kDeltaAlpha.
#pragma once

#include "core/vec.h"

namespace mbfeat {

/// Lobes narrower than this are treated as deltas. A half vector from float directions is off by
/// about 2e-7, which changes the density of a lobe of width alpha by 4 * 2e-7 / alpha: 0.4 % here
/// and growing below. Peak density at this width is 8e6 / sr, far from overflow. In roughness it
/// is 0.0141: the default clearcoatRoughness (0.01) is a delta.
inline constexpr float kDeltaAlpha = 2e-4F;

/// x^2 + y^2 of a direction, which is sin^2(theta).
template <class T>
T sinSquared(const Vec3<T>& w) {
    return fma(w.x, w.x, w.y * w.y);
}

/// GGX with width alpha (Walter et al. 2007, equation 33; Heitz 2014 for the Smith terms).
template <class T>
class Ggx {
public:
    explicit Ggx(const T& alpha) : alpha_(max(alpha, T(kDeltaAlpha))), alphaSquared_(sqr(alpha_)) {}

    /// Density D(h) of normals h (unit, h.z >= 0), per solid angle and projected area.
    T density(const Vec3<T>& h) const {
        const T d = fma(alphaSquared_, h.z * h.z, sinSquared(h));
        return alphaSquared_ / max(T(kPi) * d * d, T(1e-30F));
    }

    /// sqrt(z^2 + alpha^2 sin^2) of a direction: Smith's Lambda is (projected / |z| - 1) / 2.
    T projected(const Vec3<T>& w) const {
        return sqrt(fma(alphaSquared_, sinSquared(w), w.z * w.z));
    }

    /// G2 / (4 |wo.z| |wi.z|) with height-correlated masking, G2 = 1 / (1 + Lambda_o + Lambda_i).
    T visibility(const Vec3<T>& wo, const Vec3<T>& wi) const {
        const T sum = fma(abs(wi.z), projected(wo), abs(wo.z) * projected(wi));
        return T(0.5F) / max(sum, T(1e-30F));
    }

    /// Density of the normals visible from wo without its factor max(0, wo.h):
    /// G1(wo) D(h) / wo.z. Finite for wo.z = 0.
    T visibleDensity(const Vec3<T>& wo, const Vec3<T>& h) const {
        return T(2) / (wo.z + projected(wo)) * density(h);
    }

    /// A normal visible from wo, by spherical caps (Dupuy & Benyoub 2023, "Sampling Visible GGX
    /// Normals with Spherical Caps", listing 3), rearranged so that u near 0 or 1 does not cancel.
    Vec3<T> sampleVisible(const Vec3<T>& wo, const Vec2<T>& u) const {
        const Vec3<T> stretched =
            normalize(Vec3<T>(alpha_ * wo.x, alpha_ * wo.y, max(wo.z, T(1e-20F))));
        const T span = T(1) + stretched.z;
        const T drop = u.y * span; // 1 - z of the point on the cap
        const T sine = safeSqrt(drop * (T(2) - drop));
        T s, c;
        sinCosTurns(u.x, s, c);
        const Vec3<T> h(fma(sine, c, stretched.x), fma(sine, s, stretched.y), (T(1) - u.y) * span);
        return normalize(Vec3<T>(alpha_ * h.x, alpha_ * h.y, max(h.z, T(1e-12F))));
    }

private:
    T alpha_, alphaSquared_;
};

} // namespace mbfeat
