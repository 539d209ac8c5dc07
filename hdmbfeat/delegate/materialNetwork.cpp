#include "delegate/materialNetwork.h"

#include <algorithm>
#include <cmath>

#include "delegate/tokens.h"
#include "delegate/values.h"
#include "pxr/base/gf/vec3f.h"

namespace mbfeat {

NetworkNode::NetworkNode(const HdMaterialNetwork2& network, const SdfPath& path)
    : network_(&network),
      path_(path) {
    const auto found = network.nodes.find(path);
    node_ = found == network.nodes.end() ? nullptr : &found->second;
}

VtValue NetworkNode::parameter(const char* name) const {
    const auto found = node_->parameters.find(TfToken(name));
    return found == node_->parameters.end() ? VtValue() : found->second;
}

bool NetworkNode::hasConnection(const char* input) const {
    const auto found = node_->inputConnections.find(TfToken(input));
    return found != node_->inputConnections.end() && !found->second.empty();
}

NetworkNode NetworkNode::connected(const char* input, std::string* output) const {
    const auto found = node_->inputConnections.find(TfToken(input));
    if (found == node_->inputConnections.end() || found->second.empty()) {
        return NetworkNode();
    }
    const HdMaterialConnection2& connection = found->second.front();
    if (output != nullptr) {
        *output = connection.upstreamOutputName.GetString();
    }
    return {*network_, connection.upstreamNode};
}

std::vector<std::string> NetworkNode::connectedInputs() const {
    std::vector<std::string> names;
    for (const auto& [name, connections] : node_->inputConnections) {
        if (!connections.empty()) {
            names.push_back(name.GetString());
        }
    }
    return names;
}

MaterialBuilder::MaterialBuilder(std::string path, Diagnostics& diagnostics)
    : diagnostics_(diagnostics) {
    material_.path = std::move(path);
}

void MaterialBuilder::setTexture(MaterialInput& input, const TextureNode& texture, int channel) {
    const auto same = [&](const TextureNode& t) {
        const auto equal4 = [](const Float4& a, const Float4& b) {
            return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w;
        };
        const auto equal2 = [](const Float2& a, const Float2& b) {
            return a.x == b.x && a.y == b.y;
        };
        return !(t.image < texture.image) && !(texture.image < t.image) &&
               t.uvPrimvar == texture.uvPrimvar && t.wrapS == texture.wrapS &&
               t.wrapT == texture.wrapT && equal4(t.scale, texture.scale) &&
               equal4(t.bias, texture.bias) && equal4(t.fallback, texture.fallback) &&
               equal2(t.stScale, texture.stScale) && t.stRotation == texture.stRotation &&
               equal2(t.stTranslation, texture.stTranslation) &&
               equal2(t.stFallback, texture.stFallback);
    };
    std::vector<TextureNode>& textures = material_.textures;
    auto found = std::find_if(textures.begin(), textures.end(), same);
    if (found == textures.end()) {
        textures.push_back(texture);
        found = textures.end() - 1;
    }
    input.source = MaterialInput::Source::kTexture;
    input.texture = static_cast<int>(found - textures.begin());
    input.channel = channel;
}

std::vector<NamedInput> inputsOf(Material& m) {
    return {
        {"diffuseColor", &m.diffuseColor},
        {"emissiveColor", &m.emissiveColor},
        {"specularColor", &m.specularColor},
        {"metallic", &m.metallic},
        {"roughness", &m.roughness},
        {"clearcoat", &m.clearcoat},
        {"clearcoatRoughness", &m.clearcoatRoughness},
        {"opacity", &m.opacity},
        {"opacityThreshold", &m.opacityThreshold},
        {"ior", &m.ior},
        {"normal", &m.normal},
        {"occlusion", &m.occlusion},
    };
}

namespace {

/// As it was authored: numbers stand in all three components.
std::string asAuthored(const Float3& v) {
    const auto same = [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); };
    const bool isNumber = same(v.x, v.y) && same(v.x, v.z);
    return describe(isNumber ? VtValue(v.x) : VtValue(GfVec3f(v.x, v.y, v.z)));
}

/// Replaces constants that are no numbers by the defaults of UsdPreviewSurface.
void repairInputs(MaterialBuilder& builder) {
    Material defaults;
    const std::vector<NamedInput> fallbacks = inputsOf(defaults);
    const std::vector<NamedInput> inputs = inputsOf(builder.material());
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        Float3& value = inputs[i].input->value;
        if (isFinite(value)) {
            continue;
        }
        const Float3 authored = value;
        for (int c = 0; c < 3; ++c) {
            value[c] = std::isfinite(value[c]) ? value[c] : fallbacks[i].input->value[c];
        }
        builder.warn(std::string("its input ") + inputs[i].name + " is " + asAuthored(authored) +
                     "; " + asAuthored(value) + " is used. Author finite numbers.");
    }
}

} // namespace

void MaterialBuilder::removeUnusedTextures() {
    const std::vector<TextureNode> all = std::move(material_.textures);
    material_.textures.clear();
    for (const auto& [name, input] : inputsOf(material_)) {
        if (input->source == MaterialInput::Source::kTexture) {
            setTexture(*input, all[static_cast<std::size_t>(input->texture)], input->channel);
        }
    }
}

void setColorSpace(ImageKey& image, const std::string& name) {
    if (name.empty() || name == "auto") {
        image.colorSpace = SourceColorSpace::kAuto;
    } else if (name == "raw" || name == "Raw" || name == "none" || name == "data") {
        image.colorSpace = SourceColorSpace::kRaw;
    } else if (name == "sRGB" || name == "srgb_texture" || name == "sRGB - Texture") {
        image.colorSpace = SourceColorSpace::kSrgb;
    } else {
        image.colorSpace = SourceColorSpace::kNamed;
        image.colorSpaceName = name;
    }
}

namespace {

/// A material of lights has other terminals; these two belong to surfaces.
void reportIgnored(const std::string& path, const HdMaterialNetwork2& network,
                   Diagnostics& diagnostics) {
    const std::pair<const char*, const char*> ignored[] = {
        {"displacement", "its displacement is not supported; surfaces stay where they are."},
        {"volume", "its volume shader is not supported; nothing fills what it is bound to."}};
    for (const auto& [terminal, text] : ignored) {
        if (network.terminals.count(TfToken(terminal)) != 0) {
            diagnostics.warn(path, text);
        }
    }
}

} // namespace

std::optional<Material> translateMaterial(const std::string& path,
                                          const HdMaterialNetwork2& network,
                                          Diagnostics& diagnostics) {
    reportIgnored(path, network, diagnostics);
    const auto terminal = network.terminals.find(tokens().surface);
    if (terminal == network.terminals.end()) {
        return std::nullopt; // a material of other renderers, or of lights
    }
    const NetworkNode surface(network, terminal->second.upstreamNode);
    MaterialBuilder builder(path, diagnostics);
    if (surface && (surface.type() == "UsdPreviewSurface" ||
                    surface.type() == "ND_UsdPreviewSurface_surfaceshader")) {
        translatePreviewSurface(surface, builder);
        repairInputs(builder);
        return std::move(builder.material());
    }
    if (surface && translateMaterialX(surface, builder)) {
        repairInputs(builder);
        return std::move(builder.material());
    }
    diagnostics.warn(path, (surface ? "its surface is the unknown shader " + surface.type()
                                    : std::string("its surface shader does not exist")) +
                               "; the default material is used. Give it a UsdPreviewSurface.");
    return std::nullopt;
}

} // namespace mbfeat
