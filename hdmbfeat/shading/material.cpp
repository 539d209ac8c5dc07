#include "shading/material.h"

#include <algorithm>
#include <limits>

#include "core/floatTraps.h"
#include "core/frame.h"
#include "shading/materialInputs.h"

namespace mbfeat {

namespace {

const MaterialInput& inputOf(const Material& material, MaterialSlot slot) {
    switch (slot) {
    case MaterialSlot::kDiffuseColor:
        return material.diffuseColor;
    case MaterialSlot::kEmissiveColor:
        return material.emissiveColor;
    case MaterialSlot::kSpecularColor:
        return material.specularColor;
    case MaterialSlot::kMetallic:
        return material.metallic;
    case MaterialSlot::kRoughness:
        return material.roughness;
    case MaterialSlot::kClearcoat:
        return material.clearcoat;
    case MaterialSlot::kClearcoatRoughness:
        return material.clearcoatRoughness;
    case MaterialSlot::kOpacity:
        return material.opacity;
    case MaterialSlot::kOpacityThreshold:
        return material.opacityThreshold;
    case MaterialSlot::kIor:
        return material.ior;
    case MaterialSlot::kNormal:
        break;
    }
    return material.normal;
}

Float2 transformed(const BoundTexture& texture, const Float2& st) {
    return texture.x * st.x + texture.y * st.y + texture.translation;
}

/// Texture coordinates of a bound texture at a point, after its transform.
Float2 coordinates(const BoundTexture& texture, const Mesh& mesh, std::uint32_t triangle, float b1,
                   float b2) {
    if (texture.uv == nullptr) {
        return transformed(texture, texture.node->stFallback);
    }
    const Float4 st = evaluateAttribute(*texture.uv, mesh, triangle, b1, b2);
    return transformed(texture, {st.x, st.y});
}

/// The value of a texture: scale and bias are for texels, the fallback is what it says.
Float4 lookUp(const BoundTexture& texture, const Mesh& mesh, std::uint32_t triangle, float b1,
              float b2) {
    const TextureNode& node = *texture.node;
    if (texture.image == nullptr) {
        return node.fallback;
    }
    const Float2 st = coordinates(texture, mesh, triangle, b1, b2);
    const Float4 t = texture.image->sample(st, node.wrapS, node.wrapT);
    return {fma(t.x, node.scale.x, node.bias.x), fma(t.y, node.scale.y, node.bias.y),
            fma(t.z, node.scale.z, node.bias.z), fma(t.w, node.scale.w, node.bias.w)};
}

/// Texture values of one hit: inputs that read other channels of the same texture share one
/// look-up.
class TextureValues {
public:
    TextureValues(const MaterialBinding& binding, std::uint32_t triangle, float b1, float b2)
        : binding_(binding),
          triangle_(triangle),
          b1_(b1),
          b2_(b2) {}

