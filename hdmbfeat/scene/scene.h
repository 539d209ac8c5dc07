// The scene: everything that rays can meet, as plain data keyed by prim path.
//
// Threads: set*/remove* may be called from several threads at once (Hydra syncs prims in
// parallel), but never while a render of this scene runs: the owner stops it first. commit() is
// called by one thread, after which the committed views are constant until the next edit.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/diagnostics.h"
#include "core/effects.h"
#include "scene/light.h"
#include "scene/material.h"
#include "scene/mesh.h"

namespace mbfeat {

/// One renderable prim: a mesh and where it stands.
struct Geometry {
    std::string path;
    std::shared_ptr<const Mesh> mesh;
    /// Object to world. One entry for a plain prim; one an instance for a prototype.
    std::vector<AffineD> transforms;
    bool instanced = false;                ///< keep one BVH for all transforms
    std::vector<std::int32_t> instanceIds; ///< instanceId AOV of each transform; empty: index
    std::int32_t primId = -1;
    /// Material prim path of each slot of Mesh::triangleMaterials; "" is the default material.
    std::vector<std::string> materials{std::string()};
    bool visible = true;
};

/// A committed geometry with its materials resolved.
struct CommittedGeometry {
    std::shared_ptr<const Geometry> source;
    std::vector<std::uint32_t> materials; ///< index into Scene::materials() of each slot
    bool meshChanged = true; ///< mesh, or transforms of a plain prim, differ from the last commit
};

/// What changed since the last commit, so that consumers rebuild only that.
struct SceneChanges {
    bool geometry = false; ///< some mesh, transform, visibility or set of prims
    bool materials = false;
    bool lights = false;
};

class Scene {
public:
    explicit Scene(Diagnostics& diagnostics);
    ~Scene();
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    /// Adds or replaces. Transforms that cannot be used (not finite, not invertible) are dropped
    /// with a message to `messages`; the others keep their instance ids.
    void setGeometry(Geometry geometry, Diagnostics& messages);
    void setGeometry(Geometry geometry) { setGeometry(std::move(geometry), diagnostics_); }
    void removeGeometry(const std::string& path);
    void setMaterial(Material material);
    void removeMaterial(const std::string& path);
    /// Adds or replaces. A light whose transform or radiance cannot be used is off, with a message
    /// to `messages`.
    void setLight(Light light, Diagnostics& messages);
    void setLight(Light light) { setLight(std::move(light), diagnostics_); }
    void removeLight(const std::string& path);
    /// OpenColorIO name of the rendering space; see TextureCache.
    void setRenderingColorSpace(const std::string& name);

    /// Takes effects away from materials and lights: what stands in their place is in
    /// effectTable().
    void takeEffects(EffectSet taken);

    /// Resolves materials and textures and computes the origin. Returns what changed. Committed are
    /// visible geometries with triangles, the materials bound to them, and the lights; only their
    /// textures are loaded, in parallel. A material that does not exist is reported and replaced
    /// by the default one.
    SceneChanges commit();

    /// Grows with every edit: a renderer compares it to know that a commit is due.
    std::uint64_t version() const;

    // Valid after commit(), until the next edit. Ordered by prim path, so ids are stable.
    const std::vector<CommittedGeometry>& geometries() const { return geometries_; }
    /// materials()[0] is the default material (UsdPreviewSurface defaults, diffuseColor from the
    /// displayColor primvar).
    const std::vector<std::shared_ptr<const Material>>& materials() const { return materials_; }
    const std::vector<std::shared_ptr<const Light>>& lights() const { return lights_; }

    /// World-space point that render coordinates are relative to: the centre of the bounds,
    /// snapped to a power-of-two grid, so that it stays put under small edits.
    const Double3& origin() const { return origin_; }

    TextureCache& textures() { return textures_; }
    Diagnostics& diagnostics() { return diagnostics_; }

private:
    struct Box {
        Double3 lower, upper;
    };
    /// A committed material or light with what it was made from, to be reused while that is the
    /// same.
    template <class T>
    struct Resolved {
        std::shared_ptr<const T> source, resolved;
    };
    using Images = std::map<ImageKey, std::shared_ptr<const Image>>;

    std::vector<CommittedGeometry> gatherGeometries() const;
    std::vector<std::string> bindMaterials(std::vector<CommittedGeometry>& geometries);
    Images loadImages(const std::vector<std::string>& materialPaths);
    void resolveMaterials(const std::vector<std::string>& paths, const Images& images);
    void resolveLights(const Images& images);
    void releaseUnusedImages();
    const Box& boundsOf(const std::shared_ptr<const Mesh>& mesh);
    bool updateOrigin();

    Diagnostics& diagnostics_;
    Diagnostics bindingMessages_; ///< of the last commit
    TextureCache textures_;
    std::string renderingSpace_;
    EffectSet taken_;
    mutable std::mutex mutex_; ///< guards everything below
    std::uint64_t version_ = 0;
    std::uint64_t committedVersion_ = 0;
    std::map<std::string, std::shared_ptr<const Geometry>> geometryByPath_;
    std::map<std::string, std::shared_ptr<const Material>> materialByPath_;
    std::map<std::string, std::shared_ptr<const Light>> lightByPath_;
    std::map<std::string, Resolved<Material>> resolvedMaterials_;
    std::map<std::string, Resolved<Light>> resolvedLights_;
    std::map<std::weak_ptr<const Mesh>, Box, std::owner_less<>> meshBounds_;

    std::vector<CommittedGeometry> geometries_;
    std::vector<std::shared_ptr<const Material>> materials_;
    std::vector<std::shared_ptr<const Light>> lights_;
    Double3 origin_{0.0, 0.0, 0.0};
};

} // namespace mbfeat
