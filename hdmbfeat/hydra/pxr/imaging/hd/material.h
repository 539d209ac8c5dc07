#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/sprim.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <map>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

struct HdMaterialNetworkMap;

/// A material; its network comes through GetMaterialResource.
class HdMaterial : public HdSprim {
public:
    enum DirtyBits : HdDirtyBits {
        Clean = 0,
        DirtyParams = 1 << 2,
        DirtyResource = 1 << 3,
        DirtySurface = 1 << 4,
        DirtyDisplacement = 1 << 5,
        DirtyVolume = 1 << 6,
        AllDirty = DirtyParams | DirtyResource | DirtySurface | DirtyDisplacement | DirtyVolume
    };

    ~HdMaterial() override;

protected:
    explicit HdMaterial(const SdfPath& id);

private:
    HdMaterial() = delete;
    HdMaterial(const HdMaterial&) = delete;
    HdMaterial& operator=(const HdMaterial&) = delete;
};
HYDRA_INTERFACE_SIZE(HdMaterial, 16, 8);

/// An edge of a network: inputId's output inputName feeds outputId's input outputName.
struct HdMaterialRelationship {
    SdfPath inputId;
    TfToken inputName;
    SdfPath outputId;
    TfToken outputName;
};
HYDRA_INTERFACE_SIZE(HdMaterialRelationship, 32, 8);

struct HdMaterialNode {
    SdfPath path;
    TfToken identifier;
    std::map<TfToken, VtValue> parameters;
};
HYDRA_INTERFACE_SIZE(HdMaterialNode, 64, 8);

struct HdMaterialNetwork {
    std::vector<HdMaterialRelationship> relationships;
    std::vector<HdMaterialNode> nodes;
    TfTokenVector primvars;
};
HYDRA_INTERFACE_SIZE(HdMaterialNetwork, 72, 8);

/// What GetMaterialResource holds: a network for each terminal.
struct HdMaterialNetworkMap {
    std::map<TfToken, HdMaterialNetwork> map;
    std::vector<SdfPath> terminals;
    VtDictionary config;
};
HYDRA_INTERFACE_SIZE(HdMaterialNetworkMap, 80, 8);

bool operator==(const HdMaterialNetworkMap& lhs, const HdMaterialNetworkMap& rhs);

struct HdMaterialConnection2 {
    SdfPath upstreamNode;
    TfToken upstreamOutputName;

    bool operator==(const HdMaterialConnection2& other) const {
        return upstreamNode == other.upstreamNode && upstreamOutputName == other.upstreamOutputName;
    }
};
HYDRA_INTERFACE_SIZE(HdMaterialConnection2, 16, 8);

/// A shading node with its parameters and what feeds its inputs. Parameter maps also hold keys such
/// as typeName:diffuseColor or colorSpace:file beside the plain names.
struct HdMaterialNode2 {
    TfToken nodeTypeId;
    std::map<TfToken, VtValue> parameters;
    std::map<TfToken, std::vector<HdMaterialConnection2>> inputConnections;
};
HYDRA_INTERFACE_SIZE(HdMaterialNode2, 104, 8);

/// All terminals' nodes in one map.
struct HdMaterialNetwork2 {
    std::map<SdfPath, HdMaterialNode2> nodes;
    std::map<TfToken, HdMaterialConnection2> terminals;
    TfTokenVector primvars;
    VtDictionary config;
};
HYDRA_INTERFACE_SIZE(HdMaterialNetwork2, 128, 8);

/// isVolume, if given, is set when the network has a volume terminal.
HdMaterialNetwork2 HdConvertToHdMaterialNetwork2(const HdMaterialNetworkMap& hdNetworkMap,
                                                 bool* isVolume = nullptr);

HYDRA_INTERFACE_CLOSE_SCOPE
