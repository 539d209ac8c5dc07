#pragma once

#include "pxr/base/tf/smallVector.h"
#include "pxr/imaging/hd/sceneIndex.h"
#include "pxr/imaging/hd/sceneIndexObserver.h"
#include "pxr/imaging/interface.h"

#include <cstddef>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

/// A scene index that reads others.
class HdFilteringSceneIndexBase : public HdSceneIndexBase {
public:
    virtual std::vector<HdSceneIndexBaseRefPtr> GetInputScenes() const = 0;
};
HYDRA_INTERFACE_SIZE(HdFilteringSceneIndexBase, 120, 8);

/// A scene index that reads one other and is told of its changes.
class HdSingleInputFilteringSceneIndexBase : public HdFilteringSceneIndexBase {
public:
    ~HdSingleInputFilteringSceneIndexBase() override;
    std::vector<HdSceneIndexBaseRefPtr> GetInputScenes() const final;

protected:
    explicit HdSingleInputFilteringSceneIndexBase(const HdSceneIndexBaseRefPtr& inputSceneIndex);

    virtual void _PrimsAdded(const HdSceneIndexBase& sender,
                             const HdSceneIndexObserver::AddedPrimEntries& entries) = 0;
    virtual void _PrimsRemoved(const HdSceneIndexBase& sender,
                               const HdSceneIndexObserver::RemovedPrimEntries& entries) = 0;
    virtual void _PrimsDirtied(const HdSceneIndexBase& sender,
                               const HdSceneIndexObserver::DirtiedPrimEntries& entries) = 0;
    virtual void _PrimsRenamed(const HdSceneIndexBase& sender,
                               const HdSceneIndexObserver::RenamedPrimEntries& entries);

    const HdSceneIndexBaseRefPtr& _GetInputSceneIndex() const { return _inputSceneIndex; }

private:
    HdSceneIndexBaseRefPtr _inputSceneIndex;
    alignas(8) std::byte _opaqueObserver[24];
};
HYDRA_INTERFACE_SIZE(HdSingleInputFilteringSceneIndexBase, 152, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
