// The acceleration structure: the committed scene as Embree sees it, in render space (world minus
// Scene::origin(), float).
//
// Plain prims are baked to render space and traced directly; prims with instances keep one BVH of
// their object space for all of them. Analytic lights have a structure of their own, which is asked
// after that of the surfaces, so that an edit of a light builds no surface again. Where they are
// few rays are tested against each of them instead. Neither is Embree's: its calls out of its
// traversal, shape by shape, cost more than all of this.
//
// Threads: commit() by one thread while nothing traces; the rest by any.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/bounds.h"
#include "core/laneMemory.h"
#include "integrate/embree.h"
#include "scene/scene.h"
#include "shading/lightLanes.h"
#include "shading/lightSampler.h"
#include "shading/lightShapeTree.h"
#include "shading/material.h"

namespace mbfeat {

/// Polled by long work; true ends it early.
using StopCheck = std::function<bool()>;

/// Up to so many light shapes are met one by one after each query; more are in the structure.
inline constexpr std::uint32_t kMostLooseShapes = 8;

/// How often what was built, since the structure was made.
struct AccelBuilds {
    std::uint64_t meshes = 0;     ///< prims, with their BVH where they are instanced
    std::uint64_t placements = 0; ///< instanced prims that moved and kept their BVH
    std::uint64_t bindings = 0;   ///< materials of all prims bound to their meshes
    std::uint64_t top = 0;        ///< the BVH over all prims
    std::uint64_t lights = 0;     ///< the BVH over light shapes, where they are many
};

/// What a ray met, as indices.
struct RayHit {
    enum class Kind : std::uint8_t { kNone, kSurface, kLight };
    Kind kind = Kind::kNone;
    float t = 0.0F;
    std::uint32_t geometry = 0; ///< index into Accel::geometries(), for surfaces
    std::uint32_t instance = 0; ///< index into the geometry's transforms
    std::uint32_t triangle = 0;
    float b1 = 0.0F, b2 = 0.0F; ///< barycentric weights of corners 1 and 2
    std::uint32_t light = 0;    ///< index of the analytic light, for lights
};

/// A prim in the acceleration structure.
struct AccelGeometry {
    std::shared_ptr<const Geometry> source;
    std::shared_ptr<const Mesh> mesh;
    /// Material of each slot, bound to the mesh's primvars.
    std::vector<MaterialBinding> bindings;
    std::uint32_t firstBinding = 0; ///< number of bindings[0] among those of all geometries
    std::vector<std::shared_ptr<const Material>> materials; ///< what the bindings point to
    bool instanced = false;
    std::vector<AffineF> toRender;              ///< object to render space, one a transform
    std::vector<Float3> bakedPoints;            ///< render space; only when not instanced
    bool mirrored = false;                      ///< the one transform of a plain prim mirrors
    std::vector<std::uint8_t> instanceMirrored; ///< per transform when instanced
    /// Per transform when instanced: relative error of taking a ray to object space and its hit
    /// back, a few roundings times the condition of the linear part.
    std::vector<float> inverseError;
    bool mayCutOut = false;
    bool emits = false;
    /// Index of the emissive triangle entry of (instance 0, triangle); empty when nothing emits.
    /// Instance i adds i * emissiveCount.
    std::vector<std::int32_t> emissiveIndex;
    std::int32_t emissiveBase = 0;
    std::int32_t emissiveCount = 0;

    EmbreeGeometry geometry; ///< triangles, attached to the top or to `prototype`
    EmbreeScene prototype;   ///< only when instanced

    bool isMirrored(std::uint32_t instance) const {
        return instanced ? instanceMirrored[instance] != 0 : mirrored;
    }
};

/// Where an emissive triangle entry of the light sampler came from.
struct EmissiveTriangleRef {
    std::uint32_t geometry, instance, triangle;
};

class Accel {
public:
    explicit Accel(Diagnostics& diagnostics);
    ~Accel();

    /// Brings the structure up to the scene's committed state. Returns false when `shouldStop` (may
    /// be empty) said so before it was complete; the next call goes on.
    bool commit(const Scene& scene, bool robust, const StopCheck& shouldStop);
    /// (Re)binds materials to meshes after material edits.
    void bindMaterials(const Scene& scene);
    /// Triangles with an emissive material, for the light sampler, in render space.
    std::vector<EmissiveTriangle> collectEmissiveTriangles();
    /// Builds the top level over all prims, where surfaces changed, and the structure of the
    /// analytic lights, which must outlive it. False when `shouldStop` said so: call it again
    /// before tracing, with `surfacesChanged`.
    bool commitTop(const LightSampler& lights, bool surfacesChanged, const StopCheck& shouldStop);
    bool robust() const { return robust_; }

    /// Direction of any length; distances are in units of it. `coherent` for camera rays.
    RayHit intersect(const Float3& origin, const Float3& direction, float tNear, float tFar,
                     bool coherent) const;
    bool occluded(const Float3& origin, const Float3& direction, float tNear, float tFar) const;

