// Shading networks as the scene's materials.
#pragma once

#include "pxr/pxr.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "pxr/imaging/hd/material.h"
#include "scene/material.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// The material of a network's surface terminal: UsdPreviewSurface exactly, MaterialX surfaces by
/// their nearest UsdPreviewSurface inputs, which is reported. Nothing when there is no surface or
/// none that is known (reported): the prim is then shown with the default material.
std::optional<Material> translateMaterial(const std::string& path,
                                          const HdMaterialNetwork2& network,
                                          Diagnostics& diagnostics);

/// One node of a network and what is connected to it. Cheap view; the network must outlive it.
class NetworkNode {
public:
    NetworkNode(const HdMaterialNetwork2& network, const SdfPath& path);

    explicit operator bool() const { return node_ != nullptr; }
    const std::string& type() const { return node_->nodeTypeId.GetString(); }
    const SdfPath& path() const { return path_; }
    /// The value of an input that was authored here, or empty.
    VtValue parameter(const char* name) const;
    /// The node connected to an input, false where there is none; `output` is the name of its
    /// output.
    NetworkNode connected(const char* input, std::string* output = nullptr) const;
    bool hasConnection(const char* input) const;
    std::vector<std::string> connectedInputs() const;

private:
    NetworkNode() = default;
    const HdMaterialNetwork2* network_ = nullptr;
    const HdMaterialNode2* node_ = nullptr;
    SdfPath path_;
};

/// Builds up a Material: makes texture nodes once and shares them between inputs.
class MaterialBuilder {
public:
    MaterialBuilder(std::string path, Diagnostics& diagnostics);

    Material& material() { return material_; }
    Diagnostics& diagnostics() { return diagnostics_; }

    /// Makes the input read this texture, `channel` being the first one.
    void setTexture(MaterialInput& input, const TextureNode& texture, int channel);
    /// Drops textures that no input reads, such as those of weights that were made constants.
    void removeUnusedTextures();
    void warn(const std::string& text) { diagnostics_.warn(material_.path, text); }
    void inform(const std::string& text) {
        diagnostics_.report(Severity::kInfo, material_.path, text);
    }

private:
    Material material_;
    Diagnostics& diagnostics_;
};

struct NamedInput {
    const char* name; ///< as UsdPreviewSurface has it
    MaterialInput* input;
};

/// The inputs of a material, for what is done to all of them, always in the same order.
std::vector<NamedInput> inputsOf(Material& material);

/// Colour space of a texture by the names that UsdUVTexture, assets and MaterialX use.
void setColorSpace(ImageKey& image, const std::string& name);

/// UsdPreviewSurface, also as the MaterialX node of that name.
void translatePreviewSurface(const NetworkNode& surface, MaterialBuilder& builder);
/// standard_surface, open_pbr_surface and gltf_pbr. False for another node.
bool translateMaterialX(const NetworkNode& surface, MaterialBuilder& builder);
} // namespace mbfeat
