#pragma once

#include "pxr/base/tf/smallVector.h"
#include "pxr/base/tf/weakBase.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

class HdSceneIndexBase;

/// Told of a scene index's changes. The entries stay incomplete: only the library makes and reads
/// them.
class HdSceneIndexObserver : public TfWeakBase {
public:
    struct AddedPrimEntry;
    struct RemovedPrimEntry;
    struct DirtiedPrimEntry;
    struct RenamedPrimEntry;
    using AddedPrimEntries = TfSmallVector<AddedPrimEntry, 16>;
    using RemovedPrimEntries = TfSmallVector<RemovedPrimEntry, 16>;
    using DirtiedPrimEntries = TfSmallVector<DirtiedPrimEntry, 16>;
    using RenamedPrimEntries = TfSmallVector<RenamedPrimEntry, 16>;

    virtual ~HdSceneIndexObserver();

    virtual void PrimsAdded(const HdSceneIndexBase& sender, const AddedPrimEntries& entries) = 0;
    virtual void PrimsRemoved(const HdSceneIndexBase& sender,
                              const RemovedPrimEntries& entries) = 0;
    virtual void PrimsDirtied(const HdSceneIndexBase& sender,
                              const DirtiedPrimEntries& entries) = 0;
    virtual void PrimsRenamed(const HdSceneIndexBase& sender,
                              const RenamedPrimEntries& entries) = 0;
};
HYDRA_INTERFACE_SIZE(HdSceneIndexObserver, 16, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
