#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/dataSource.h"
#include "pxr/imaging/hd/sceneIndex.h"
#include "pxr/imaging/hd/sceneIndexPlugin.h"
#include "pxr/imaging/hf/pluginRegistry.h"
#include "pxr/imaging/interface.h"

#include <cstddef>
#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

class HdSceneIndexPluginRegistry : public HfPluginRegistry {
public:
    using InsertionPhase = int;
    enum InsertionOrder { InsertionOrderAtStart, InsertionOrderAtEnd };

    static HdSceneIndexPluginRegistry& GetInstance();

    /// For a TF_REGISTRY_FUNCTION(TfType); T is also named in plugInfo.json.
    template <typename T, typename... Bases>
    static void Define() {
        HfPluginRegistry::Define<T, HdSceneIndexPlugin, Bases...>();
    }

    /// For a TF_REGISTRY_FUNCTION(HdSceneIndexPlugin). The renderer's key is its display name, not
    /// its plug-in id; an empty name means every renderer.
    void RegisterSceneIndexForRenderer(const std::string& rendererDisplayName,
                                       const TfToken& sceneIndexPluginId,
                                       const HdContainerDataSourceHandle& inputArgs,
                                       InsertionPhase insertionPhase,
                                       InsertionOrder insertionOrder);

protected:
    void _CollectAdditionalMetadata(const PlugRegistry& plugRegistry,
                                    const TfType& pluginType) override;

private:
    HdSceneIndexPluginRegistry();
    ~HdSceneIndexPluginRegistry() override;

    alignas(8) std::byte _opaqueMaps[144];
};
HYDRA_INTERFACE_SIZE(HdSceneIndexPluginRegistry, 240, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
