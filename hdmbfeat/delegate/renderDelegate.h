// Hydra's face of the renderer: makes its prims, describes its settings and AOVs, reports on it.
#pragma once

#include "pxr/pxr.h"

#include <memory>

#include "delegate/renderParam.h"
#include "pxr/imaging/hd/renderDelegate.h"
#include "pxr/imaging/hd/resourceRegistry.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// Any number may live at once; each has a scene and render threads of its own.
class RenderDelegate final : public HdRenderDelegate {
public:
    explicit RenderDelegate(const HdRenderSettingsMap& settings);
    ~RenderDelegate() override;

    const TfTokenVector& GetSupportedRprimTypes() const override;
    const TfTokenVector& GetSupportedSprimTypes() const override;
    const TfTokenVector& GetSupportedBprimTypes() const override;

    HdRenderParam* GetRenderParam() const override { return param_.get(); }
    HdResourceRegistrySharedPtr GetResourceRegistry() const override { return registry_; }

    void SetRenderSetting(const TfToken& key, const VtValue& value) override;
    HdRenderSettingDescriptorList GetRenderSettingDescriptors() const override;
    VtDictionary GetRenderStats() const override;

    bool IsPauseSupported() const override { return true; }
    bool IsPaused() const override;
    bool Pause() override;
    bool Resume() override;
    bool IsStopSupported() const override { return true; }
    bool IsStopped() const override;
    bool Stop(bool blocking) override;
    bool Restart() override;

    HdRenderPassSharedPtr CreateRenderPass(HdRenderIndex* index,
                                           const HdRprimCollection& collection) override;
    HdInstancer* CreateInstancer(HdSceneDelegate* delegate, const SdfPath& id) override;
    void DestroyInstancer(HdInstancer* instancer) override;
    HdRprim* CreateRprim(const TfToken& typeId, const SdfPath& rprimId) override;
    void DestroyRprim(HdRprim* rprim) override;
    HdSprim* CreateSprim(const TfToken& typeId, const SdfPath& sprimId) override;
    HdSprim* CreateFallbackSprim(const TfToken& typeId) override;
    void DestroySprim(HdSprim* sprim) override;
    HdBprim* CreateBprim(const TfToken& typeId, const SdfPath& bprimId) override;
    HdBprim* CreateFallbackBprim(const TfToken& typeId) override;
    void DestroyBprim(HdBprim* bprim) override;
    void CommitResources(HdChangeTracker* tracker) override;

    TfToken GetMaterialBindingPurpose() const override;
    TfTokenVector GetMaterialRenderContexts() const override;
    TfTokenVector GetRenderSettingsNamespaces() const override;
    HdAovDescriptor GetDefaultAovDescriptor(const TfToken& name) const override;

    /// "restart" starts the image anew; "dumpScene" writes the translated scene as text to the
    /// argument `file`.
    HdCommandDescriptors GetCommandDescriptors() const override;
    bool InvokeCommand(const TfToken& command, const HdCommandArgs& args) override;

private:
    std::unique_ptr<RenderParam> param_;
    HdResourceRegistrySharedPtr registry_;
};

} // namespace mbfeat
