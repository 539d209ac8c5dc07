#include "scene/takenEffects.h"

#include <array>

namespace mbfeat {

namespace {

using Source = MaterialInput::Source;

/// Mean of an image as its texture node gives it, over a grid of look-ups.
Float4 meanOf(const TextureNode& node, const Image* image) {
    if (image == nullptr) {
        return node.fallback;
    }
    constexpr int kSide = 32;
    double sum[4] = {};
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const Float2 st((static_cast<float>(x) + 0.5F) / kSide,
                            (static_cast<float>(y) + 0.5F) / kSide);
            const Float4 t = image->sample(st, Wrap::kClamp, Wrap::kClamp);
            const float values[4] = {t.x, t.y, t.z, t.w};
            for (int c = 0; c < 4; ++c) {
                sum[c] += static_cast<double>(values[c]);
            }
        }
    }
    const auto channel = [&](int c) { return static_cast<float>(sum[c] / (kSide * kSide)); };
    return {fma(channel(0), node.scale.x, node.bias.x), fma(channel(1), node.scale.y, node.bias.y),
            fma(channel(2), node.scale.z, node.bias.z), fma(channel(3), node.scale.w, node.bias.w)};
}

void makeConstant(MaterialInput& input, const Float3& value) {
    input = MaterialInput(value);
}

void takeTextures(Material& material, MaterialInput& input) {
    const auto index = static_cast<std::size_t>(input.texture);
    if (input.source != Source::kTexture || input.texture < 0 ||
        index >= material.textures.size()) {
        return;
    }
    const Float4 mean = meanOf(material.textures[index], material.images[index].get());
    const std::array<float, 4> all{mean.x, mean.y, mean.z, mean.w};
    const auto at = [&](int channel) {
        return all[static_cast<std::size_t>(std::min(std::max(channel, 0), 3))];
    };
    makeConstant(input, {at(input.channel), at(input.channel + 1), at(input.channel + 2)});
}

/// The inputs that are rendered, but the normal.
std::array<MaterialInput*, 10> inputsOf(Material& m) {
    return {
        &m.diffuseColor, &m.emissiveColor,      &m.specularColor, &m.metallic,         &m.roughness,
        &m.clearcoat,    &m.clearcoatRoughness, &m.opacity,       &m.opacityThreshold, &m.ior};
}

bool isAreaLight(const Light& light) {
    switch (light.type) {
    case LightType::kRect:
    case LightType::kDisk:
    case LightType::kCylinder:
        return true;
    case LightType::kSphere:
        return !light.treatAsPoint;
    case LightType::kDistant:
    case LightType::kDome:
        break;
    }
    return false;
}

bool isEnvironment(const Light& light) {
    return light.type == LightType::kDome ||
           (light.type == LightType::kDistant && light.angle > 0.0F);
}

} // namespace

void takeEffectsFrom(Material& material, EffectSet taken) {
    for (MaterialInput* const input : inputsOf(material)) {
        if (taken.has(Effect::kTextures)) {
            takeTextures(material, *input);
        }
        if (taken.has(Effect::kPrimvars) && input->source == Source::kPrimvar) {
            makeConstant(*input, input->value);
        }
    }
    if (taken.has(Effect::kNormalMaps)) {
        makeConstant(material.normal, {0.0F, 0.0F, 1.0F});
    }
    if (taken.has(Effect::kMetal)) {
        makeConstant(material.metallic, Float3(0.0F));
    }
    if (taken.has(Effect::kSpecularWorkflow)) {
        material.useSpecularWorkflow = false;
    }
    if (taken.has(Effect::kClearcoat)) {
        makeConstant(material.clearcoat, Float3(0.0F));
    }
    const bool cutsOut = material.mayCutOut();
    if (taken.has(Effect::kRoughGlass) && material.mayTransmit() && !cutsOut) {
        makeConstant(material.roughness, Float3(0.0F));
    }
    if ((taken.has(Effect::kCutouts) && cutsOut) ||
        (taken.has(Effect::kTransmission) && material.mayTransmit() && !cutsOut)) {
        makeConstant(material.opacity, Float3(1.0F));
    }
    if (taken.has(Effect::kEmissiveGeometry)) {
        makeConstant(material.emissiveColor, Float3(0.0F));
    }
}

void takeEffectsFrom(Light& light, EffectSet taken) {
    if (taken.has(Effect::kLightTextures)) {
        light.hasTexture = false;
        light.image = nullptr;
    }
    if (taken.has(Effect::kLightShaping)) {
        light.shaping = LightShaping();
    }
    if (taken.has(Effect::kLightMultipliers)) {
        light.diffuse = light.specular = 1.0F;
    }
    if (taken.has(Effect::kShadowlessLights)) {
        light.castsShadows = true;
    }
}

bool isTakenAway(const Light& light, EffectSet taken) {
    return (taken.has(Effect::kAreaLights) && isAreaLight(light)) ||
           (taken.has(Effect::kEnvironment) && isEnvironment(light));
}

} // namespace mbfeat
