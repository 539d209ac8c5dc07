#include "delegate/renderDelegate.h"

#include <optional>

#include "delegate/descriptors.h"
#include "delegate/guard.h"
#include "delegate/instancer.h"
#include "delegate/light.h"
#include "delegate/material.h"
#include "delegate/mesh.h"
#include "delegate/renderBuffer.h"
#include "delegate/renderPass.h"
#include "delegate/renderSettings.h"
#include "delegate/tokens.h"
#include "delegate/unsupported.h"
#include "pxr/imaging/hd/camera.h"
#include "pxr/imaging/hd/extComputation.h"

namespace mbfeat {

namespace {

std::optional<LightType> lightTypeOf(const TfToken& typeId) {
    const Tokens& t = tokens();
    if (typeId == t.rectLight) {
        return LightType::kRect;
    }
    if (typeId == t.diskLight) {
        return LightType::kDisk;
    }
    if (typeId == t.sphereLight) {
        return LightType::kSphere;
    }
    if (typeId == t.cylinderLight) {
        return LightType::kCylinder;
    }
    if (typeId == t.distantLight) {
        return LightType::kDistant;
    }
    if (typeId == t.domeLight) {
        return LightType::kDome;
    }
    return std::nullopt;
}

TfTokenVector joined(TfTokenVector types, const TfTokenVector& more) {
    types.insert(types.end(), more.begin(), more.end());
    return types;
}

} // namespace

RenderDelegate::RenderDelegate(const HdRenderSettingsMap& settings)
    : HdRenderDelegate(settings),
      param_(std::make_unique<RenderParam>()),
      registry_(std::make_shared<HdResourceRegistry>()) {
    for (const auto& [key, value] : settings) {
        param_->settings().setFromHost(key, value);
    }
    _PopulateDefaultSettings(settingDescriptors());
}

RenderDelegate::~RenderDelegate() {
    param_->stopRender();
}

const TfTokenVector& RenderDelegate::GetSupportedRprimTypes() const {
    static const TfTokenVector types = joined({tokens().mesh}, unsupportedRprimTypes());
    return types;
}

const TfTokenVector& RenderDelegate::GetSupportedSprimTypes() const {
    const Tokens& t = tokens();
    static const TfTokenVector types =
        joined({t.camera, t.material, t.extComputation, t.rectLight, t.diskLight, t.sphereLight,
                t.cylinderLight, t.distantLight, t.domeLight},
               unsupportedSprimTypes());
    return types;
}

const TfTokenVector& RenderDelegate::GetSupportedBprimTypes() const {
    static const TfTokenVector types{tokens().renderBuffer, tokens().renderSettings};
    return types;
}

void RenderDelegate::SetRenderSetting(const TfToken& key, const VtValue& value) {
    HdRenderDelegate::SetRenderSetting(key, value);
    guarded(param_->diagnostics(), key.GetString(), [&] {
        param_->settings().setFromHost(key, value);
        if (key == tokens().domeLightCameraVisibility) {
            param_->updateDomeVisibility();
        }
    });
}

HdRenderSettingDescriptorList RenderDelegate::GetRenderSettingDescriptors() const {
    return settingDescriptors();
}

VtDictionary RenderDelegate::GetRenderStats() const {
    return renderStatistics(*param_);
}

bool RenderDelegate::IsPaused() const {
    return param_->renderer().isPaused();
}

bool RenderDelegate::Pause() {
    param_->renderer().pause();
    return true;
}

bool RenderDelegate::Resume() {
    param_->renderer().resume();
    return true;
}

bool RenderDelegate::IsStopped() const {
    return param_->isStopped();
}

bool RenderDelegate::Stop(bool /*blocking*/) {
    param_->setStopped(true);
    param_->stopRender();
    return true;
}

bool RenderDelegate::Restart() {
    param_->setStopped(false);
    param_->renderer().resume();
    param_->acquireSceneForEdit(); // as if something had changed: the next pass starts anew
    return true;
}

HdRenderPassSharedPtr RenderDelegate::CreateRenderPass(HdRenderIndex* index,
                                                       const HdRprimCollection& collection) {
    return std::make_shared<RenderPass>(index, collection, *param_);
}

HdInstancer* RenderDelegate::CreateInstancer(HdSceneDelegate* delegate, const SdfPath& id) {
    return std::make_unique<InstancerPrim>(delegate, id).release();
}

void RenderDelegate::DestroyInstancer(HdInstancer* instancer) {
    const std::unique_ptr<HdInstancer> owned(instancer);
}

HdRprim* RenderDelegate::CreateRprim(const TfToken& typeId, const SdfPath& rprimId) {
    if (typeId == tokens().mesh) {
        return std::make_unique<MeshPrim>(rprimId, *param_).release();
    }
    if (isUnsupportedRprim(typeId)) {
        return std::make_unique<UnsupportedRprim>(typeId, rprimId, *param_).release();
    }
    return nullptr;
}

void RenderDelegate::DestroyRprim(HdRprim* rprim) {
    const std::unique_ptr<HdRprim> owned(rprim);
}

HdSprim* RenderDelegate::CreateSprim(const TfToken& typeId, const SdfPath& sprimId) {
    if (typeId == tokens().camera) {
        return std::make_unique<HdCamera>(sprimId).release();
    }
    if (typeId == tokens().material) {
        return std::make_unique<MaterialPrim>(sprimId, *param_).release();
    }
    if (typeId == tokens().extComputation) {
        return std::make_unique<HdExtComputation>(sprimId).release();
    }
    if (const std::optional<LightType> light = lightTypeOf(typeId)) {
        return std::make_unique<LightPrim>(sprimId, *light, *param_).release();
    }
    if (isUnsupportedSprim(typeId)) {
        return std::make_unique<UnsupportedSprim>(typeId, sprimId, *param_).release();
    }
    return nullptr;
}

HdSprim* RenderDelegate::CreateFallbackSprim(const TfToken& typeId) {
    return CreateSprim(typeId, SdfPath::EmptyPath());
}

void RenderDelegate::DestroySprim(HdSprim* sprim) {
    const std::unique_ptr<HdSprim> owned(sprim);
}

HdBprim* RenderDelegate::CreateBprim(const TfToken& typeId, const SdfPath& bprimId) {
    if (typeId == tokens().renderBuffer) {
        return std::make_unique<RenderBuffer>(bprimId, param_->diagnostics()).release();
    }
    if (typeId == tokens().renderSettings) {
        return std::make_unique<RenderSettingsPrim>(bprimId, *param_).release();
    }
    return nullptr;
}

HdBprim* RenderDelegate::CreateFallbackBprim(const TfToken& typeId) {
    // A settings prim without a scene would count as one of the stage's.
    return typeId == tokens().renderBuffer ? CreateBprim(typeId, SdfPath::EmptyPath()) : nullptr;
}

void RenderDelegate::DestroyBprim(HdBprim* bprim) {
    const std::unique_ptr<HdBprim> owned(bprim);
}

void RenderDelegate::CommitResources(HdChangeTracker* /*tracker*/) {
    guarded(param_->diagnostics(), "meshes", [&] { param_->refetchStaleMeshes(); });
}

TfToken RenderDelegate::GetMaterialBindingPurpose() const {
    static const TfToken full("full");
    return full;
}

TfTokenVector RenderDelegate::GetMaterialRenderContexts() const {
    // MaterialX first: OpenUSD stops at the first context that has an output, connected or not,
    // and materials from .mtlx files have an unconnected universal one.
    return {tokens().mtlx, tokens().universal};
}

TfTokenVector RenderDelegate::GetRenderSettingsNamespaces() const {
    // `driver` holds the layer names and formats of render vars (driver:parameters:aov:*).
    return {TfToken("mbfeat"), TfToken("driver")};
}

HdAovDescriptor RenderDelegate::GetDefaultAovDescriptor(const TfToken& name) const {
    return aovDescriptor(name);
}

HdCommandDescriptors RenderDelegate::GetCommandDescriptors() const {
    HdCommandDescriptors commands;
    commands.emplace_back(TfToken("restart"), "Start the image anew.");
    commands.emplace_back(
        TfToken("dumpScene"), "Write the translated scene as text.",
        HdCommandArgDescriptors{HdCommandArgDescriptor(TfToken("file"), VtValue(std::string()))});
    return commands;
}

bool RenderDelegate::InvokeCommand(const TfToken& command, const HdCommandArgs& args) {
    if (command == "restart") {
        return Restart();
    }
    if (command == "dumpScene") {
        bool written = false;
        guarded(param_->diagnostics(), "dumpScene",
                [&] { written = writeSceneDump(*param_, args); });
        return written;
    }
    Diagnostics(param_->diagnostics()) // no fault of any image: it stands for this call only
        .error(command.GetString(), "there is no such command; nothing is done. restart and "
                                    "dumpScene are.");
    return false;
}

} // namespace mbfeat
