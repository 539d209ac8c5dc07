// Materials: from Hydra's shading networks to the scene's materials.
#pragma once

#include "pxr/pxr.h"

#include "core/diagnostics.h"
#include "pxr/imaging/hd/material.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class RenderParam;

class MaterialPrim final : public HdMaterial {
public:
    MaterialPrim(const SdfPath& id, RenderParam& param);
    ~MaterialPrim() override;

    HdDirtyBits GetInitialDirtyBitsMask() const override { return AllDirty; }
    void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;
    void Finalize(HdRenderParam* renderParam) override;

private:
    Diagnostics messages_; ///< of the last sync
};

} // namespace mbfeat
