// Fresnel reflectance, written so that neither an index near 1 nor grazing light cancels.
//
// Directions enter as c = cos(theta) >= 0 on the side of the incident direction. An interface is
// described by the relative index eta = n(other side) / n(this side) and by k = eta^2 - 1, which
// the caller computes as (eta - 1)(eta + 1) before rounding can destroy it.
#pragma once

#include "core/vec.h"

namespace mbfeat {

/// Relative index across an interface, with the forms of it that formulas need.
template <class T>
struct RelativeIndex {
    T eta{T(1)}; ///< n(other side) / n(this side)
    T etaSquared{T(1)};
    T k{T(0)}; ///< etaSquared - 1, to relative precision

    /// `entering`: this side is the outside, so that the other side has index `ior`.
    static RelativeIndex make(const T& ior, const Mask<T>& entering) {
        const T inverse = T(1) / ior;
        const T k = (ior - T(1)) * (ior + T(1));
        RelativeIndex r;
        r.eta = select(entering, ior, inverse);
        r.etaSquared = r.eta * r.eta;
        r.k = select(entering, k, -k * inverse * inverse);
        return r;
    }

    /// (eta cos(theta_t))^2 by Snell's law; not positive: total internal reflection.
    T refractedSquared(const T& c) const { return fma(c, c, k); }
};

/// Unpolarised reflectance of a dielectric interface, 0..1; 1 under total internal reflection.
///
/// With g = eta cos(theta_t), the textbook amplitudes (c - g) / (c + g) and
/// (eta^2 c - g) / (eta^2 c + g) are expanded by their conjugates (Born & Wolf, Principles of
/// Optics, section 1.5, rewritten): the differences become multiples of k, exact zero at eta = 1.
template <class T>
T fresnelDielectric(const RelativeIndex<T>& index, const T& c) {
    const T tiny(1e-30F);
    const T gSquared = index.refractedSquared(c);
    const Mask<T> refracts = gSquared > T(0);
    // Where nothing is refracted the quotients would overflow towards the horizon.
    const T cosine = select(refracts, c, T(1));
    const T g = safeSqrt(gSquared);
    const T sumS = cosine + g;
    const T sumP = fma(index.etaSquared, cosine, g);
    const T s = index.k / max(sumS * sumS, tiny);
    const T p =
        index.k * fma(index.etaSquared + T(1), cosine * cosine, T(-1)) / max(sumP * sumP, tiny);
    const T reflectance = T(0.5F) * fma(s, s, p * p);
    return select(refracts, min(reflectance, T(1)), T(1));
}

/// Schlick's approximation (1994) from f0 at normal incidence to white at grazing; `c` is the
/// cosine on the optically thinner side.
template <class T>
Vec3<T> fresnelSchlick(const Vec3<T>& f0, const T& c) {
    const T m = clamp(T(1) - c, T(0), T(1));
    const T m2 = m * m;
    const T m5 = m2 * m2 * m;
    return f0 + (Vec3<T>(T(1)) - f0) * m5;
}

/// Mean of fresnelDielectric over the cosine-weighted hemisphere outside a body of index n >= 1:
/// the share of diffuse light that its surface reflects. A rational fit in (n - 1) / (n + 1),
/// scaled to be nowhere above the integral (at most 2 % below it), and exactly 0 at n = 1.
template <class T>
T fresnelDielectricAverage(const T& n) {
    const T x = (n - T(1)) / (n + T(1));
    const T numerator =
        x * fma(x, fma(x, fma(x, T(37.19946F), T(-14.139212F)), T(5.469773F)), T(0.6571749F));
    const T denominator = fma(
        x, fma(x, fma(x, fma(x, T(-54.672603F), T(114.911992F)), T(-48.550422F)), T(16.831827F)),
        T(1));
    return min(numerator / denominator, T(0.99F));
}

} // namespace mbfeat
