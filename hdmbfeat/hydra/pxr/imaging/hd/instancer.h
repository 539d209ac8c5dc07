#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <mutex>

HYDRA_INTERFACE_OPEN_SCOPE

class HdRenderIndex;
class HdRenderParam;
class HdRprim;
class HdSceneDelegate;

/// Places its prototypes many times; may be nested in a parent instancer.
class HdInstancer {
public:
    HdInstancer(HdSceneDelegate* delegate, const SdfPath& id);
    virtual ~HdInstancer();

    const SdfPath& GetId() const { return _id; }
    const SdfPath& GetParentId() const { return _parentId; }
    HdSceneDelegate* GetDelegate() const { return _delegate; }

    static int GetInstancerNumLevels(HdRenderIndex& index, const HdRprim& rprim);
    static const TfTokenVector& GetBuiltinPrimvarNames();

    virtual void Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
                      HdDirtyBits* dirtyBits);
    virtual void Finalize(HdRenderParam* renderParam);
    virtual HdDirtyBits GetInitialDirtyBitsMask() const;

    /// Syncs the instancer and those above it if they are dirty. A prim's Sync must call it, or its
    /// instancer is never synced. Safe from several threads.
    static void _SyncInstancerAndParents(HdRenderIndex& renderIndex, const SdfPath& instancerId);

protected:
    void _UpdateInstancer(HdSceneDelegate* delegate, HdDirtyBits* dirtyBits);

private:
    HdSceneDelegate* _delegate;
    SdfPath _id;
    SdfPath _parentId;
    std::mutex _instanceLock;
};
HYDRA_INTERFACE_SIZE(HdInstancer, 72, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
