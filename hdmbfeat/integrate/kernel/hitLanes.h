// The hits of a group of paths and what the meshes hold there. Where all are on one baked mesh,
// which sorting by material makes the rule, its arrays are gathered from directly; else each hit is
// fetched on its own.
#pragma once

#include "integrate/kernel/kernelState.h"
#include "integrate/kernel/surfaceLanes.h"
#include "shading/materialLanes.h"

namespace mbfeat {

inline const MaterialBinding& bindingAt(const AccelGeometry& geometry, std::uint32_t triangle) {
    return geometry.bindings[geometry.mesh->materialSlotOf(triangle)];
}

template <class T>
class HitLanes {
public:
    HitLanes(const KernelState<T>& s, const typename KernelState<T>::Group& g)
        : s_(s),
          g_(g),
          hit_(s.paths.template get<T>(kHit, g.read)),
          triangle_(bitsOf(hit_.z)) {
        const std::int32_t first = s.paths.integer(kHitGeometry, g.read[0]);
        bool one = true;
        for (int i = 1; i < g.count; ++i) {
            one = one && s.paths.integer(kHitGeometry, g.read[i]) == first;
        }
        one_ = one ? s.context->accel.geometries()[static_cast<std::size_t>(first)].get() : nullptr;
    }

    /// From the last vertex.
    const T& distance() const { return hit_.w; }

    RayHit hit(int lane) const { return s_.hit(g_.read[lane]); }
    const AccelGeometry& geometry(int lane) const {
        return one_ != nullptr ? *one_
                               : *s_.context->accel.geometries()[static_cast<std::size_t>(
                                     s_.paths.integer(kHitGeometry, g_.read[lane]))];
    }

    /// The binding of all lanes, or null where they have several.
    const MaterialBinding* oneBinding() const {
        if (one_ != nullptr && one_->mesh->triangleMaterials.empty()) {
            return one_->bindings.data();
        }
        const MaterialBinding* const first = &bindingAt(geometry(0), hit(0).triangle);
        for (int i = 1; i < g_.count; ++i) {
            if (&bindingAt(geometry(i), hit(i).triangle) != first) {
                return nullptr;
            }
        }
        return first;
    }

    /// Of hits that have one binding, and so one mesh.
    MeshPlaces<T> places() const {
        const LaneQuad<T> place = s_.paths.template get<T>(kHitB1, g_.read);
        return {triangle_, place.x, place.y};
    }

    SurfaceInputs<T> surfaces() const {
        if (one_ != nullptr && !(kBuiltEffects.has(Effect::kInstancing) && one_->instanced)) {
            return gathered(*one_);
        }
        Transposer<T, SurfaceInputs> inputs;
        for (int i = 0; i < kWidth; ++i) {
            inputs.set(i, fetchSurface(geometry(i), hit(i)));
        }
        return inputs.lanes();
    }

private:
    static constexpr int kWidth = LaneTraits<T>::kWidth;

    static Vec3<T> gather3(const float* values, const IntLane<T>& index) {
        const IntLane<T> at = index * IntLane<T>(3);
        return {gatherLanes<T>(values, at), gatherLanes<T>(values + 1, at),
                gatherLanes<T>(values + 2, at)};
    }

    /// The same values as fetchSurface() of every lane.
    SurfaceInputs<T> gathered(const AccelGeometry& geometry) const {
        const Mesh& mesh = *geometry.mesh;
        static_assert(sizeof(Triangle) == 3 * sizeof(std::int32_t));
        const auto* const corners = reinterpret_cast<const std::int32_t*>(mesh.triangles.data());
        const auto* const points = reinterpret_cast<const float*>(geometry.bakedPoints.data());
        const IntLane<T> first = triangle_ * IntLane<T>(3);
        const IntLane<T> v0 = gatherIntLanes<T>(corners, first);
        const IntLane<T> v1 = gatherIntLanes<T>(corners + 1, first);
        const IntLane<T> v2 = gatherIntLanes<T>(corners + 2, first);
        SurfaceInputs<T> in;
        in.p0 = gather3(points, v0);
        in.p1 = gather3(points, v1);
        in.p2 = gather3(points, v2);
        const LaneQuad<T> place = s_.paths.template get<T>(kHitB1, g_.read);
        in.b1 = place.x;
        in.b2 = place.y;
        in.n = Vec3<T>(T(0));
        if (mesh.normals) {
            in.n = normals(mesh, v0, v1, v2, first, in.b1, in.b2);
        }
        in.toRender = geometry.toRender.front().template as<T>();
        in.sign = T(geometry.mirrored ? -1.0F : 1.0F);
        in.instanced = T(0);
        in.inverseError = T(0);
        return in;
    }

    Vec3<T> normals(const Mesh& mesh, const IntLane<T>& v0, const IntLane<T>& v1,
                    const IntLane<T>& v2, const IntLane<T>& firstCorner, const T& b1,
                    const T& b2) const {
        const float* const values = mesh.normals.values.data();
        switch (mesh.normals.interpolation) {
        case Interpolation::kConstant:
            return {T(values[0]), T(values[1]), T(values[2])};
        case Interpolation::kUniform:
            return gather3(values, faces(mesh));
        case Interpolation::kVertex:
            return blend(gather3(values, v0), gather3(values, v1), gather3(values, v2), b1, b2);
        case Interpolation::kFaceVarying:
            break;
        }
        return blend(gather3(values, firstCorner), gather3(values + 3, firstCorner),
                     gather3(values + 6, firstCorner), b1, b2);
    }

    IntLane<T> faces(const Mesh& mesh) const {
        return mesh.triangleFaces.empty() ? triangle_
                                          : gatherIntLanes<T>(reinterpret_cast<const std::int32_t*>(
                                                                  mesh.triangleFaces.data()),
                                                              triangle_);
    }

    /// As evaluateAttribute() does.
    static Vec3<T> blend(const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c, const T& b1,
                         const T& b2) {
        const T b0 = (T(1) - b1) - b2;
        return {fma(b0, a.x, fma(b1, b.x, b2 * c.x)), fma(b0, a.y, fma(b1, b.y, b2 * c.y)),
                fma(b0, a.z, fma(b1, b.z, b2 * c.z))};
    }

    const KernelState<T>& s_;
    const typename KernelState<T>::Group& g_;
    LaneQuad<T> hit_;
    IntLane<T> triangle_;
    const AccelGeometry* one_; ///< that all hits are on, or null
};

} // namespace mbfeat
