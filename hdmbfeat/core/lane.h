// The lane type: what a formula is evaluated on.
//
// Shading formulas and samplers are templates on a lane type T:
//   float               readable reference code that can be stepped through,
//   double              the oracle that the numerics tests compare with,
//   xsimd::batch<float> 8 or 16 paths at once, the production kernel of the stream integrator.
// Write them with Mask<T> and select() where lanes can differ, never with `if` on a lane value.
// The mathematical functions are found unqualified: here for scalars, by argument-dependent
// lookup in namespace xsimd for batches. Ordinary `if` is for what is uniform over lanes (any()).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include <xsimd/xsimd.hpp>

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

namespace mbfeat {

using std::abs;
using std::acos;
using std::asin;
using std::atan2;
using std::ceil;
using std::copysign;
using std::cos;
using std::exp;
using std::floor;
using std::fma;
using std::isfinite;
using std::log;
using std::max;
using std::min;
using std::pow;
using std::sin;
using std::sqrt;
using std::tan;

#if defined(__AVX512F__)
/// xsimd 8's AVX-512 has no fused form of its own and rounds twice. Not a template, so that it is
/// preferred to xsimd's.
inline xsimd::batch<float> fma(const xsimd::batch<float>& a, const xsimd::batch<float>& b,
                               const xsimd::batch<float>& c) {
    return {_mm512_fmadd_ps(a, b, c)};
}
#endif

/// Properties of a lane type: its mask type, its scalar type and its number of lanes.
template <class T>
struct LaneTraits {
    static_assert(std::is_floating_point_v<T>, "a lane type is float, double or an xsimd batch");
    using Mask = bool;
    using Scalar = T;
    static constexpr int kWidth = 1;
};

template <class S, class A>
struct LaneTraits<xsimd::batch<S, A>> {
    using Mask = xsimd::batch_bool<S, A>;
    using Scalar = S;
    static constexpr int kWidth = static_cast<int>(xsimd::batch<S, A>::size);
};

template <class T>
using Mask = typename LaneTraits<T>::Mask;
template <class T>
using Scalar = typename LaneTraits<T>::Scalar;

/// a where m holds, else b. Both sides are evaluated: guard divisions and roots before.
inline float select(bool m, float a, float b) {
    return m ? a : b;
}
inline double select(bool m, double a, double b) {
    return m ? a : b;
}

/// -x with the sign of zero turned too, which xsimd's 0 - x is not.
template <class T>
T negate(const T& x) {
    if constexpr (std::is_floating_point_v<T>) {
        return -x;
    } else {
        return x ^ T(-0.0F);
    }
}

inline bool any(bool m) {
    return m;
}
inline bool all(bool m) {
    return m;
}
inline bool none(bool m) {
    return !m;
}

template <class T>
T clamp(T x, T lo, T hi) {
    return min(max(x, lo), hi);
}

template <class T>
T lerp(T t, T a, T b) {
    return fma(t, b - a, a);
}

template <class T>
T sqr(T x) {
    return x * x;
}

/// sqrt that returns 0 for arguments that rounding made slightly negative.
template <class T>
T safeSqrt(T x) {
    return sqrt(max(x, T(0)));
}

/// Sine and cosine of 2 pi u for |u| up to about 1e5, to 1.7 ulp of the larger of the two. Float
/// and SIMD lanes get the same bits, which the C library's functions would not give; doubles get
/// the library's. Reduction to an eighth of a turn is exact; minimax polynomials of S. Moshier's
/// Cephes library (sinf.c) from there on.
template <class T>
void sinCosTurns(T u, T& sine, T& cosine) {
    if constexpr (std::is_same_v<T, double>) {
        constexpr double kTurn = 6.283185307179586476925;
        sine = std::sin(kTurn * u);
        cosine = std::cos(kTurn * u);
    } else {
        const T quarter = floor(fma(u, T(4), T(0.5F)));
        const T x = fma(quarter, T(-0.25F), u) * T(6.28318530717958647693F);
        const T x2 = x * x;
        const T s = fma(
            x * x2,
            fma(x2, fma(x2, T(-1.9515295891e-4F), T(8.3321608736e-3F)), T(-1.6666654611e-1F)), x);
        const T c = fma(x2 * x2,
                        fma(x2, fma(x2, T(2.443315711809948e-5F), T(-1.388731625493765e-3F)),
                            T(4.166664568298827e-2F)),
                        fma(x2, T(-0.5F), T(1)));
        // The quadrant, 0 to 3.
        const T quadrant = fma(floor(quarter * T(0.25F)), T(-4), quarter);
        const Mask<T> odd = quadrant == T(1) || quadrant == T(3);
        const T a = select(odd, c, s);
        const T b = select(odd, s, c);
        sine = select(quadrant >= T(2), negate(a), a);
        cosine = select(quadrant == T(1) || quadrant == T(2), negate(b), b);
    }
}

inline constexpr float kPi = 3.14159265358979323846F;
inline constexpr float kInvPi = 0.31830988618379067154F;
inline constexpr float kTwoPi = 6.28318530717958647693F;

/// The largest float below 1: random numbers and barycentrics are clamped to it.
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1F;

} // namespace mbfeat
