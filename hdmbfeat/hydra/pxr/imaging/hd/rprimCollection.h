#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/repr.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <cstddef>

HYDRA_INTERFACE_OPEN_SCOPE

/// The part of the scene that a render pass draws: subtrees and the representations wanted.
class HdRprimCollection {
public:
    HdRprimCollection();
    HdRprimCollection(const TfToken& name, const HdReprSelector& reprSelector,
                      bool forcedRepr = false, const TfToken& materialTag = TfToken());
    HdRprimCollection(const TfToken& name, const HdReprSelector& reprSelector,
                      const SdfPath& rootPath, bool forcedRepr = false,
                      const TfToken& materialTag = TfToken());
    HdRprimCollection(const HdRprimCollection& other);
    HdRprimCollection& operator=(const HdRprimCollection&) = default;
    virtual ~HdRprimCollection();

    HdRprimCollection CreateInverseCollection() const;

    const TfToken& GetName() const { return _name; }
    void SetName(const TfToken& name) { _name = name; }
    const HdReprSelector& GetReprSelector() const { return _reprSelector; }
    void SetReprSelector(const HdReprSelector& reprSelector) { _reprSelector = reprSelector; }
    bool IsForcedRepr() const { return _forcedRepr; }
    void SetForcedRepr(bool forced) { _forcedRepr = forced; }
    const SdfPathVector& GetRootPaths() const;
    void SetRootPaths(const SdfPathVector& rootPaths);
    void SetRootPath(const SdfPath& rootPath);
    void SetExcludePaths(const SdfPathVector& excludePaths);
    const SdfPathVector& GetExcludePaths() const;
    void SetMaterialTag(const TfToken& tag);
    const TfToken& GetMaterialTag() const;

    size_t ComputeHash() const;
    bool operator==(const HdRprimCollection& other) const;
    bool operator!=(const HdRprimCollection& other) const;

private:
    TfToken _name;
    HdReprSelector _reprSelector;
    bool _forcedRepr;
    TfToken _materialTag;
    SdfPathVector _rootPaths;
    SdfPathVector _excludePaths;
};
HYDRA_INTERFACE_SIZE(HdRprimCollection, 104, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
