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
#include <set>
#include <string>
#include <vector>

#include "core/diagnostics.h"
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
    bool instanced = false;             ///< keep one BVH for all transforms
    std::vector<std::int32_t> instanceIds;  ///< instanceId AOV of each transform; empty: index
    std::int32_t primId = -1;
    /// Material prim path of each slot of Mesh::triangleMaterials; "" is the default material.
    std::vector<std::string> materials{std::string()};
    bool visible = true;
};

/// A committed geometry with its materials resolved.
struct CommittedGeometry {
    std::shared_ptr<const Geometry> source;
    std::vector<std::uint32_t> materials;  ///< index into Scene::materials() of each slot
    bool meshChanged = true;  ///< mesh, or transforms of a plain prim, differ from the last commit
};

/// What changed since the last commit, so that consumers rebuild only that.
struct SceneChanges {
    bool geometry = false;   ///< some mesh, transform, visibility or set of prims
    bool materials = false;
    bool lights = false;
};

class Scene {
public:
    explicit Scene(Diagnostics& diagnostics);
    ~Scene();
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    void setGeometry(Geometry geometry);
    void removeGeometry(const std::string& path);
    void setMaterial(Material material);
    void removeMaterial(const std::string& path);
    void setLight(Light light);
    void removeLight(const std::string& path);
    /// OpenColorIO name of the rendering space; see TextureCache.
    void setRenderingColorSpace(const std::string& name);

    /// Resolves materials and textures and computes the origin. Returns what changed.
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
    void updateOrigin();

    Diagnostics& diagnostics_;
    TextureCache textures_;
    mutable std::mutex mutex_;
    std::uint64_t version_ = 0;
    std::map<std::string, std::shared_ptr<const Geometry>> geometryByPath_;
    std::map<std::string, std::shared_ptr<const Material>> materialByPath_;
    std::map<std::string, std::shared_ptr<const Light>> lightByPath_;
    std::set<std::string> changedGeometry_;
    SceneChanges pending_;

    std::vector<CommittedGeometry> geometries_;
    std::vector<std::shared_ptr<const Material>> materials_;
    std::vector<std::shared_ptr<const Light>> lights_;
    Double3 origin_{0.0, 0.0, 0.0};
};

}  // namespace mbfeat