    Float4 get(int index) {
        const BoundTexture& texture = binding_.textures[static_cast<std::size_t>(index)];
        if (index >= kKept) {
            return lookUp(texture, *binding_.mesh, triangle_, b1_, b2_);
        }
        const std::uint32_t bit = 1U << static_cast<unsigned>(index);
        if ((known_ & bit) == 0U) {
            kept_[static_cast<std::size_t>(index)] =
                lookUp(texture, *binding_.mesh, triangle_, b1_, b2_);
            known_ |= bit;
        }
        return kept_[static_cast<std::size_t>(index)];
    }

private:
    static constexpr int kKept = kMaterialSlots;
    const MaterialBinding& binding_;
    std::uint32_t triangle_;
    float b1_, b2_;
    std::uint32_t known_ = 0;
    std::array<Float4, kKept> kept_;
};

Float3 evaluateInput(const MaterialBinding& binding, MaterialSlot slot, std::uint32_t triangle,
                     float b1, float b2, TextureValues& textures) {
    const BoundInput& bound = binding.inputs[static_cast<std::size_t>(slot)];
    if (bound.source == MaterialInput::Source::kTexture) {
        return material::channels(textures.get(bound.input->texture), bound.input->channel);
    }
    if (bound.source == MaterialInput::Source::kPrimvar) {
        const Float4 v = evaluateAttribute(*bound.primvar, *binding.mesh, triangle, b1, b2);
        // One value for a colour is a grey.
        return bound.primvar->width == 1 ? Float3(v.x) : Float3(v.x, v.y, v.z);
    }
    return bound.input->value;
}

BoundTexture bindTexture(const Material& material, std::size_t index, const Mesh& mesh) {
    const TextureNode& node = material.textures[index];
    BoundTexture bound;
    bound.node = &node;
    bound.image = index < material.images.size() ? material.images[index].get() : nullptr;
    const Attribute* uv = mesh.findPrimvar(node.uvPrimvar);
    bound.uv = uv != nullptr && uv->width >= 2 ? uv : nullptr;

    const double angle = static_cast<double>(node.stRotation) * (static_cast<double>(kPi) / 180.0);
    const auto cosine = static_cast<float>(std::cos(angle));
    const auto sine = static_cast<float>(std::sin(angle));
    bound.x = Float2(cosine, sine) * node.stScale.x;
    bound.y = Float2(-sine, cosine) * node.stScale.y;
    bound.translation = node.stTranslation;
    return bound;
}

void reportMissingCoordinates(const Material& material, const BoundTexture& texture,
                              const Mesh& mesh, const std::string& geometryPath,
                              Diagnostics& diagnostics) {
    const std::string& name = texture.node->uvPrimvar;
    const bool narrow = mesh.findPrimvar(name) != nullptr;
    const std::string problem =
        narrow ? "its primvar '" + name + "' has one component where texture coordinates need two"
               : "it has no usable primvar '" + name + "' for texture coordinates";
    diagnostics.warn(geometryPath, problem + ", which the material " + material.path +
                                       " reads; its textures are read at one point instead. "
                                       "Author primvars:" +
                                       name + " as texCoord2f[].");
}

BoundInput bindInput(const MaterialInput& input, const MaterialBinding& binding) {
    BoundInput bound;
    bound.input = &input;
    bound.source = input.source;
    if (input.source == MaterialInput::Source::kTexture) {
        const bool exists = input.texture >= 0 &&
                            static_cast<std::size_t>(input.texture) < binding.textures.size() &&
                            input.channel >= 0;
        bound.source = exists ? input.source : MaterialInput::Source::kConstant;
    } else if (input.source == MaterialInput::Source::kPrimvar) {
        const Attribute* primvar = binding.mesh->findPrimvar(input.primvar);
        const bool exists = primvar != nullptr && *primvar;
        bound.primvar = exists ? primvar : nullptr;
        bound.source = exists ? input.source : MaterialInput::Source::kConstant;
    }
    return bound;
}

/// True where opacity decides whether the surface is there, not how much light it lets through.
bool isCutOut(const MaterialBinding& binding, float threshold) {
    return threshold > 0.0F || binding.material->opacityMode == OpacityMode::kPresence;
}

float thresholdAt(const MaterialBinding& binding, std::uint32_t triangle, float b1, float b2,
                  TextureValues& textures) {
    const Float3 value =
        evaluateInput(binding, MaterialSlot::kOpacityThreshold, triangle, b1, b2, textures);
    return material::inRange(value.x, material::kThreshold);
}

/// Whether what varies is evaluated on lanes: all but cut-outs, images that lanes do not read, and
/// arrays whose places 32 bits do not number.
bool fitsLanes(const MaterialBinding& binding, bool cutsOut) {
    const auto fits = [](const Attribute* attribute) {
        constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
        return attribute == nullptr || (*attribute && attribute->values.size() < kMost);
    };
    constexpr auto kMostTriangles =
        static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max() / 3);
    return !cutsOut && binding.mesh->triangles.size() < kMostTriangles &&
           std::all_of(binding.varying.begin(), binding.varying.end(), [&](MaterialSlot slot) {
               const BoundInput& bound = binding.inputs[static_cast<std::size_t>(slot)];
               if (bound.source == MaterialInput::Source::kPrimvar) {
                   return fits(bound.primvar);
               }
               const int index = bound.input->texture;
               const BoundTexture& texture = binding.textures[static_cast<std::size_t>(index)];
               return index < kMaterialSlots && fits(texture.uv) &&
                      (texture.image == nullptr || texture.image->hasLanes());
           });
}

bool isVarying(const MaterialBinding& binding, MaterialSlot slot) {
    return binding.inputs[static_cast<std::size_t>(slot)].source !=
           MaterialInput::Source::kConstant;
}

void bindNormalMap(MaterialBinding& binding) {
    const BoundInput& normal = binding.inputs[static_cast<std::size_t>(MaterialSlot::kNormal)];
    if (normal.source == MaterialInput::Source::kTexture) {
        binding.normalTexture = &binding.textures[static_cast<std::size_t>(normal.input->texture)];
        binding.tangentUv = binding.normalTexture->uv;
    } else {
        const Attribute* st = binding.mesh->findPrimvar("st");
        binding.tangentUv = st != nullptr && st->width >= 2 ? st : nullptr;
    }
}

/// Texture coordinates that tangents follow.
Float2 tangentCoordinates(const MaterialBinding& binding, std::uint32_t triangle, float b1,
                          float b2) {
    if (binding.normalTexture != nullptr) {
        return coordinates(*binding.normalTexture, *binding.mesh, triangle, b1, b2);
    }
    const Float4 st = evaluateAttribute(*binding.tangentUv, *binding.mesh, triangle, b1, b2);
    return {st.x, st.y};
}

bool isDirection(const Float3& v) {
    const float squared = lengthSquared(v);
    return squared > 0.0F && std::isfinite(squared);
}

} // namespace

