// Scene indices that stand between a stage and the renderer: implicit surfaces become meshes, and
// the active render settings prim is marked and reduced to our namespaces.
#include "pxr/pxr.h"

#include "pxr/base/tf/registryManager.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/imaging/hd/sceneIndexPlugin.h"
#include "pxr/imaging/hd/sceneIndexPluginRegistry.h"
#include "pxr/imaging/hd/utils.h"
#include "pxr/imaging/hdsi/implicitSurfaceSceneIndex.h"
#include "pxr/imaging/hdsi/renderSettingsFilteringSceneIndex.h"

PXR_NAMESPACE_USING_DIRECTIVE

namespace {

constexpr const char* kRendererDisplayName = "MBFeat";

HdContainerDataSourceHandle implicitSurfaceArguments() {
    VtDictionary arguments;
    for (const char* const shape : {"sphere", "cube", "cone", "cylinder", "capsule", "plane"}) {
        arguments[shape] = VtValue(TfToken("toMesh"));
    }
    return HdUtils::ConvertVtDictionaryToContainerDS(arguments);
}

HdContainerDataSourceHandle settingsFilterArguments() {
    VtArray<TfToken> prefixes;
    prefixes.push_back(TfToken("mbfeat"));
    prefixes.push_back(TfToken("driver"));
    VtDictionary arguments;
    arguments["namespacePrefixes"] = VtValue(prefixes);
    return HdUtils::ConvertVtDictionaryToContainerDS(arguments);
}

} // namespace

class HdMBFeatImplicitSurfaceSceneIndexPlugin final : public HdSceneIndexPlugin {
protected:
    using HdSceneIndexPlugin::_AppendSceneIndex;
    HdSceneIndexBaseRefPtr
    _AppendSceneIndex(const HdSceneIndexBaseRefPtr& inputScene,
                      const HdContainerDataSourceHandle& /*inputArgs*/) override {
        return HdsiImplicitSurfaceSceneIndex::New(inputScene, implicitSurfaceArguments());
    }
};

class HdMBFeatRenderSettingsSceneIndexPlugin final : public HdSceneIndexPlugin {
protected:
    using HdSceneIndexPlugin::_AppendSceneIndex;
    HdSceneIndexBaseRefPtr
    _AppendSceneIndex(const HdSceneIndexBaseRefPtr& inputScene,
                      const HdContainerDataSourceHandle& /*inputArgs*/) override {
        return HdsiRenderSettingsFilteringSceneIndex::New(inputScene, settingsFilterArguments());
    }
};

TF_REGISTRY_FUNCTION(TfType) {
    HdSceneIndexPluginRegistry::Define<HdMBFeatImplicitSurfaceSceneIndexPlugin>();
    HdSceneIndexPluginRegistry::Define<HdMBFeatRenderSettingsSceneIndexPlugin>();
}

TF_REGISTRY_FUNCTION(HdSceneIndexPlugin) {
    HdSceneIndexPluginRegistry& registry = HdSceneIndexPluginRegistry::GetInstance();
    for (const char* const type :
         {"HdMBFeatImplicitSurfaceSceneIndexPlugin", "HdMBFeatRenderSettingsSceneIndexPlugin"}) {
        registry.RegisterSceneIndexForRenderer(kRendererDisplayName, TfToken(type), nullptr, 0,
                                               HdSceneIndexPluginRegistry::InsertionOrderAtStart);
    }
}
