#pragma once

#include "pxr/base/tf/declarePtrs.h"
#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/dataSource.h"
#include "pxr/imaging/hd/filteringSceneIndex.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

TF_DECLARE_WEAK_AND_REF_PTRS(HdsiImplicitSurfaceSceneIndex);

/// Turns spheres, cubes, cones, cylinders, capsules and planes into meshes.
class HdsiImplicitSurfaceSceneIndex : public HdSingleInputFilteringSceneIndexBase {
public:
    /// inputArgs: for each of the keys sphere, cube, cone, cylinder, capsule, plane the token
    /// toMesh.
    static HdsiImplicitSurfaceSceneIndexRefPtr New(const HdSceneIndexBaseRefPtr& inputSceneIndex,
                                                   const HdContainerDataSourceHandle& inputArgs);

    ~HdsiImplicitSurfaceSceneIndex() override;
    HdSceneIndexPrim GetPrim(const SdfPath& primPath) const override;
    SdfPathVector GetChildPrimPaths(const SdfPath& primPath) const override;

protected:
    HdsiImplicitSurfaceSceneIndex(const HdSceneIndexBaseRefPtr& inputSceneIndex,
                                  const HdContainerDataSourceHandle& inputArgs);
    void _PrimsAdded(const HdSceneIndexBase& sender,
                     const HdSceneIndexObserver::AddedPrimEntries& entries) override;
    void _PrimsRemoved(const HdSceneIndexBase& sender,
                       const HdSceneIndexObserver::RemovedPrimEntries& entries) override;
    void _PrimsDirtied(const HdSceneIndexBase& sender,
                       const HdSceneIndexObserver::DirtiedPrimEntries& entries) override;

private:
    TfToken const _capsuleMode;
    TfToken const _coneMode;
    TfToken const _cubeMode;
    TfToken const _cylinderMode;
    TfToken const _planeMode;
    TfToken const _sphereMode;
};
HYDRA_INTERFACE_SIZE(HdsiImplicitSurfaceSceneIndex, 200, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
