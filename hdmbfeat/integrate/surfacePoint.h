// From "triangle 7, barycentrics" to a point with an error bound, normals and closure inputs.
//
// fetchSurface() collects what the mesh holds, one hit at a time; surfacePoint() does the
// arithmetic, on one hit or on as many as there are lanes.
#pragma once

#include <limits>

#include "core/affine.h"
#include "core/frame.h"
#include "core/rayOffset.h"
#include "core/vec.h"
#include "integrate/accel.h"
#include "shading/bsdf.h"

namespace mbfeat {

/// What of a hit the mesh and its placement say. Plain values of T and nothing else, so that
/// several of float can be transposed to lanes.
template <class T>
struct SurfaceInputs {
    Vec3<T> p0, p1, p2; ///< corners: object space of an instance, render space of a baked prim
    T b1, b2;           ///< barycentric weights of corners 1 and 2
    Vec3<T> n;          ///< interpolated normal, object space; 0 where the mesh has none
    Affine<T> toRender;
    T sign;         ///< -1 where the placement mirrors, else 1
    T instanced;    ///< 1 where the corners are in object space, else 0
    T inverseError; ///< AccelGeometry::inverseError; 0 when not instanced
};

SurfaceInputs<float> fetchSurface(const AccelGeometry& geometry, const RayHit& hit);

/// A point on a surface, render space.
template <class T>
struct SurfacePointLanes {
    Vec3<T> p{T(0)};
    Vec3<T> pError{T(0)};         ///< componentwise bound of the absolute error of p
    Vec3<T> ng{T(0), T(0), T(1)}; ///< geometric normal, unit, on the outside of the surface
    Vec3<T> ns{T(0), T(0), T(1)}; ///< interpolated normal, unit, on the side of ng
};
using SurfacePoint = SurfacePointLanes<float>;

template <class T>
Vec3<T> unitOr(const Vec3<T>& v, const Vec3<T>& fallback) {
    const T squared = lengthSquared(v);
    const Mask<T> usable = squared > T(0) && squared <= T(std::numeric_limits<float>::max());
    return select<T>(usable, v / sqrt(select(usable, squared, T(1))), fallback);
}

/// Takes a point and its error bound through an instance transform. Two errors are added: that of
/// evaluating the transform here, three products and three sums a component, and that of Embree
/// having transformed the ray by the inverse, which AccelGeometry::inverseError bounds.
template <class T>
void placePoint(const SurfaceInputs<T>& in, SurfacePointLanes<T>& point) {
    const Affine<T>& m = in.toRender;
    const Vec3<T> p = point.p;
    const Vec3<T> magnitude =
        abs(m.x) * abs(p.x) + abs(m.y) * abs(p.y) + abs(m.z) * abs(p.z) + abs(m.t);
    const Vec3<T> spread =
        abs(m.x) * point.pError.x + abs(m.y) * point.pError.y + abs(m.z) * point.pError.z;
    const Vec3<T> placed = m.point(p);
    const Vec3<T> error =
        spread * (T(1) + T(8) * laneEpsilon<T>()) + magnitude * (T(4) * laneEpsilon<T>()) +
        Vec3<T>(in.inverseError * (maxComponent(abs(placed)) + maxComponent(abs(m.t))));
    const Mask<T> instanced = in.instanced > T(0);
    point.p = select<T>(instanced, placed, point.p);
    point.pError = select<T>(instanced, error, point.pError);
}

template <class T>
SurfacePointLanes<T> surfacePoint(const SurfaceInputs<T>& in) {
    SurfacePointLanes<T> point;
    point.p = trianglePoint(in.p0, in.p1, in.p2, in.b1, in.b2, point.pError);
    const Vec3<T> up(T(0), T(0), T(1));
    // Mirroring turns the winding but not the outside of a surface, so it is undone.
    Vec3<T> facet = cross(in.p1 - in.p0, in.p2 - in.p0);
    if (any(in.instanced > T(0))) {
        placePoint(in, point);
        facet = select<T>(in.instanced > T(0), in.toRender.normal(unitOr(facet, up)), facet);
    }
    point.ng = unitOr(facet * in.sign, up);
    point.ns = point.ng;
    const Mask<T> smooth = in.n.x != T(0) || in.n.y != T(0) || in.n.z != T(0);
    if (any(smooth)) {
        const Vec3<T> n = unitOr(in.toRender.normal(in.n) * in.sign, point.ng);
        // Authored against the winding: the outside is where the winding says.
        const Vec3<T> sided = n * copysign(T(1), dot(n, point.ng));
        point.ns = select<T>(smooth, sided, point.ng);
    }
    return point;
}

inline SurfacePoint surfacePoint(const AccelGeometry& geometry, const RayHit& hit) {
    return surfacePoint(fetchSurface(geometry, hit));
}

/// ns bent by the normal map of the material; unit, on the side of ng where the map allows.
Float3 mappedNormal(const AccelGeometry& geometry, const RayHit& hit, const Float3& ns,
                    const Float3& tangentNormal);

/// Three floats of a primvar (w as 0 or 1 by its width) at the hit; zero where it is absent.
Float4 primvarAt(const AccelGeometry& geometry, const RayHit& hit, const std::string& name);

} // namespace mbfeat
