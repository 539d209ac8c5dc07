// The render settings prim of a stage, with its products.
#pragma once

#include "pxr/pxr.h"

#include "pxr/imaging/hd/renderSettings.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class RenderParam;

/// Hydra keeps the prim's data; the render pass asks for it when it starts a render.
class RenderSettingsPrim final : public HdRenderSettings {
public:
    RenderSettingsPrim(const SdfPath& id, RenderParam& param);
    ~RenderSettingsPrim() override;

    /// Grows with every change of the prim.
    unsigned int version() const { return version_; }

protected:
    void _Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
               const HdDirtyBits* dirtyBits) override;

private:
    RenderParam& param_;
    unsigned int version_ = 0;
};

} // namespace mbfeat
