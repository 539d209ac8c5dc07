#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/renderDelegate.h"
#include "pxr/imaging/hf/pluginBase.h"
#include "pxr/imaging/interface.h"

#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

/// Makes and frees render delegates.
class HdRendererPlugin : public HfPluginBase {
public:
    TfToken GetPluginId() const;
    std::string GetDisplayName() const;

    virtual HdRenderDelegate* CreateRenderDelegate() = 0;
    /// The library's calls the other and sets the settings one by one.
    virtual HdRenderDelegate* CreateRenderDelegate(const HdRenderSettingsMap& settingsMap);
    virtual void DeleteRenderDelegate(HdRenderDelegate* renderDelegate) = 0;
    virtual bool IsSupported(bool gpuEnabled = true) const = 0;

protected:
    HdRendererPlugin() = default;
    ~HdRendererPlugin() override;

private:
    HdRendererPlugin(const HdRendererPlugin&) = delete;
    HdRendererPlugin& operator=(const HdRendererPlugin&) = delete;
};
HYDRA_INTERFACE_SIZE(HdRendererPlugin, 8, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
