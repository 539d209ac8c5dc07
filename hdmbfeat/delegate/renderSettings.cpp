#include "delegate/renderSettings.h"

#include <string>
#include <vector>

#include "delegate/guard.h"
#include "delegate/products.h"
#include "delegate/renderParam.h"
#include "pxr/imaging/hd/renderIndex.h"
#include "pxr/imaging/hd/sceneDelegate.h"

namespace mbfeat {

RenderSettingsPrim::RenderSettingsPrim(const SdfPath& id, RenderParam& param)
    : HdRenderSettings(id),
      param_(param) {
    param_.registerSettingsPrim(this);
}

RenderSettingsPrim::~RenderSettingsPrim() {
    param_.unregisterSettingsPrim(this);
}

void RenderSettingsPrim::_Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* /*renderParam*/,
                               const HdDirtyBits* /*dirtyBits*/) {
    guarded(param_.diagnostics(), GetId().GetString(), [&] {
        ++version_;
        // Meshes sync after settings prims, so that they keep what the products show.
        if (param_.addAovPrimvars(primvarsOfProducts(GetRenderProducts()))) {
            param_.markStaleMeshes(sceneDelegate->GetRenderIndex().GetChangeTracker());
        }
    });
}

} // namespace mbfeat
