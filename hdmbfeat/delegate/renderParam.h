// The bridge from Hydra prims to the renderer: owns the scene, the renderer and the messages.
#pragma once

#include "pxr/pxr.h"

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "delegate/fingerprint.h"
#include "delegate/settingsStack.h"
#include "film/renderer.h"
#include "pxr/imaging/hd/renderParam.h"
#include "scene/scene.h"

PXR_NAMESPACE_OPEN_SCOPE
class HdChangeTracker;
PXR_NAMESPACE_CLOSE_SCOPE

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class LightPrim;
class MeshPrim;
class RenderSettingsPrim;

/// Which prims a render pass wants to see.
struct VisibilityFilter {
    std::set<std::string> renderTags;      ///< empty: all
    std::vector<std::string> rootPaths;    ///< prims below any of these; empty: all
    std::vector<std::string> excludePaths; ///< except those below any of these

    bool operator==(const VisibilityFilter& o) const {
        return renderTags == o.renderTags && rootPaths == o.rootPaths &&
               excludePaths == o.excludePaths;
    }
    void addTo(Fingerprint& fingerprint) const;
    /// Whether a prim of that path and render tag is seen.
    bool accepts(const std::string& path, const std::string& renderTag) const;
};

/// One a delegate, given to every Sync. Threads: Hydra syncs meshes in parallel, so the members
/// that they use (acquireSceneForEdit, diagnostics, primvar names, the registries) take any thread;
/// the others belong to the application's thread.
class RenderParam final : public HdRenderParam {
public:
    RenderParam();
    ~RenderParam() override;

    bool IsValid() const override { return true; }

    /// The scene, after a running render has been stopped. Every edit asks anew.
    Scene& acquireSceneForEdit();
    /// Grows with every acquireSceneForEdit(): a render started before is out of date.
    std::uint64_t editVersion() const { return editVersion_; }

    Diagnostics& diagnostics() { return diagnostics_; }
    Renderer& renderer() { return renderer_; }
    const Renderer& renderer() const { return renderer_; }
    const Scene& scene() const { return scene_; }
    SettingsStack& settings() { return settings_; }
    const SettingsStack& settings() const { return settings_; }

    /// Starts a job; edits after this stop it.
    std::shared_ptr<const JobState> startRender(RenderJob job);
    void stopRender();

    /// Primvars that a material reads. True when it reads one that it did not read before.
    bool setMaterialPrimvars(const std::string& materialPath, std::set<std::string> names);
    void removeMaterial(const std::string& materialPath);
    /// Primvars that AOVs show. True when there is a new one.
    bool addAovPrimvars(const std::vector<std::string>& names);
    /// Primvars that a mesh with these materials must keep.
    std::set<std::string> primvarsFor(const std::vector<std::string>& materialPaths) const;
    /// Something newly reads a primvar: has the meshes synced again that must keep it.
    void markStaleMeshes(HdChangeTracker& tracker);
    /// After a sync: meshes that it did not reach fetch their primvars now. Marks do not reach the
    /// prims of scene indices, whose data can be read at any time; elsewhere there is nothing left.
    void refetchStaleMeshes();

    /// Rendering colour space of textures, by its OpenColorIO name.
    void setRenderingColorSpace(const std::string& name);

    void registerMesh(MeshPrim* mesh);
    void unregisterMesh(MeshPrim* mesh);
    /// Hides and shows meshes for a pass that sees other prims than the last one. This is no edit
    /// that makes renders of other passes out of date; none may run.
    void applyFilter(const VisibilityFilter& filter);
    VisibilityFilter filter() const;

    void registerLight(LightPrim* light);
    void unregisterLight(LightPrim* light);
    /// Shows or hides dome lights after the host's switch for it changed.
    void updateDomeVisibility();

    void registerSettingsPrim(RenderSettingsPrim* prim);
    void unregisterSettingsPrim(RenderSettingsPrim* prim);
    /// The active settings prim, or null.
    const RenderSettingsPrim* activeSettingsPrim() const;

    /// The host asked for no more rendering until it says otherwise.
    bool isStopped() const { return stopped_; }
    void setStopped(bool stopped) { stopped_ = stopped; }

    /// Numbers the jobs of all passes, from 1 on.
    std::uint64_t nextJobNumber() { return ++jobNumber_; }

    /// Counts a prim that was left out for bad data, for the statistics.
    void countSkippedPrim() { ++skippedPrims_; }
    int skippedPrims() const { return skippedPrims_; }

private:
    std::vector<MeshPrim*> meshes() const;

    Diagnostics diagnostics_;
    Scene scene_;
    Renderer renderer_;
    SettingsStack settings_;

    mutable std::mutex mutex_;
    std::atomic<bool> renderMayRun_{false};
    std::atomic<std::uint64_t> editVersion_{0};
    std::map<std::string, std::set<std::string>> materialPrimvars_;
    std::set<std::string> aovPrimvars_;
    std::set<MeshPrim*> meshes_;
    bool meshesMayBeStale_ = false;
    std::set<LightPrim*> lights_;
    std::vector<RenderSettingsPrim*> settingsPrims_;
    VisibilityFilter filter_;
    std::string renderingColorSpace_;
    bool stopped_ = false;
    std::uint64_t jobNumber_ = 0;
    std::atomic<int> skippedPrims_{0};
};

} // namespace mbfeat
