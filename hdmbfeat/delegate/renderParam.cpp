#include "delegate/renderParam.h"

#include <algorithm>

#include "delegate/light.h"
#include "delegate/mesh.h"
#include "delegate/renderSettings.h"
#include "delegate/tokens.h"
#include "film/host.h"
#include "pxr/base/tf/diagnostic.h"
#include "pxr/imaging/hd/changeTracker.h"

namespace mbfeat {

namespace {

// Errors are warnings to Tf: a Tf error becomes an exception in a Python host, which would then
// lose an image that was rendered all the same. Hosts learn of errors from the render report.
void emitDiagnostic(const Message& message) {
    if (Host::instance().deliver(message)) {
        return;
    }
    const std::string text =
        message.subject.empty() ? message.text : message.subject + ": " + message.text;
    if (message.severity == Severity::kInfo) {
        TF_STATUS("%s", text.c_str());
    } else {
        TF_WARN("%s", text.c_str());
    }
}

bool isBelow(const std::string& path, const std::string& root) {
    if (root == "/" || path == root) {
        return true;
    }
    return path.size() > root.size() && path.compare(0, root.size(), root) == 0 &&
           path[root.size()] == '/';
}

bool isBelowAny(const std::string& path, const std::vector<std::string>& roots) {
    return std::any_of(roots.begin(), roots.end(),
                       [&](const std::string& root) { return isBelow(path, root); });
}

} // namespace

bool VisibilityFilter::accepts(const std::string& path, const std::string& renderTag) const {
    const bool tagged = renderTags.empty() || renderTags.count(renderTag) != 0;
    const bool rooted = rootPaths.empty() || isBelowAny(path, rootPaths);
    return tagged && rooted && !isBelowAny(path, excludePaths);
}

void VisibilityFilter::addTo(Fingerprint& fingerprint) const {
    fingerprint.add(renderTags.size());
    for (const std::string& tag : renderTags) {
        fingerprint.add(tag);
    }
    for (const std::vector<std::string>* const paths : {&rootPaths, &excludePaths}) {
        fingerprint.add(paths->size());
        for (const std::string& path : *paths) {
            fingerprint.add(path);
        }
    }
}

RenderParam::RenderParam() : scene_(diagnostics_), renderer_(scene_), settings_(diagnostics_) {
    diagnostics_.setHandler(emitDiagnostic);
}

RenderParam::~RenderParam() {
    renderer_.stop();
}

Scene& RenderParam::acquireSceneForEdit() {
    ++editVersion_;
    if (renderMayRun_) {
        const std::lock_guard lock(mutex_);
        if (renderMayRun_) {
            renderer_.stop();
            renderMayRun_ = false;
        }
    }
    return scene_;
}

std::shared_ptr<const JobState> RenderParam::startRender(RenderJob job) {
    const std::lock_guard lock(mutex_);
    renderMayRun_ = true;
    return renderer_.start(std::move(job));
}

void RenderParam::stopRender() {
    const std::lock_guard lock(mutex_);
    renderer_.stop();
    renderMayRun_ = false;
}

bool RenderParam::setMaterialPrimvars(const std::string& materialPath,
                                      std::set<std::string> names) {
    const std::lock_guard lock(mutex_);
    std::set<std::string>& known = materialPrimvars_[materialPath];
    const bool isNew = !std::includes(known.begin(), known.end(), names.begin(), names.end());
    known = std::move(names);
    return isNew;
}

void RenderParam::removeMaterial(const std::string& materialPath) {
    const std::lock_guard lock(mutex_);
    materialPrimvars_.erase(materialPath);
}

bool RenderParam::addAovPrimvars(const std::vector<std::string>& names) {
    const std::lock_guard lock(mutex_);
    const std::size_t before = aovPrimvars_.size();
    aovPrimvars_.insert(names.begin(), names.end());
    return aovPrimvars_.size() != before;
}

std::set<std::string>
RenderParam::primvarsFor(const std::vector<std::string>& materialPaths) const {
    const std::lock_guard lock(mutex_);
    std::set<std::string> names = aovPrimvars_;
    // What the default material shows, and materials that turn out unusable fall back to.
    names.insert(tokens().displayColor.GetString());
    names.insert(tokens().displayOpacity.GetString());
    for (const std::string& path : materialPaths) {
        const auto found = materialPrimvars_.find(path);
        if (found != materialPrimvars_.end()) {
            names.insert(found->second.begin(), found->second.end());
        }
    }
    return names;
}

std::vector<MeshPrim*> RenderParam::meshes() const {
    const std::lock_guard lock(mutex_);
    return {meshes_.begin(), meshes_.end()};
}

void RenderParam::markStaleMeshes(HdChangeTracker& tracker) {
    meshesMayBeStale_ = true;
    for (const MeshPrim* const mesh : meshes()) {
        if (mesh->lacksPrimvars()) {
            tracker.MarkRprimDirty(mesh->GetId(), HdChangeTracker::DirtyPrimvar);
        }
    }
}

void RenderParam::refetchStaleMeshes() {
    if (!meshesMayBeStale_) {
        return;
    }
    meshesMayBeStale_ = false;
    for (MeshPrim* const mesh : meshes()) {
        if (mesh->lacksPrimvars()) {
            mesh->refetch();
        }
    }
}

void RenderParam::setRenderingColorSpace(const std::string& name) {
    if (name != renderingColorSpace_) {
        renderingColorSpace_ = name;
        acquireSceneForEdit().setRenderingColorSpace(name);
    }
}

void RenderParam::registerMesh(MeshPrim* mesh) {
    const std::lock_guard lock(mutex_);
    meshes_.insert(mesh);
}

void RenderParam::unregisterMesh(MeshPrim* mesh) {
    const std::lock_guard lock(mutex_);
    meshes_.erase(mesh);
}

void RenderParam::applyFilter(const VisibilityFilter& filter) {
    {
        const std::lock_guard lock(mutex_);
        if (filter == filter_) {
            return;
        }
        filter_ = filter;
    }
    const std::uint64_t version = editVersion_;
    for (MeshPrim* const mesh : meshes()) {
        mesh->updateFilter(*this);
    }
    editVersion_ = version;
}

VisibilityFilter RenderParam::filter() const {
    const std::lock_guard lock(mutex_);
    return filter_;
}

void RenderParam::registerLight(LightPrim* light) {
    const std::lock_guard lock(mutex_);
    lights_.insert(light);
}

void RenderParam::unregisterLight(LightPrim* light) {
    const std::lock_guard lock(mutex_);
    lights_.erase(light);
}

void RenderParam::updateDomeVisibility() {
    std::vector<LightPrim*> lights;
    {
        const std::lock_guard lock(mutex_);
        lights.assign(lights_.begin(), lights_.end());
    }
    for (LightPrim* const light : lights) {
        light->updateDomeVisibility();
    }
}

void RenderParam::registerSettingsPrim(RenderSettingsPrim* prim) {
    const std::lock_guard lock(mutex_);
    settingsPrims_.push_back(prim);
}

void RenderParam::unregisterSettingsPrim(RenderSettingsPrim* prim) {
    const std::lock_guard lock(mutex_);
    settingsPrims_.erase(std::remove(settingsPrims_.begin(), settingsPrims_.end(), prim),
                         settingsPrims_.end());
}

const RenderSettingsPrim* RenderParam::activeSettingsPrim() const {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(settingsPrims_.begin(), settingsPrims_.end(),
                                    [](const RenderSettingsPrim* p) { return p->IsActive(); });
    return found == settingsPrims_.end() ? nullptr : *found;
}

} // namespace mbfeat
