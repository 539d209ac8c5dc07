// Materials: from Hydra's shading networks to the scene's materials.
#pragma once

#include "pxr/pxr.h"

#include "pxr/imaging/hd/material.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class MaterialPrim final : public HdMaterial {
public:
    explicit MaterialPrim(const SdfPath& id);
    ~MaterialPrim() override;

    HdDirtyBits GetInitialDirtyBitsMask() const override { return AllDirty; }
    void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;
    void Finalize(HdRenderParam* renderParam) override;
};

} // namespace mbfeat
