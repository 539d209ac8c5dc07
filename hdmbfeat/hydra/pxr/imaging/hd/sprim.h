#pragma once

#include "pxr/imaging/hd/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

HYDRA_INTERFACE_OPEN_SCOPE

class HdRenderParam;
class HdSceneDelegate;

/// A prim that holds state for the scene: a camera, a light, a material, a computation.
/// Sync of one type's prims runs one after another unless the delegate enables parallel sync.
class HdSprim {
public:
    explicit HdSprim(const SdfPath& id);
    virtual ~HdSprim();

    const SdfPath& GetId() const { return _id; }

    /// Pulls what dirtyBits names from the scene; the implementation clears the bits that it
    /// handled.
    virtual void Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
                      HdDirtyBits* dirtyBits) = 0;
    /// Called once, before the prim is destroyed.
    virtual void Finalize(HdRenderParam* renderParam);
    virtual HdDirtyBits GetInitialDirtyBitsMask() const = 0;

private:
    SdfPath _id;
};
HYDRA_INTERFACE_SIZE(HdSprim, 16, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
