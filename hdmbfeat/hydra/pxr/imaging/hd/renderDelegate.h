#pragma once

#include "pxr/base/tf/hashmap.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/aov.h"
#include "pxr/imaging/hd/command.h"
#include "pxr/imaging/hd/dataSource.h"
#include "pxr/imaging/hd/driver.h"
#include "pxr/imaging/hd/renderPass.h"
#include "pxr/imaging/hd/resourceRegistry.h"
#include "pxr/imaging/hd/sceneIndex.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <string>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

class HdBprim;
class HdChangeTracker;
class HdInstancer;
class HdRenderIndex;
class HdRenderParam;
class HdRprim;
class HdSceneDelegate;
class HdSprim;

/// A setting that an application may show and change.
struct HdRenderSettingDescriptor {
    std::string name; ///< For people.
    TfToken key;
    VtValue defaultValue;
};
HYDRA_INTERFACE_SIZE(HdRenderSettingDescriptor, 56, 8);

using HdRenderSettingDescriptorList = std::vector<HdRenderSettingDescriptor>;
using HdRenderSettingsMap = TfHashMap<TfToken, VtValue, TfToken::HashFunctor>;

/// The renderer's side of Hydra: makes and destroys the prims that a scene asks for.
/// All functions are called from one thread, except Sync of the prims that it makes.
class HdRenderDelegate {
public:
    virtual ~HdRenderDelegate();

    virtual void SetDrivers(const HdDriverVector& drivers);

    virtual const TfTokenVector& GetSupportedRprimTypes() const = 0;
    virtual const TfTokenVector& GetSupportedSprimTypes() const = 0;
    virtual const TfTokenVector& GetSupportedBprimTypes() const = 0;

    /// Given to every Sync and Finalize; null in the library.
    virtual HdRenderParam* GetRenderParam() const;
    virtual HdResourceRegistrySharedPtr GetResourceRegistry() const = 0;

    /// Stores the value and counts a change of the settings version.
    virtual void SetRenderSetting(const TfToken& key, const VtValue& value);
    virtual VtValue GetRenderSetting(const TfToken& key) const;

    /// The setting as a T, or the default where it is absent or of a type that does not convert.
    template <typename T>
    T GetRenderSetting(const TfToken& key, const T& defaultValue) const {
        const VtValue value = VtValue::Cast<T>(GetRenderSetting(key));
        return value.IsHolding<T>() ? value.UncheckedGet<T>() : defaultValue;
    }

    virtual HdRenderSettingDescriptorList GetRenderSettingDescriptors() const;
    virtual unsigned int GetRenderSettingsVersion() const;
    virtual VtDictionary GetRenderStats() const;
    virtual HdContainerDataSourceHandle GetCapabilities() const;

    virtual bool IsPauseSupported() const;
    virtual bool IsPaused() const;
    virtual bool Pause();
    virtual bool Resume();
    virtual bool IsStopSupported() const;
    virtual bool IsStopped() const;
    virtual bool Stop(bool blocking = true);
    virtual bool Restart();

    virtual HdRenderPassSharedPtr CreateRenderPass(HdRenderIndex* index,
                                                   const HdRprimCollection& collection) = 0;
    virtual HdRenderPassStateSharedPtr CreateRenderPassState() const;

    virtual HdInstancer* CreateInstancer(HdSceneDelegate* delegate, const SdfPath& id) = 0;
    virtual void DestroyInstancer(HdInstancer* instancer) = 0;
    virtual HdRprim* CreateRprim(const TfToken& typeId, const SdfPath& rprimId) = 0;
    virtual void DestroyRprim(HdRprim* rPrim) = 0;
    virtual HdSprim* CreateSprim(const TfToken& typeId, const SdfPath& sprimId) = 0;
    /// One a supported type, at index creation, with an empty path.
    virtual HdSprim* CreateFallbackSprim(const TfToken& typeId) = 0;
    virtual void DestroySprim(HdSprim* sprim) = 0;
    virtual HdBprim* CreateBprim(const TfToken& typeId, const SdfPath& bprimId) = 0;
    virtual HdBprim* CreateFallbackBprim(const TfToken& typeId) = 0;
    virtual void DestroyBprim(HdBprim* bprim) = 0;

    /// Called when all prims are synced, before any pass executes.
    virtual void CommitResources(HdChangeTracker* tracker) = 0;

    virtual TfToken GetMaterialBindingPurpose() const;
    virtual TfToken GetMaterialNetworkSelector() const;
    virtual TfTokenVector GetMaterialRenderContexts() const;
    virtual TfTokenVector GetRenderSettingsNamespaces() const;
    virtual bool IsPrimvarFilteringNeeded() const;
    virtual TfTokenVector GetShaderSourceTypes() const;

    virtual HdAovDescriptor GetDefaultAovDescriptor(const TfToken& name) const;

    virtual HdCommandDescriptors GetCommandDescriptors() const;
    virtual bool InvokeCommand(const TfToken& command, const HdCommandArgs& args = HdCommandArgs());

    const std::string& GetRendererDisplayName() { return _displayName; }

    virtual void SetTerminalSceneIndex(const HdSceneIndexBaseRefPtr& terminalSceneIndex);
    virtual void Update();
    /// Whether prims of the type may be synced in parallel.
    virtual bool IsParallelSyncEnabled(const TfToken& primType) const;

protected:
    HdRenderDelegate();
    explicit HdRenderDelegate(const HdRenderSettingsMap& settingsMap);
    HdRenderDelegate(const HdRenderDelegate&) = delete;
    HdRenderDelegate& operator=(const HdRenderDelegate&) = delete;

    /// Fills in the keys that are missing.
    void _PopulateDefaultSettings(const HdRenderSettingDescriptorList& defaultSettings);

    HdRenderSettingsMap _settingsMap;
    unsigned int _settingsVersion;

private:
    std::string _displayName;
};
HYDRA_INTERFACE_SIZE(HdRenderSettingsMap, 40, 8);
HYDRA_INTERFACE_SIZE(HdRenderDelegate, 88, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
