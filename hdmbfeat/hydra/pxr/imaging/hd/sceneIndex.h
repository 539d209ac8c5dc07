#pragma once

#include "pxr/base/tf/declarePtrs.h"
#include "pxr/base/tf/refBase.h"
#include "pxr/base/tf/refPtr.h"
#include "pxr/base/tf/smallVector.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/tf/weakBase.h"
#include "pxr/base/tf/weakPtr.h"
#include "pxr/imaging/hd/dataSource.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <cstddef>
#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

TF_DECLARE_WEAK_AND_REF_PTRS(HdSceneIndexBase);

/// A prim as a scene index sees it; no type and no data where there is none.
struct HdSceneIndexPrim {
    TfToken primType;
    HdContainerDataSourceHandle dataSource;

    bool IsDefined() const { return bool(dataSource); }
    explicit operator bool() const { return IsDefined(); }
};
HYDRA_INTERFACE_SIZE(HdSceneIndexPrim, 24, 8);

/// A scene as a tree of prims that can be asked. Held by TfRefPtr, made by the library only.
class HdSceneIndexBase : public TfRefBase, public TfWeakBase {
public:
    HdSceneIndexBase();
    ~HdSceneIndexBase() override;

    virtual HdSceneIndexPrim GetPrim(const SdfPath& primPath) const = 0;
    virtual SdfPathVector GetChildPrimPaths(const SdfPath& primPath) const = 0;

    std::string GetDisplayName() const;

protected:
    virtual void _SystemMessage(const TfToken& messageType, const HdDataSourceBaseHandle& args);

private:
    alignas(8) std::byte _opaqueObservers[96];
};
HYDRA_INTERFACE_SIZE(HdSceneIndexBase, 120, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
