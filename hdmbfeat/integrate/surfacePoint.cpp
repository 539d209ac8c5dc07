#include "integrate/surfacePoint.h"

#include "core/frame.h"
#include "core/rayOffset.h"

namespace mbfeat {

namespace {

/// Object-space corners of the hit triangle of an instance, or the render-space ones of a baked
/// prim.
void corners(const AccelGeometry& geometry, const RayHit& hit, Float3 (&p)[3]) {
    const Triangle& triangle = geometry.mesh->triangles[hit.triangle];
    const std::vector<Float3>& points =
        geometry.instanced ? geometry.mesh->points : geometry.bakedPoints;
    for (int c = 0; c < 3; ++c) {
        p[c] = points[triangle.v[c]];
    }
}

/// Takes a point and its error bound through an instance transform. Two errors are added: that of
/// evaluating the transform here, three products and three sums a component, and that of Embree
/// having transformed the ray by the inverse, which AccelGeometry::inverseError bounds.
void toRenderSpace(const AccelGeometry& geometry, std::uint32_t instance, SurfacePoint& point) {
    const AffineF& m = geometry.toRender[instance];
    const Float3 p = point.p;
    const Float3 magnitude =
        abs(m.x) * abs(p.x) + abs(m.y) * abs(p.y) + abs(m.z) * abs(p.z) + abs(m.t);
    const Float3 spread =
        abs(m.x) * point.pError.x + abs(m.y) * point.pError.y + abs(m.z) * point.pError.z;
    point.p = m.point(p);
    point.pError = spread * (1.0F + 8.0F * laneEpsilon<float>()) +
                   magnitude * (4.0F * laneEpsilon<float>()) +
                   Float3(geometry.inverseError[instance] *
                          (maxComponent(abs(point.p)) + maxComponent(abs(m.t))));
}

Float3 unitOr(const Float3& v, const Float3& fallback) {
    const float squared = lengthSquared(v);
    return squared > 0.0F && std::isfinite(squared) ? v / sqrt(squared) : fallback;
}

/// A normal of the object to render space, unit. Mirroring turns the winding but not the outside
/// of a surface, so it is undone.
Float3 normalToRender(const AccelGeometry& geometry, std::uint32_t instance, const Float3& n,
                      const Float3& fallback) {
    const Float3 transformed = geometry.toRender[instance].normal(n);
    return unitOr(geometry.isMirrored(instance) ? -transformed : transformed, fallback);
}

} // namespace

SurfacePoint surfacePoint(const AccelGeometry& geometry, const RayHit& hit) {
    Float3 p[3];
    corners(geometry, hit, p);
    SurfacePoint point;
    point.p = trianglePoint(p[0], p[1], p[2], hit.b1, hit.b2, point.pError);

    const Float3 facet = cross(p[1] - p[0], p[2] - p[0]);
    if (geometry.instanced) {
        toRenderSpace(geometry, hit.instance, point);
        point.ng = normalToRender(geometry, hit.instance, unitOr(facet, {0.0F, 0.0F, 1.0F}),
                                  {0.0F, 0.0F, 1.0F});
    } else {
        point.ng = unitOr(geometry.mirrored ? -facet : facet, {0.0F, 0.0F, 1.0F});
    }
    point.ns = point.ng;
    if (geometry.mesh->normals) {
        const Float4 n =
            evaluateAttribute(geometry.mesh->normals, *geometry.mesh, hit.triangle, hit.b1, hit.b2);
        point.ns = normalToRender(geometry, hit.instance, {n.x, n.y, n.z}, point.ng);
        if (dot(point.ns, point.ng) < 0.0F) {
            // Authored against the winding: the outside is where the winding says.
            point.ns = -point.ns;
        }
    }
    return point;
}

Float3 mappedNormal(const AccelGeometry& geometry, const RayHit& hit, const SurfacePoint& point,
                    const SurfaceParameters<float>& parameters) {
    const Float3& n = parameters.tangentNormal;
    if (n.x == 0.0F && n.y == 0.0F) {
        return point.ns;
    }
    const MaterialBinding& binding = geometry.bindings[geometry.mesh->materialSlotOf(hit.triangle)];
    const TangentFrame tangents = tangentFrame(binding, hit.triangle);
    const AffineF& toRender = geometry.toRender[hit.instance];
    const Float3 dpdu = toRender.vector(tangents.dpdu);
    const Float3 dpdv = toRender.vector(tangents.dpdv);
    // Gram-Schmidt against the interpolated normal; the bitangent keeps the map's handedness.
    const Float3 t =
        unitOr(dpdu - point.ns * dot(dpdu, point.ns), Frame<float>::fromNormal(point.ns).s);
    const Float3 side = cross(point.ns, t);
    const Float3 b = dot(side, dpdv) < 0.0F ? -side : side;
    return unitOr(t * n.x + b * n.y + point.ns * n.z, point.ns);
}

Float4 primvarAt(const AccelGeometry& geometry, const RayHit& hit, const std::string& name) {
    const Attribute* attribute = geometry.mesh->findPrimvar(name);
    return attribute != nullptr
               ? evaluateAttribute(*attribute, *geometry.mesh, hit.triangle, hit.b1, hit.b2)
               : Float4(0.0F, 0.0F, 0.0F, 0.0F);
}

} // namespace mbfeat
