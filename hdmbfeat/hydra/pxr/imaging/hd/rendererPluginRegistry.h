#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/rendererPlugin.h"
#include "pxr/imaging/hf/pluginRegistry.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

class HdRendererPluginRegistry : public HfPluginRegistry {
public:
    static HdRendererPluginRegistry& GetInstance();

    /// For a TF_REGISTRY_FUNCTION(TfType); T is also named in plugInfo.json.
    template <typename T, typename... Bases>
    static void Define() {
        HfPluginRegistry::Define<T, HdRendererPlugin, Bases...>();
    }

    TfToken GetDefaultPluginId(bool gpuEnabled = true);

private:
    void _CollectAdditionalMetadata(const PlugRegistry& plugRegistry,
                                    const TfType& pluginType) override;

    HdRendererPluginRegistry();
    ~HdRendererPluginRegistry() override;
};
HYDRA_INTERFACE_SIZE(HdRendererPluginRegistry, 96, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
