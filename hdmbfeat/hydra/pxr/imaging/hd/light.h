#pragma once

#include "pxr/imaging/hd/sprim.h"
#include "pxr/imaging/interface.h"

#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

/// A light of any type; its parameters come through GetLightParamValue.
class HdLight : public HdSprim {
public:
    enum DirtyBits : HdDirtyBits {
        Clean = 0,
        DirtyTransform = 1 << 0,
        DirtyParams = 1 << 1,
        DirtyShadowParams = 1 << 2,
        DirtyCollection = 1 << 3,
        DirtyResource = 1 << 4,
        DirtyInstancer = 1 << 16,
        AllDirty = DirtyTransform | DirtyParams | DirtyShadowParams | DirtyCollection |
                   DirtyResource | DirtyInstancer
    };

    explicit HdLight(const SdfPath& id);
    ~HdLight() override;

    static std::string StringifyDirtyBits(HdDirtyBits dirtyBits);
    const SdfPath& GetInstancerId() const { return _instancerId; }
    void _UpdateInstancer(HdSceneDelegate* sceneDelegate, HdDirtyBits* dirtyBits);

private:
    SdfPath _instancerId;
};
HYDRA_INTERFACE_SIZE(HdLight, 24, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