MaterialBinding bindMaterial(const Material& material, const Mesh& mesh,
                             const std::string& geometryPath, Diagnostics& diagnostics) {
    MaterialBinding binding;
    binding.material = &material;
    binding.mesh = &mesh;
    binding.constants.useSpecularWorkflow = material.useSpecularWorkflow;
    for (std::size_t i = 0; i < material.textures.size(); ++i) {
        binding.textures.push_back(bindTexture(material, i, mesh));
    }

    // Authors may write anything: what comes out of it is brought into range.
    const FloatTrapsMasked anything;
    TextureValues unread(binding, 0, 0.0F, 0.0F);
    for (int i = 0; i < kMaterialSlots; ++i) {
        const auto slot = static_cast<MaterialSlot>(i);
        BoundInput& bound = binding.inputs[static_cast<std::size_t>(i)];
        bound = bindInput(inputOf(material, slot), binding);
        if (bound.source == MaterialInput::Source::kConstant) {
            material::store(slot, evaluateInput(binding, slot, 0, 0.0F, 0.0F, unread),
                            binding.constants);
            continue;
        }
        binding.varying.push_back(slot);
        if (bound.source == MaterialInput::Source::kTexture) {
            const BoundTexture& texture =
                binding.textures[static_cast<std::size_t>(bound.input->texture)];
            const bool readsPrimvar = !texture.node->uvPrimvar.empty(); // else a constant
            if (readsPrimvar && texture.uv == nullptr && texture.image != nullptr) {
                reportMissingCoordinates(material, texture, mesh, geometryPath, diagnostics);
            }
        }
    }
    bindNormalMap(binding);

    binding.isConstant = binding.varying.empty();
    bool cutsOut = true; // as far as is known
    if (!isVarying(binding, MaterialSlot::kOpacityThreshold)) {
        cutsOut = isCutOut(binding, thresholdAt(binding, 0, 0.0F, 0.0F, unread));
        if (cutsOut && binding.isConstant) {
            binding.constants.opacity = 1.0F;
        }
    }
    const bool opaque =
        !isVarying(binding, MaterialSlot::kOpacity) && binding.constants.opacity == 1.0F;
    binding.onLanes = fitsLanes(binding, cutsOut && !opaque);
    return binding;
}

SurfaceParameters<float> evaluateMaterial(const MaterialBinding& binding, std::uint32_t triangle,
                                          float b1, float b2) {
    SurfaceParameters<float> parameters = binding.constants;
    if (binding.isConstant) {
        return parameters;
    }
    // Authors may write anything: what comes out of it is brought into range.
    const FloatTrapsMasked anything;
    TextureValues textures(binding, triangle, b1, b2);
    for (const MaterialSlot slot : binding.varying) {
        material::store(slot, evaluateInput(binding, slot, triangle, b1, b2, textures), parameters);
    }
    if (parameters.opacity < 1.0F &&
        isCutOut(binding, thresholdAt(binding, triangle, b1, b2, textures))) {
        parameters.opacity = 1.0F;
    }
    return parameters;
}

