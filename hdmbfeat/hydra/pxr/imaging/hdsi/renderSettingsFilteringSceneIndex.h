#pragma once

#include "pxr/base/tf/declarePtrs.h"
#include "pxr/imaging/hd/dataSource.h"
#include "pxr/imaging/hd/filteringSceneIndex.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

TF_DECLARE_WEAK_AND_REF_PTRS(HdsiRenderSettingsFilteringSceneIndex);

/// Marks the active render settings prim, gives it the camera's shutter interval, and keeps only
/// the settings of the wanted namespaces. Without it HdRenderSettings::IsActive() is always false.
/// Reached through New only: its own data is not described here, so its size is not the library's.
class HdsiRenderSettingsFilteringSceneIndex : public HdSingleInputFilteringSceneIndexBase {
public:
    /// inputArgs: namespacePrefixes (array of tokens), optionally fallbackPrimDs.
    static HdsiRenderSettingsFilteringSceneIndexRefPtr
    New(const HdSceneIndexBaseRefPtr& inputSceneIndex,
        const HdContainerDataSourceHandle& inputArgs);

    HdsiRenderSettingsFilteringSceneIndex() = delete;
    ~HdsiRenderSettingsFilteringSceneIndex() override;
    HdSceneIndexPrim GetPrim(const SdfPath& primPath) const override;
    SdfPathVector GetChildPrimPaths(const SdfPath& primPath) const override;

protected:
    void _PrimsAdded(const HdSceneIndexBase& sender,
                     const HdSceneIndexObserver::AddedPrimEntries& entries) override;
    void _PrimsRemoved(const HdSceneIndexBase& sender,
                       const HdSceneIndexObserver::RemovedPrimEntries& entries) override;
    void _PrimsDirtied(const HdSceneIndexBase& sender,
                       const HdSceneIndexObserver::DirtiedPrimEntries& entries) override;
};

HYDRA_INTERFACE_CLOSE_SCOPE
