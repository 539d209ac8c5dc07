#include "integrate/surfacePoint.h"

namespace mbfeat {

SurfaceInputs<float> fetchSurface(const AccelGeometry& geometry, const RayHit& hit) {
    const Mesh& mesh = *geometry.mesh;
    const Triangle& triangle = mesh.triangles[hit.triangle];
    const std::vector<Float3>& points = geometry.instanced ? mesh.points : geometry.bakedPoints;
    SurfaceInputs<float> in;
    in.p0 = points[triangle.v[0]];
    in.p1 = points[triangle.v[1]];
    in.p2 = points[triangle.v[2]];
    in.b1 = hit.b1;
    in.b2 = hit.b2;
    in.n = Float3(0.0F);
    if (mesh.normals) {
        const Float4 n = evaluateAttribute(mesh.normals, mesh, hit.triangle, hit.b1, hit.b2);
        in.n = {n.x, n.y, n.z};
    }
    in.toRender = geometry.toRender[geometry.instanced ? hit.instance : 0];
    in.sign = geometry.isMirrored(hit.instance) ? -1.0F : 1.0F;
    in.instanced = geometry.instanced ? 1.0F : 0.0F;
    in.inverseError = geometry.instanced ? geometry.inverseError[hit.instance] : 0.0F;
    return in;
}

Float3 mappedNormal(const AccelGeometry& geometry, const RayHit& hit, const Float3& ns,
                    const Float3& tangentNormal) {
    const Float3& n = tangentNormal;
    if (n.x == 0.0F && n.y == 0.0F) {
        return ns;
    }
    const MaterialBinding& binding = geometry.bindings[geometry.mesh->materialSlotOf(hit.triangle)];
    const TangentFrame tangents = tangentFrame(binding, hit.triangle);
    const AffineF& toRender = geometry.toRender[hit.instance];
    const Float3 dpdu = toRender.vector(tangents.dpdu);
    const Float3 dpdv = toRender.vector(tangents.dpdv);
    // Gram-Schmidt against the interpolated normal; the bitangent keeps the map's handedness.
    const Float3 t = unitOr(dpdu - ns * dot(dpdu, ns), Frame<float>::fromNormal(ns).s);
    const Float3 side = cross(ns, t);
    const Float3 b = dot(side, dpdv) < 0.0F ? -side : side;
    return unitOr(t * n.x + b * n.y + ns * n.z, ns);
}

Float4 primvarAt(const AccelGeometry& geometry, const RayHit& hit, const std::string& name) {
    const Attribute* attribute = geometry.mesh->findPrimvar(name);
    return attribute != nullptr
               ? evaluateAttribute(*attribute, *geometry.mesh, hit.triangle, hit.b1, hit.b2)
               : Float4(0.0F, 0.0F, 0.0F, 0.0F);
}

} // namespace mbfeat
