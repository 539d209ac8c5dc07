// Warps of the unit square to distributions on discs, spheres, cones and triangles, and their
// densities. Templates on the lane type; u is in [0, 1)^2. All keep area ratios, so stratified
// points stay stratified.
#pragma once

#include "core/vec.h"

namespace mbfeat {

/// Uniform on the unit disc, concentric map (Shirley and Chiu 1997): low distortion, no
/// trigonometry of the radius. The centre of the square maps to the centre of the disc.
template <class T>
Vec2<T> concentricDisk(Vec2<T> u) {
    const T a = fma(T(2), u.x, T(-1));
    const T b = fma(T(2), u.y, T(-1));
    const Mask<T> wide = abs(a) > abs(b);
    const T r = select(wide, a, b);
    const T other = select(wide, b, a);
    const T ratio = select(r == T(0), T(0), other / select(r == T(0), T(1), r));
    T s, c;
    sinCosTurns(T(0.125F) * ratio, s, c);
    return {r * select(wide, c, s), r * select(wide, s, c)};
}

template <class T>
T concentricDiskPdf() {
    return T(kInvPi);
}

/// Directions about +z with density cos(theta) / pi.
template <class T>
Vec3<T> cosineHemisphere(Vec2<T> u) {
    const Vec2<T> d = concentricDisk(u);
    return {d.x, d.y, safeSqrt(T(1) - fma(d.x, d.x, d.y * d.y))};
}

template <class T>
T cosineHemispherePdf(T cosTheta) {
    return max(cosTheta, T(0)) * T(kInvPi);
}

/// Directions, uniform over the sphere.
template <class T>
Vec3<T> uniformSphere(Vec2<T> u) {
    const T z = fma(T(-2), u.x, T(1));
    // 1 - z^2 without cancellation near the poles.
    const T r = T(2) * safeSqrt(u.x * (T(1) - u.x));
    T s, c;
    sinCosTurns(u.y, s, c);
    return {r * c, r * s, z};
}

template <class T>
T uniformSpherePdf() {
    return T(0.25F * kInvPi);
}

/// Directions about +z, uniform over the cone. The cone is given as 1 - cos(half angle), so that
/// narrow ones keep their precision.
template <class T>
Vec3<T> uniformCone(Vec2<T> u, T oneMinusCosMax) {
    const T h = u.x * oneMinusCosMax;
    const T r = safeSqrt(h * (T(2) - h));
    T s, c;
    sinCosTurns(u.y, s, c);
    return {r * c, r * s, T(1) - h};
}

template <class T>
T uniformConePdf(T oneMinusCosMax) {
    return T(0.5F * kInvPi) / oneMinusCosMax;
}

/// Barycentric weights (b1, b2) of corners 1 and 2, uniform over the triangle; b0 = 1 - b1 - b2.
/// Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
template <class T>
Vec2<T> uniformTriangle(Vec2<T> u) {
    const Mask<T> below = u.x < u.y;
    const T smaller = T(0.5F) * select(below, u.x, u.y);
    const T larger = select(below, u.y, u.x) - smaller;
    return {select(below, smaller, larger), select(below, larger, smaller)};
}

/// Density per area of the triangle's own surface.
template <class T>
T uniformTrianglePdf(T area) {
    return T(1) / area;
}

} // namespace mbfeat
