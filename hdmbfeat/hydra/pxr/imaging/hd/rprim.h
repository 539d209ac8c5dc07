#pragma once

#include "pxr/base/gf/bbox3d.h"
#include "pxr/base/gf/range3d.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/enums.h"
#include "pxr/imaging/hd/repr.h"
#include "pxr/imaging/hd/rprimSharedData.h"
#include "pxr/imaging/hd/sceneDelegate.h"
#include "pxr/imaging/hd/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <cstdint>
#include <utility>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

class HdChangeTracker;
class HdRenderParam;

/// A prim that can be seen. Sync runs in parallel for different prims.
class HdRprim {
public:
    explicit HdRprim(const SdfPath& id);
    virtual ~HdRprim();

    virtual HdDirtyBits GetInitialDirtyBitsMask() const = 0;

    bool CanSkipDirtyBitPropagationAndSync(HdDirtyBits bits) const;
    HdDirtyBits PropagateRprimDirtyBits(HdDirtyBits bits);
    void InitRepr(HdSceneDelegate* delegate, const TfToken& reprToken, HdDirtyBits* dirtyBits);

    /// Pulls what dirtyBits names from the scene; the implementation clears the bits that it
    /// handled.
    virtual void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam, HdDirtyBits* dirtyBits,
                      const TfToken& reprToken) = 0;
    virtual void Finalize(HdRenderParam* renderParam);

    const SdfPath& GetId() const { return _sharedData.rprimID; }
    int32_t GetPrimId() const { return _primId; }
    void SetPrimId(int32_t primId);
    const SdfPath& GetInstancerId() const { return _instancerId; }
    const SdfPath& GetMaterialId() const { return _materialId; }
    void SetMaterialId(const SdfPath& materialId);
    const HdReprSelector& GetReprSelector() const { return _authoredReprSelector; }
    const TfToken& GetRenderTag() const { return _renderTag; }
    bool IsVisible() const { return _sharedData.visible; }

    TfToken GetRenderTag(HdSceneDelegate* delegate) const {
        return delegate->GetRenderTag(GetId());
    }
    GfRange3d GetExtent(HdSceneDelegate* delegate) const { return delegate->GetExtent(GetId()); }
    HdPrimvarDescriptorVector GetPrimvarDescriptors(HdSceneDelegate* delegate,
                                                    HdInterpolation interpolation) const {
        return delegate->GetPrimvarDescriptors(GetId(), interpolation);
    }
    VtValue GetPrimvar(HdSceneDelegate* delegate, const TfToken& name) const {
        return delegate->Get(GetId(), name);
    }
    VtValue GetIndexedPrimvar(HdSceneDelegate* delegate, const TfToken& name,
                              VtIntArray* indices) const {
        return delegate->GetIndexedPrimvar(GetId(), name, indices);
    }

    virtual const TfTokenVector& GetBuiltinPrimvarNames() const = 0;
    VtMatrix4dArray GetInstancerTransforms(HdSceneDelegate* delegate);
    bool IsDirty(HdChangeTracker& changeTracker) const;
    void UpdateReprSelector(HdSceneDelegate* delegate, HdDirtyBits* dirtyBits);
    virtual void UpdateRenderTag(HdSceneDelegate* delegate, HdRenderParam* renderParam);

protected:
    using _ReprVector = std::vector<std::pair<TfToken, HdReprSharedPtr>>;

    virtual HdDirtyBits _PropagateDirtyBits(HdDirtyBits bits) const = 0;
    virtual void _InitRepr(const TfToken& reprToken, HdDirtyBits* dirtyBits) = 0;

    void _UpdateVisibility(HdSceneDelegate* delegate, HdDirtyBits* dirtyBits);
    /// Takes the instancer's path from the scene where the bits say so; call it early in Sync.
    void _UpdateInstancer(HdSceneDelegate* delegate, HdDirtyBits* dirtyBits);

private:
    SdfPath _instancerId;
    SdfPath _materialId;
    int32_t _primId;

protected:
    HdRprimSharedData _sharedData;
    HdReprSelector _authoredReprSelector;
    TfToken _renderTag;
    _ReprVector _reprs;
};
HYDRA_INTERFACE_SIZE(HdRprim, 464, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