    /// The nearest loose light shape along each ray in [tNear, tFar], whose distance tFar becomes;
    /// -1 where there is none. Every query ends with it: packets leave it to the caller.
    template <class T>
    IntLane<T> meetLooseShapes(const Vec3<T>& origin, const Vec3<T>& direction, const T& tNear,
                               T& tFar) const {
        IntLane<T> nearest(-1);
        for (std::uint32_t i = 0; i < looseShapes_; ++i) {
            const T t = intersectLight<T>(lights_->prepared(lights_->lightOfShape(i)), origin,
                                          direction, tNear, tFar);
            const Mask<T> met = t > T(0);
            tFar = select(met, t, tFar);
            nearest = selectInt(met, IntLane<T>(static_cast<std::int32_t>(i)), nearest);
        }
        return nearest;
    }
    /// The same for packets of N = 8 or 16 rays in Embree's layout, `valid` as Embree wants it;
    /// without the loose shapes.
    template <int N>
    void intersectPacket(const int* valid, typename EmbreePacket<N>::RayHit& rays,
                         bool coherent) const {
        embreeIntersectPacket<N>(top_.get(), valid, rays, coherent);
        if (!lightShapes_.empty()) {
            meetLightShapes<N>(valid, rays);
        }
    }
    template <int N>
    void occludedPacket(const int* valid, typename EmbreePacket<N>::Ray& rays) const {
        embreeOccludedPacket<N>(top_.get(), valid, rays);
        if (lightShapes_.empty()) {
            return;
        }
        for (int i = 0; i < N; ++i) {
            // Rays that met something end before they begin.
            if (valid[i] != 0 && rays.tfar[i] >= 0.0F && lightShapes_.occluded(rayOf(rays, i))) {
                rays.tfar[i] = -std::numeric_limits<float>::infinity();
            }
        }
    }
    /// A hit on shape number `shape` of the light sampler.
    RayHit lightHit(std::uint32_t shape, float t) const;
    /// What Embree's names of a hit stand for.
    RayHit decode(unsigned geomId, unsigned instId, unsigned primId, float t, float b1,
                  float b2) const;

    const std::vector<std::unique_ptr<AccelGeometry>>& geometries() const { return geometries_; }
    const AccelBuilds& builds() const { return builds_; }
    /// Light shapes that are in a structure.
    std::uint32_t lightsInside() const { return lights_->shapeCount() - looseShapes_; }
    const std::vector<EmissiveTriangleRef>& emissiveTriangles() const { return emissive_; }
    bool mayCutOut() const { return mayCutOut_; }
    /// Bindings of all geometries, numbered through: see AccelGeometry::firstBinding.
    std::size_t bindingCount() const { return bindingCount_; }
    std::size_t triangleCount() const { return triangles_; }
    std::size_t instanceCount() const { return instances_; }
    /// Of all surfaces, render space.
    const Bounds& bounds() const { return bounds_; }

private:
    struct TopEntry {
        std::uint32_t geometry = 0, instance = 0;
    };
    /// Stands for the structure of lights among the geomIDs of the top scene.
    static constexpr unsigned kLightShapesId = RTC_INVALID_GEOMETRY_ID - 1U;

    /// Ray i of a packet.
    template <class Rays>
    static LightShapeTree::Ray rayOf(const Rays& rays, int i) {
        return {{rays.org_x[i], rays.org_y[i], rays.org_z[i]},
                {rays.dir_x[i], rays.dir_y[i], rays.dir_z[i]},
                rays.tnear[i],
                rays.tfar[i]};
    }
    /// Rays meet the light shapes that are nearer than what they met.
    template <int N>
    void meetLightShapes(const int* valid, typename EmbreePacket<N>::RayHit& rays) const {
        for (int i = 0; i < N; ++i) {
            if (valid[i] == 0) {
                continue;
            }
            const LightShapeTree::Hit met = lightShapes_.intersect(rayOf(rays.ray, i));
            if (met.shape >= 0) {
                rays.ray.tfar[i] = met.t;
                rays.hit.geomID[i] = kLightShapesId;
                rays.hit.primID[i] = static_cast<unsigned>(met.shape);
                rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
            }
        }
    }

    void placeInstances(AccelGeometry& record) const;
    std::unique_ptr<AccelGeometry> build(const CommittedGeometry& committed,
                                         const StopCheck& shouldStop);
    void attach(std::uint32_t index);
    EmbreeScene newScene() const;
    void updateBounds();

    Diagnostics& diagnostics_;
    Diagnostics bindingMessages_; ///< of the last bindMaterials()
    EmbreeDevice device_;
    EmbreeScene top_;
    LightShapeTree lightShapes_;       ///< empty where they are loose
    std::vector<TopEntry> topEntries_; ///< by geomID of the top scene
    std::vector<std::unique_ptr<AccelGeometry>> geometries_;
    std::vector<EmissiveTriangleRef> emissive_;
    const LightSampler* lights_ = nullptr;
    std::uint32_t looseShapes_ = 0;
    Bounds bounds_;
    Double3 origin_{0.0};
    bool robust_ = true;
    bool mayCutOut_ = false;
    std::size_t triangles_ = 0, instances_ = 0, bindingCount_ = 0;
    AccelBuilds builds_;
};

} // namespace mbfeat