float evaluateOpacity(const MaterialBinding& binding, std::uint32_t triangle, float b1, float b2) {
    // Authors may write anything: what comes out of it is brought into range.
    const FloatTrapsMasked anything;
    TextureValues textures(binding, triangle, b1, b2);
    const float threshold = thresholdAt(binding, triangle, b1, b2, textures);
    if (!isCutOut(binding, threshold)) {
        return 1.0F;
    }
    const Float3 value = evaluateInput(binding, MaterialSlot::kOpacity, triangle, b1, b2, textures);
    const float opacity = material::inRange(value.x, material::kOpacity);
    if (threshold > 0.0F) {
        return opacity >= threshold ? 1.0F : 0.0F;
    }
    return opacity;
}

Float4 evaluateAttribute(const Attribute& attribute, const Mesh& mesh, std::uint32_t triangle,
                         float b1, float b2) {
    float result[4] = {0.0F, 0.0F, 0.0F, 1.0F};
    const int width = attribute.width;
    const float* values = attribute.values.data();
    const auto at = [&](std::size_t index) {
        return values + index * static_cast<std::size_t>(width);
    };
    const auto blend = [&](const float* v0, const float* v1, const float* v2) {
        const float b0 = (1.0F - b1) - b2;
        for (int i = 0; i < width; ++i) {
            result[i] = fma(b0, v0[i], fma(b1, v1[i], b2 * v2[i]));
        }
    };
    if (!attribute) {
        return {result[0], result[1], result[2], result[3]};
    }
    switch (attribute.interpolation) {
    case Interpolation::kConstant:
        std::copy_n(values, width, result);
        break;
    case Interpolation::kUniform:
        std::copy_n(at(mesh.faceOf(triangle)), width, result);
        break;
    case Interpolation::kVertex: {
        const Triangle& t = mesh.triangles[triangle];
        blend(at(t.v[0]), at(t.v[1]), at(t.v[2]));
        break;
    }
    case Interpolation::kFaceVarying: {
        const std::size_t first = std::size_t(3) * triangle;
        blend(at(first), at(first + 1), at(first + 2));
        break;
    }
    }
    return {result[0], result[1], result[2], result[3]};
}

TangentFrame tangentFrame(const MaterialBinding& binding, std::uint32_t triangle) {
    const Triangle& t = binding.mesh->triangles[triangle];
    const std::vector<Float3>& points = binding.mesh->points;
    const Float3 e1 = points[t.v[1]] - points[t.v[0]];
    const Float3 e2 = points[t.v[2]] - points[t.v[0]];
    if (binding.tangentUv != nullptr) {
        const Float2 origin = tangentCoordinates(binding, triangle, 0.0F, 0.0F);
        const Float2 d1 = tangentCoordinates(binding, triangle, 1.0F, 0.0F) - origin;
        const Float2 d2 = tangentCoordinates(binding, triangle, 0.0F, 1.0F) - origin;
        const float det = differenceOfProducts(d1.x, d2.y, d1.y, d2.x);
        const float extent = (abs(d1.x) + abs(d1.y)) * (abs(d2.x) + abs(d2.y));
        // Below this the area is rounding of the coordinates, and its sign would be noise.
        if (std::isfinite(extent) && abs(det) > 1e-6F * extent) {
            const TangentFrame frame{(e1 * d2.y - e2 * d1.y) / det, (e2 * d1.x - e1 * d2.x) / det};
            if (isDirection(frame.dpdu) && isDirection(frame.dpdv)) {
                return frame;
            }
        }
    }
    // Scaled, so that the area of a tiny triangle does not underflow.
    const float size = max(maxComponent(abs(e1)), maxComponent(abs(e2)));
    const Float3 normal = size > 0.0F ? cross(e1 / size, e2 / size) : Float3(0.0F);
    if (!isDirection(normal)) {
        return {};
    }
    const Frame<float> frame = Frame<float>::fromNormal(normalize(normal));
    return {frame.s, frame.t};
}

} // namespace mbfeat
