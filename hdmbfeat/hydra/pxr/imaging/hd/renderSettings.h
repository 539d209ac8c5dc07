#pragma once

#include "pxr/base/gf/range2f.h"
#include "pxr/base/gf/vec2f.h"
#include "pxr/base/gf/vec2i.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/bprim.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <string>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

/// A RenderSettings prim with its products and their vars. Synced whether or not it is the active
/// one; IsActive() and the shutter interval need HdsiRenderSettingsFilteringSceneIndex.
class HdRenderSettings : public HdBprim {
public:
    enum DirtyBits : HdDirtyBits {
        Clean = 0,
        DirtyActive = 1 << 1,
        DirtyNamespacedSettings = 1 << 2,
        DirtyRenderProducts = 1 << 3,
        DirtyIncludedPurposes = 1 << 4,
        DirtyMaterialBindingPurposes = 1 << 5,
        DirtyRenderingColorSpace = 1 << 6,
        DirtyShutterInterval = 1 << 7,
        DirtyFrameNumber = 1 << 8,
        AllDirty = DirtyActive | DirtyNamespacedSettings | DirtyRenderProducts |
                   DirtyIncludedPurposes | DirtyMaterialBindingPurposes | DirtyRenderingColorSpace |
                   DirtyShutterInterval | DirtyFrameNumber
    };

    /// One file to be written.
    struct RenderProduct {
        struct RenderVar {
            SdfPath varPath;
            TfToken dataType;
            std::string sourceName;
            TfToken sourceType;
            VtDictionary namespacedSettings;
        };

        SdfPath productPath;
        TfToken type;
        TfToken name;
        GfVec2i resolution;
        std::vector<RenderVar> renderVars;
        SdfPath cameraPath;
        float pixelAspectRatio;
        TfToken aspectRatioConformPolicy;
        GfVec2f apertureSize;
        GfRange2f dataWindowNDC;
        bool disableMotionBlur;
        bool disableDepthOfField;
        VtDictionary namespacedSettings;
    };

    using RenderProducts = std::vector<RenderProduct>;
    using NamespacedSettings = VtDictionary;

    ~HdRenderSettings() override;

    bool IsActive() const;
    bool IsValid() const;
    const NamespacedSettings& GetNamespacedSettings() const;
    const RenderProducts& GetRenderProducts() const;
    const VtArray<TfToken>& GetIncludedPurposes() const;
    const VtArray<TfToken>& GetMaterialBindingPurposes() const;
    const TfToken& GetRenderingColorSpace() const;
    /// Holds a GfVec2d (open, close), or nothing.
    const VtValue& GetShutterInterval() const;
    bool GetAndResetHasDirtyProducts();

    /// Fills the members, then calls _Sync with the bits as they were.
    void Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;
    HdDirtyBits GetInitialDirtyBitsMask() const override;

protected:
    explicit HdRenderSettings(const SdfPath& id);
    virtual void _Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
                       const HdDirtyBits* dirtyBits);

private:
    HdRenderSettings() = delete;
    HdRenderSettings(const HdRenderSettings&) = delete;
    HdRenderSettings& operator=(const HdRenderSettings&) = delete;

    bool _active;
    bool _dirtyProducts;
    NamespacedSettings _namespacedSettings;
    RenderProducts _products;
    VtArray<TfToken> _includedPurposes;
    VtArray<TfToken> _materialBindingPurposes;
    TfToken _renderingColorSpace;
    VtValue _vShutterInterval;
};
HYDRA_INTERFACE_SIZE(HdRenderSettings::RenderProduct::RenderVar, 64, 8);
HYDRA_INTERFACE_SIZE(HdRenderSettings::RenderProduct, 120, 8);
HYDRA_INTERFACE_SIZE(HdRenderSettings, 160, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
