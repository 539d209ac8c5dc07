// The entry point of the renderer: what OpenUSD finds in plugInfo.json as "MBFeat". The only file
// that knows of differences between OpenUSD releases.
#include "pxr/pxr.h"

#include <exception>
#include <memory>

#include "delegate/renderDelegate.h"
#include "pxr/base/tf/diagnostic.h"
#include "pxr/imaging/hd/rendererPlugin.h"
#include "pxr/imaging/hd/rendererPluginRegistry.h"

PXR_NAMESPACE_USING_DIRECTIVE

// The type's name is the key in plugInfo.json, so it stays out of our namespace.
class HdMBFeatRendererPlugin final : public HdRendererPlugin {
public:
    HdMBFeatRendererPlugin() = default;

    HdRenderDelegate* CreateRenderDelegate() override { return create({}); }
    HdRenderDelegate* CreateRenderDelegate(const HdRenderSettingsMap& settings) override {
        return create(settings);
    }
    void DeleteRenderDelegate(HdRenderDelegate* renderDelegate) override {
        const std::unique_ptr<HdRenderDelegate> owned(renderDelegate);
    }

#if PXR_VERSION >= 2511
    bool IsSupported(const HdRendererCreateArgs& /*arguments*/,
                     std::string* /*reason*/) const override {
        return true;
    }
#else
    bool IsSupported(bool /*gpuEnabled*/) const override {
        return true;
    }
#endif

private:
    static HdRenderDelegate* create(const HdRenderSettingsMap& settings) {
        try {
            return std::make_unique<mbfeat::RenderDelegate>(settings).release();
        } catch (const std::exception& failure) {
            TF_RUNTIME_ERROR("MBFeat could not start: %s", failure.what());
            return nullptr;
        }
    }
};

TF_REGISTRY_FUNCTION(TfType) {
    HdRendererPluginRegistry::Define<HdMBFeatRendererPlugin>();
}
