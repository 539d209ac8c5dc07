// Lights: from UsdLux parameters to the scene's lights.
#pragma once

#include "pxr/pxr.h"

#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "pxr/imaging/hd/light.h"
#include "scene/light.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class RenderParam;

class LightPrim final : public HdLight {
public:
    LightPrim(const SdfPath& id, LightType type, RenderParam& param);
    ~LightPrim() override;

    HdDirtyBits GetInitialDirtyBitsMask() const override { return AllDirty; }
    void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;
    void Finalize(HdRenderParam* renderParam) override;

    /// Shows or hides a dome after the host's switch for it changed.
    void updateDomeVisibility();

private:
    void syncPrim(HdSceneDelegate* delegate, HdDirtyBits* dirtyBits);
    std::vector<AffineD> computeTransforms(HdSceneDelegate* delegate) const;
    bool isVisibleToCamera() const;
    void removePublished();

    LightType type_;
    RenderParam& param_;
    Diagnostics messages_;         ///< of the last sync
    std::vector<Light> published_; ///< as the scene has them: one, or one an instance
};

} // namespace mbfeat
