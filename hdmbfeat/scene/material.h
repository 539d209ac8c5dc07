// Materials as plain data: the inputs of UsdPreviewSurface, each a constant, a texture or a
// primvar. Other surface models are translated to these inputs where they enter the scene.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "scene/texture.h"

namespace mbfeat {

/// A texture look-up of a material: image, coordinates and value range.
struct TextureNode {
    ImageKey image;
    std::string uvPrimvar = "st"; ///< primvar that gives the texture coordinates
    Wrap wrapS = Wrap::kBlack;
    Wrap wrapT = Wrap::kBlack;
    Float4 scale{1.0F, 1.0F, 1.0F, 1.0F};
    Float4 bias{0.0F, 0.0F, 0.0F, 0.0F};
    Float4 fallback{0.0F, 0.0F, 0.0F, 1.0F}; ///< where the image cannot be read
    /// UsdTransform2d before the look-up: scale, then rotation (degrees), then translation.
    Float2 stScale{1.0F, 1.0F};
    float stRotation = 0.0F;
    Float2 stTranslation{0.0F, 0.0F};
    Float2 stFallback{0.0F, 0.0F}; ///< coordinates where the mesh lacks the primvar
};

/// Where the value of an input comes from.
struct MaterialInput {
    enum class Source : std::uint8_t { kConstant, kTexture, kPrimvar };
    Source source = Source::kConstant;
    int texture = -1;    ///< index into Material::textures
    int channel = 0;     ///< first channel taken from a texture: 0 r, 1 g, 2 b, 3 a
    std::string primvar; ///< name, for kPrimvar
    Float3 value{0.0F};  ///< the constant; scalars in x; the fallback of a primvar

    MaterialInput() = default;
    explicit MaterialInput(Float3 constant) : value(constant) {}
    explicit MaterialInput(float constant) : value(constant) {}
};

enum class OpacityMode : std::uint8_t { kTransparent, kPresence };

/// UsdPreviewSurface 2.6. Defaults are the specification's. Immutable once handed to the Scene.
struct Material {
    std::string path; ///< prim path, for messages

    MaterialInput diffuseColor{Float3(0.18F)};
    MaterialInput emissiveColor{Float3(0.0F)};
    bool useSpecularWorkflow = false;
    MaterialInput specularColor{Float3(0.0F)};
    MaterialInput metallic{Float3(0.0F)};
    MaterialInput roughness{Float3(0.5F)};
    MaterialInput clearcoat{Float3(0.0F)};
    MaterialInput clearcoatRoughness{Float3(0.01F)};
    MaterialInput opacity{Float3(1.0F)};
    OpacityMode opacityMode = OpacityMode::kTransparent;
    MaterialInput opacityThreshold{Float3(0.0F)};
    MaterialInput ior{Float3(1.5F)};
    MaterialInput normal{Float3(0.0F, 0.0F, 1.0F)};
    MaterialInput occlusion{Float3(1.0F)}; ///< not used: the light transport occludes

    std::vector<TextureNode> textures;
    /// textures[i] loaded; null where it could not be. Filled by Scene::commit().
    std::vector<std::shared_ptr<const Image>> images;

    /// True where light may pass: opacity is textured or below 1 in transparent mode.
    bool mayTransmit() const {
        return opacityMode == OpacityMode::kTransparent &&
               (opacity.source != MaterialInput::Source::kConstant || opacity.value.x < 1.0F);
    }
    /// True where hits may be passed through as if nothing were there (threshold, presence).
    bool mayCutOut() const {
        const bool varies = opacity.source != MaterialInput::Source::kConstant;
        const bool threshold = opacityThreshold.source != MaterialInput::Source::kConstant ||
                               opacityThreshold.value.x > 0.0F;
        return (varies || opacity.value.x < 1.0F) &&
               (threshold || opacityMode == OpacityMode::kPresence);
    }
    bool emits() const {
        return emissiveColor.source != MaterialInput::Source::kConstant ||
               emissiveColor.value.x > 0.0F || emissiveColor.value.y > 0.0F ||
               emissiveColor.value.z > 0.0F;
    }
};

} // namespace mbfeat
