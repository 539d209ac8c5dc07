#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/changeTracker.h"
#include "pxr/imaging/hd/driver.h"
#include "pxr/imaging/hd/resourceRegistry.h"
#include "pxr/imaging/hd/sceneIndex.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <cstddef>
#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

class HdBprim;
class HdInstancer;
class HdRenderDelegate;
class HdRprim;
class HdSceneDelegate;
class HdSprim;

/// All prims that the delegate made, by path. Owned by the application, seen through references.
/// Look-ups of what is absent return null.
class HdRenderIndex {
public:
    ~HdRenderIndex();

    const HdRprim* GetRprim(const SdfPath& id) const;
    HdSceneDelegate* GetSceneDelegateForRprim(const SdfPath& id) const;
    SdfPath GetRprimPathFromPrimId(int primId) const;
    TfToken GetRenderTag(const SdfPath& id) const;
    SdfPathVector GetRprimSubtree(const SdfPath& root);
    bool IsRprimTypeSupported(const TfToken& typeId) const;

    HdInstancer* GetInstancer(const SdfPath& id) const;

    HdSprim* GetSprim(const TfToken& typeId, const SdfPath& id) const;
    HdSprim* GetFallbackSprim(const TfToken& typeId) const;
    SdfPathVector GetSprimSubtree(const TfToken& typeId, const SdfPath& root);
    bool IsSprimTypeSupported(const TfToken& typeId) const;

    HdBprim* GetBprim(const TfToken& typeId, const SdfPath& id) const;
    HdBprim* GetFallbackBprim(const TfToken& typeId) const;
    SdfPathVector GetBprimSubtree(const TfToken& typeId, const SdfPath& root);
    bool IsBprimTypeSupported(const TfToken& typeId) const;

    HdChangeTracker& GetChangeTracker() { return _tracker; }
    const HdChangeTracker& GetChangeTracker() const { return _tracker; }
    HdRenderDelegate* GetRenderDelegate() const;
    const HdDriverVector& GetDrivers() const;
    HdResourceRegistrySharedPtr GetResourceRegistry() const;
    /// The scene as the delegate sees it, after all scene index plug-ins.
    HdSceneIndexBaseRefPtr GetTerminalSceneIndex() const;
    std::string GetInstanceName() const;

private:
    HdRenderIndex() = delete;
    HdRenderIndex(const HdRenderIndex&) = delete;
    HdRenderIndex& operator=(const HdRenderIndex&) = delete;

    alignas(8) std::byte _opaqueScene[488];
    HdChangeTracker _tracker;
    alignas(8) std::byte _opaqueTasks[232];
};
HYDRA_INTERFACE_SIZE(HdRenderIndex, 3936, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
