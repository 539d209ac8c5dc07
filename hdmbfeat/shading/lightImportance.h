// How much a cluster of lights can light a receiver: the measure by which the light tree chooses.
// After Conty Estevez and Kulla 2018, section 4.3. Template on the lane type: lanes are clusters.
#pragma once

#include <type_traits>

#include "core/laneQuads.h"
#include "core/vec.h"

namespace mbfeat {

/// Cosines are taken to be wrong by as much: what is darker by less is not sure to be dark. The
/// worst of the formulas below loses half of the digits to cancellation.
inline constexpr float kCosineSlack = 1e-3F;
/// Cosines count as at least this. At grazing angles they say least about the light that arrives:
/// it comes from a part of the cluster, and glossy surfaces do not follow the cosine.
inline constexpr float kLeastCosine = 0.02F;

/// Lanes for the eight clusters of a node: eight where the machine has them, else two times four.
using ClusterBatch =
    std::conditional_t<std::is_void_v<xsimd::make_sized_batch_t<float, 8>>,
                       xsimd::make_sized_batch_t<float, 4>, xsimd::make_sized_batch_t<float, 8>>;

/// The bounds of clusters, one a lane, in the form that importance() wants.
template <class T>
struct ClusterLanes {
    Vec3<T> center; ///< of a sphere around the cluster
    T radius;       ///< above zero, and not so small that its square underflows
    Vec3<T> axis;
    T cosSpread, sinSpread, cosFalloff; ///< see LightBounds
    T strength;                         ///< negative where both sides of the axis emit
};

/// An estimate of the light from each lane's cluster at the point p with unit normal n; where
/// twoSided from both sides of it. Zero only where none of the cluster's light arrives.
/// `leastInverse` bounds the inverse of the squared distance from below, so that nothing
/// underflows.
template <class T>
MBFEAT_INLINE T importanceAt(const ClusterLanes<T>& cluster, const Vec3<T>& p, const Vec3<T>& n,
                             const Mask<T>& twoSided, const T& leastInverse) {
    const T slack(kCosineSlack), least(kLeastCosine), zero(0);
    const Vec3<T> d = cluster.center - p;
    const T squared = lengthSquared(d);
    const T radius2 = cluster.radius * cluster.radius;
    const Mask<T> inside = !(squared > radius2);
    // Within the sphere the distance of the lights is anything, and what stands for it bounds the
    // noise. The mean over a ball of the inverse squared distance from a point inside is between
    // 1.5 and 3 times the inverse squared radius, so it is 2 rather than the paper's 1.
    const T d2 = max(squared, T(0.5F) * radius2);
    const T inverse = T(1) / d2;
    // Everything is scaled by the distance: the tangent to the sphere has the length t, so the
    // angle that the sphere fills has the sine radius and the cosine t.
    const T t = safeSqrt(d2 - radius2);

    // The angle between the axis and the receiver, less the sphere's, less the spread.
    const T alongAxis = -dot(cluster.axis, d);
    const T a = select(cluster.strength < zero, abs(alongAxis), alongAxis);
    const T b = safeSqrt(d2 - a * a);
    const Mask<T> inSphere = inside | !(a < t);
    const T cosSeen = fma(a, t, b * cluster.radius) * inverse;
    const T sinSeen = fma(b, t, -(a * cluster.radius)) * inverse;
    const Mask<T> inSpread = inSphere | !(cosSeen < cluster.cosSpread);
    const T fallen = fma(cosSeen, cluster.cosSpread, sinSeen * cluster.sinSpread);
    const T emitted = select(inSpread, T(1), fallen);

    // The angle between the normal and the cluster, less the sphere's.
    const T alongNormal = dot(n, d);
    const T e = select(twoSided, abs(alongNormal), alongNormal);
    const T f = safeSqrt(d2 - e * e);
    const Mask<T> overhead = inside | !(e < t);
    const T received = select(overhead, T(1), fma(e, t, f * cluster.radius) * inverse);

    const Mask<T> dark = (emitted < cluster.cosFalloff - slack) | (received < -slack);
    const T light = abs(cluster.strength) * max(inverse, leastInverse) * max(emitted, least) *
                    max(received, least);
    return select(dark, zero, light);
}

/// The same for one receiver in all lanes.
template <class T>
MBFEAT_INLINE T importance(const ClusterLanes<T>& cluster, const Vec3<Scalar<T>>& p,
                           const Vec3<Scalar<T>>& n, bool twoSided, Scalar<T> leastInverse) {
    return importanceAt(cluster, Vec3<T>(T(p.x), T(p.y), T(p.z)), Vec3<T>(T(n.x), T(n.y), T(n.z)),
                        Mask<T>(twoSided), T(leastInverse));
}

} // namespace mbfeat
