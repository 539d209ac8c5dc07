// From a material and a point of a mesh to the inputs of the closure.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "scene/material.h"
#include "scene/mesh.h"
#include "shading/bsdf.h"
#include "shading/shadingNormal.h"

namespace mbfeat {

/// A texture node with the mesh's coordinates resolved and its UsdTransform2d multiplied out.
struct BoundTexture {
    const TextureNode* node = nullptr;
    const Image* image = nullptr;  ///< null: could not be read, the node's fallback is used
    const Attribute* uv = nullptr; ///< null: the mesh lacks them, the node's stFallback is used
    /// st = (x.x u + y.x v, x.y u + y.y v) + translation
    Float2 x{1.0F, 0.0F}, y{0.0F, 1.0F}, translation{0.0F, 0.0F};
};

/// A material input with its primvar resolved. A primvar that the mesh lacks has become a
/// constant: its fallback.
struct BoundInput {
    const MaterialInput* input = nullptr;
    MaterialInput::Source source = MaterialInput::Source::kConstant;
    const Attribute* primvar = nullptr;
};

/// The inputs of a material that shading reads.
enum class MaterialSlot : std::uint8_t {
    kDiffuseColor,
    kEmissiveColor,
    kSpecularColor,
    kMetallic,
    kRoughness,
    kClearcoat,
    kClearcoatRoughness,
    kOpacity,
    kOpacityThreshold,
    kIor,
    kNormal,
};
inline constexpr int kMaterialSlots = 11;

/// A material on a mesh, with every name looked up, so that shading does none. Refers to the
/// material and the mesh, which must outlive it (the scene holds both between commits). Constant
/// once made: any thread may evaluate it.
struct MaterialBinding {
    const Material* material = nullptr;
    const Mesh* mesh = nullptr;
    std::vector<BoundTexture> textures;
    std::array<BoundInput, kMaterialSlots> inputs;
    const BoundTexture* normalTexture = nullptr; ///< of the normal input; null: none
    const Attribute* tangentUv = nullptr;        ///< coordinates that tangents follow; may be null

    SurfaceParameters<float> constants; ///< the constant inputs, in range; all if isConstant
    bool isConstant = false;            ///< evaluateMaterial() is a copy of `constants`
    bool onLanes = false;               ///< shading/materialLanes.h can evaluate what varies
    std::vector<MaterialSlot> varying;  ///< inputs that are textures or primvars

    MaterialBinding() = default;
    // normalTexture points into `textures`, whose heap block moves with it but is not shared.
    MaterialBinding(MaterialBinding&&) = default;
    MaterialBinding& operator=(MaterialBinding&&) = default;
    MaterialBinding(const MaterialBinding&) = delete;
    MaterialBinding& operator=(const MaterialBinding&) = delete;
    ~MaterialBinding() = default;
};

/// Resolves the names that `material` uses on `mesh`. Texture coordinates that are missing or too
/// narrow are reported once, naming `geometryPath`; the texture is then read at its stFallback.
/// A primvar input that the mesh lacks silently takes its fallback, as UsdPrimvarReader does.
MaterialBinding bindMaterial(const Material& material, const Mesh& mesh,
                             const std::string& geometryPath, Diagnostics& diagnostics);

/// The closure inputs at (1 - b1 - b2, b1, b2) of a triangle: textures and primvars looked up,
/// every value in its legal range. What is not finite becomes the specification's default.
/// opacity is 1 where it means a cut-out (presence mode, a threshold above 0): what is left of
/// such a surface is opaque.
SurfaceParameters<float> evaluateMaterial(const MaterialBinding& binding, std::uint32_t triangle,
                                          float b1, float b2);

/// Probability that the surface is there at all, 0..1: with a threshold above 0, whether opacity
/// reaches it; else opacity in presence mode; else 1.
float evaluateOpacity(const MaterialBinding& binding, std::uint32_t triangle, float b1, float b2);

/// An attribute at a point of a triangle. Components beyond its width are 0, but w is 1. An absent
/// attribute is (0, 0, 0, 1).
Float4 evaluateAttribute(const Attribute& attribute, const Mesh& mesh, std::uint32_t triangle,
                         float b1, float b2);

/// Derivatives of the object-space position by the texture coordinates that the normal map is read
/// at (after UsdTransform2d). Not unit, not orthogonal.
struct TangentFrame {
    Float3 dpdu{1.0F, 0.0F, 0.0F};
    Float3 dpdv{0.0F, 1.0F, 0.0F};
};

/// The tangents of a triangle. Where the coordinates are missing or collapse, any two directions
/// in the triangle's plane; for a triangle without area, x and y. Always finite and not zero.
TangentFrame tangentFrame(const MaterialBinding& binding, std::uint32_t triangle);

} // namespace mbfeat
