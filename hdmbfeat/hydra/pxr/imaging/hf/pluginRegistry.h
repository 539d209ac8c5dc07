#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/tf/type.h"
#include "pxr/imaging/hf/pluginBase.h"
#include "pxr/imaging/interface.h"

#include <cstddef>
#include <functional>

HYDRA_INTERFACE_OPEN_SCOPE

class PlugRegistry;

/// Registry of plug-ins by type. Singletons of the library, reached through GetInstance() of the
/// subclasses; only what registration and look-up by id need is declared.
class HfPluginRegistry {
public:
    bool IsRegisteredPlugin(const TfToken& pluginId);
    TfToken GetPluginId(const HfPluginBase* plugin) const;

protected:
    using _FactoryFn = std::function<HfPluginBase*()>;

    explicit HfPluginRegistry(const TfType& pluginBaseType);
    virtual ~HfPluginRegistry();

    /// Tells the type system that T is a plug-in of kind PluginBase and how to make one.
    /// The registry deletes what the factory returns, with plain delete.
    template <typename T, typename PluginBase, typename... Bases>
    static void Define() {
        TfType type = TfType::Define<T, TfType::Bases<PluginBase, Bases...>>();
        _FactoryFn create = []() -> HfPluginBase* { return new T; };
        _SetFactory(type, create);
    }

    virtual void _CollectAdditionalMetadata(const PlugRegistry& plugRegistry,
                                            const TfType& pluginType);

private:
    static void _SetFactory(TfType& type, _FactoryFn& factory);

    TfType _pluginBaseType;
    alignas(8) std::byte _opaqueEntries[72];
    bool _pluginCachePopulated;

    HfPluginRegistry() = delete;
    HfPluginRegistry(const HfPluginRegistry&) = delete;
    HfPluginRegistry& operator=(const HfPluginRegistry&) = delete;
};
HYDRA_INTERFACE_SIZE(HfPluginRegistry, 96, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
