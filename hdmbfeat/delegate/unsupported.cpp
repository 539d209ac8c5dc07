#include "delegate/unsupported.h"

#include <algorithm>

#include "delegate/guard.h"
#include "delegate/renderParam.h"
#include "pxr/imaging/hd/changeTracker.h"
#include "pxr/imaging/hd/light.h"

namespace mbfeat {

namespace {

bool contains(const TfTokenVector& types, const TfToken& type) {
    return std::find(types.begin(), types.end(), type) != types.end();
}

} // namespace

const TfTokenVector& unsupportedRprimTypes() {
    static const TfTokenVector types{TfToken("basisCurves"), TfToken("nurbsCurves"),
                                     TfToken("points"), TfToken("volume")};
    return types;
}

const TfTokenVector& unsupportedSprimTypes() {
    static const TfTokenVector types{TfToken("light"), TfToken("meshLight"), TfToken("pluginLight"),
                                     TfToken("lightFilter")};
    return types;
}

bool isUnsupportedRprim(const TfToken& typeId) {
    return contains(unsupportedRprimTypes(), typeId);
}

bool isUnsupportedSprim(const TfToken& typeId) {
    return contains(unsupportedSprimTypes(), typeId);
}

UnsupportedRprim::UnsupportedRprim(const TfToken& typeId, const SdfPath& id, RenderParam& param)
    : HdRprim(id),
      type_(typeId.GetString()),
      param_(param),
      messages_(param.diagnostics()) {}

UnsupportedRprim::~UnsupportedRprim() {
    param_.acquireSceneForEdit(); // what it said is withdrawn, which a refused job waits for
}

HdDirtyBits UnsupportedRprim::GetInitialDirtyBitsMask() const {
    return HdChangeTracker::Clean | HdChangeTracker::InitRepr | HdChangeTracker::DirtyVisibility |
           HdChangeTracker::DirtyRepr | HdChangeTracker::DirtyRenderTag;
}

void UnsupportedRprim::Sync(HdSceneDelegate* delegate, HdRenderParam* /*renderParam*/,
                            HdDirtyBits* dirtyBits, const TfToken& /*reprToken*/) {
    guarded(messages_, GetId().GetString(), [&] {
        if ((*dirtyBits & HdChangeTracker::DirtyVisibility) == 0) {
            return;
        }
        _UpdateVisibility(delegate, dirtyBits);
        param_.acquireSceneForEdit(); // no job counts messages while they change
        messages_.withdraw();
        if (IsVisible()) {
            messages_.warn(GetId().GetString(), "prims of the type " + type_ +
                                                    " are not supported; it is not rendered. "
                                                    "Convert it to a mesh, or hide it.");
        }
    });
    *dirtyBits = HdChangeTracker::Clean; // all, see MeshPrim::Sync()
}

const TfTokenVector& UnsupportedRprim::GetBuiltinPrimvarNames() const {
    static const TfTokenVector none;
    return none;
}

void UnsupportedRprim::_InitRepr(const TfToken& reprToken, HdDirtyBits* /*dirtyBits*/) {
    const bool known = std::any_of(_reprs.begin(), _reprs.end(),
                                   [&](const auto& repr) { return repr.first == reprToken; });
    if (!known) {
        _reprs.emplace_back(reprToken, HdReprSharedPtr());
    }
}

UnsupportedSprim::UnsupportedSprim(const TfToken& typeId, const SdfPath& id, RenderParam& param)
    : HdSprim(id),
      type_(typeId.GetString()),
      param_(param),
      messages_(param.diagnostics()) {}

UnsupportedSprim::~UnsupportedSprim() {
    param_.acquireSceneForEdit();
}

HdDirtyBits UnsupportedSprim::GetInitialDirtyBitsMask() const {
    return HdLight::AllDirty;
}

void UnsupportedSprim::Sync(HdSceneDelegate* delegate, HdRenderParam* /*renderParam*/,
                            HdDirtyBits* dirtyBits) {
    guarded(messages_, GetId().GetString(), [&] {
        param_.acquireSceneForEdit(); // no job counts messages while they change
        messages_.withdraw();
        const bool isFilter = type_ == "lightFilter"; // the lights that use it say so
        if (!isFilter && delegate->GetVisible(GetId())) {
            messages_.warn(GetId().GetString(),
                           "its type of light (" + type_ +
                               " to Hydra) is not supported; it gives no light. Use a rect, disk, "
                               "sphere, cylinder, distant or dome light, or an emissive material.");
        }
    });
    *dirtyBits = HdLight::Clean;
}

} // namespace mbfeat
