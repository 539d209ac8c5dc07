// Ray origins that lie off the surface they leave, by as much as rounding can have moved the point
// and no more. Templates on the lane type.
//
// Derivation. Let p be the computed point, e its componentwise error bound, and p* the exact point
// on the surface, so |p_i - p*_i| <= e_i. We look for the smallest d for which q = fl(p + d n) is
// on the side of the exact tangent plane that n points to, for every p* in the box:
//     n.(q - p*) = d n.n + n.(p - p*) + n.r  >=  d n.n - |n|.e - |n|.|r|,
// where r is the rounding error of q. With u the unit roundoff, q_i = fl(p_i + fl(d n_i)) gives
//     |r_i| <= u |p_i| + 2 u d |n_i|   (to first order),
// so |n|.|r| <= u |n|.|p| + 2 u d, and n.n >= 1 - 4 u for a normal that was normalised in working
// precision. Hence
//     d = |n|.(e + u |p|) / (1 - 6 u)
// suffices. The dot products are of non-negative terms and lose at most 4 u relative, so the code
// takes 2 u where u stands, which covers that, the division and second-order terms.
#pragma once

#include <limits>

#include "core/vec.h"

namespace mbfeat {

/// Twice the unit roundoff of a lane type's scalar.
template <class T>
T laneEpsilon() {
    return T(std::numeric_limits<Scalar<T>>::epsilon());
}

/// The origin for a ray that leaves p in direction w: on the side of the surface that w points to.
/// n is the unit geometric normal (either side), pError the bound on p's components.
template <class T>
Vec3<T> offsetRayOrigin(const Vec3<T>& p, const Vec3<T>& pError, const Vec3<T>& n,
                        const Vec3<T>& w) {
    const T eps = laneEpsilon<T>();
    const Vec3<T> bound = pError + abs(p) * eps;
    // 16 eps covers the relative terms of the derivation with room to spare.
    const T d = dot(abs(n), bound) * (T(1) + T(16) * eps);
    return p + n * copysign(d, dot(w, n));
}

/// Point of a triangle at barycentric weights b1, b2 and the bound of its error, for corners that
/// are exact. Of p = p0 + b1 (p1 - p0) + b2 (p2 - p0) every difference has an error of u, every
/// fused multiply-add another u of its result; moving the weights moves the point within the
/// triangle's plane and is no error. With |p_j - p0| <= |p_j| + |p0| the sum stays below
/// 4 u (|p0| + |b1| (|p1| + |p0|) + |b2| (|p2| + |p0|)); 4 eps leaves a factor of two.
template <class T>
Vec3<T> trianglePoint(const Vec3<T>& p0, const Vec3<T>& p1, const Vec3<T>& p2, T b1, T b2,
                      Vec3<T>& pError) {
    const auto component = [&](T a, T b, T c) { return fma(b1, b - a, fma(b2, c - a, a)); };
    const Vec3<T> a0 = abs(p0);
    pError = (a0 + (abs(p1) + a0) * abs(b1) + (abs(p2) + a0) * abs(b2)) * (T(4) * laneEpsilon<T>());
    return {component(p0.x, p1.x, p2.x), component(p0.y, p1.y, p2.y), component(p0.z, p1.z, p2.z)};
}

/// A ray from one surface to a point on another that ends before it.
template <class T>
struct RaySegment {
    Vec3<T> origin;
    Vec3<T> direction; ///< unit
    T length;          ///< end of the segment along direction
};

/// The segment between two points, both moved off their surfaces towards each other. A target
/// normal of zero leaves the target where it is.
template <class T>
RaySegment<T> offsetSegment(const Vec3<T>& p, const Vec3<T>& pError, const Vec3<T>& n,
                            const Vec3<T>& target, const Vec3<T>& targetError,
                            const Vec3<T>& targetNormal) {
    const Vec3<T> towards = target - p;
    const Vec3<T> from = offsetRayOrigin(p, pError, n, towards);
    // Rounding the direction moves the end by up to 3 eps of each component of the way; at grazing
    // angles only an offset that allows for it keeps the end before the target.
    const Vec3<T> reach = targetError + abs(towards) * (T(3) * laneEpsilon<T>());
    const Vec3<T> to = offsetRayOrigin(target, reach, targetNormal, -towards);
    const Vec3<T> d = to - from;
    const T distance = length(d);
    const T safe = max(distance, T(std::numeric_limits<Scalar<T>>::min()));
    // The length is rounded too, and so is what a tracer makes of it.
    return {from, d / safe, distance * (T(1) - T(8) * laneEpsilon<T>())};
}

} // namespace mbfeat
