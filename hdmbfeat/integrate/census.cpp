#include "integrate/census.h"

#include <algorithm>
#include <set>
#include <utility>

namespace mbfeat {

namespace {

using Source = MaterialInput::Source;

/// As many askers as a reader wants to see of each effect.
constexpr std::size_t kListed = 8;

const BoundInput& inputOf(const MaterialBinding& binding, MaterialSlot slot) {
    return binding.inputs[static_cast<std::size_t>(slot)];
}

bool isConstant(const MaterialBinding& binding, MaterialSlot slot) {
    return inputOf(binding, slot).source == Source::kConstant;
}

/// Whether an input can be above the threshold, which is below its range's end.
bool mayExceed(const MaterialBinding& binding, MaterialSlot slot, float constant, float threshold) {
    return !isConstant(binding, slot) || constant > threshold;
}

/// What a material on a mesh calls for. It must be the truth about evaluateMaterial(): kernels
/// leave out what is not in it.
EffectSet effectsOf(const MaterialBinding& binding) {
    const Material& material = *binding.material;
    const SurfaceParameters<float>& constants = binding.constants;
    EffectSet found;
    const auto add = [&found](Effect effect, bool present) {
        found |= present ? EffectSet(effect) : EffectSet();
    };
    const bool metal = mayExceed(binding, MaterialSlot::kMetallic, constants.metallic, 0.0F);
    const bool specular = material.useSpecularWorkflow;
    const bool alwaysCutOut = material.opacityMode == OpacityMode::kPresence ||
                              (isConstant(binding, MaterialSlot::kOpacityThreshold) &&
                               material.opacityThreshold.source == Source::kConstant &&
                               material.opacityThreshold.value.x > 0.0F);
    const bool transmits =
        !alwaysCutOut && (!isConstant(binding, MaterialSlot::kOpacity) || constants.opacity < 1.0F);
    add(Effect::kReflection, metal || specular || transmits ||
                                 !isConstant(binding, MaterialSlot::kIor) || constants.ior != 1.0F);
    add(Effect::kMetal, metal);
    add(Effect::kSpecularWorkflow, specular);
    add(Effect::kClearcoat,
        mayExceed(binding, MaterialSlot::kClearcoat, constants.clearcoat, 0.0F));
    add(Effect::kTransmission, transmits);
    add(Effect::kRoughGlass,
        transmits && mayExceed(binding, MaterialSlot::kRoughness, constants.roughness, 0.0F));
    add(Effect::kCutouts, material.mayCutOut());
    add(Effect::kNormalMaps, !isConstant(binding, MaterialSlot::kNormal) ||
                                 constants.tangentNormal.x != 0.0F ||
                                 constants.tangentNormal.y != 0.0F);
    add(Effect::kEmissiveGeometry, material.emits());
    for (const MaterialSlot slot : binding.varying) {
        const Source source = inputOf(binding, slot).source;
        add(Effect::kTextures, source == Source::kTexture && slot != MaterialSlot::kNormal);
        add(Effect::kPrimvars, source == Source::kPrimvar);
    }
    return found;
}

/// What a light calls for.
EffectSet effectsOf(const Light& light) {
    EffectSet found;
    const auto add = [&found](Effect effect, bool present) {
        found |= present ? EffectSet(effect) : EffectSet();
    };
    add(Effect::kLightTextures, light.image != nullptr);
    add(Effect::kLightShaping, light.shaping.isOn());
    add(Effect::kLightMultipliers, light.diffuse != 1.0F || light.specular != 1.0F);
    add(Effect::kShadowlessLights, !light.castsShadows);
    return found;
}

void addAll(EffectCensus& census, EffectSet effects, const std::string& asker) {
    for (const EffectDescriptor& row : effectTable()) {
        if (effects.has(row.effect)) {
            census.add(row.effect, asker);
        }
    }
}

void addMaterials(EffectCensus& census, const Accel& accel) {
    std::set<std::pair<const Material*, std::uint64_t>> seen;
    for (const std::unique_ptr<AccelGeometry>& geometry : accel.geometries()) {
        const std::string& path = geometry->source->path;
        for (const MaterialBinding& binding : geometry->bindings) {
            const EffectSet effects = effectsOf(binding);
            if (!effects.empty() && seen.emplace(binding.material, effects.bits()).second) {
                // The default material has no prim: the mesh is what asks.
                addAll(census, effects,
                       binding.material->path.empty() ? path : binding.material->path);
            }
        }
        if (geometry->instanced) {
            census.add(Effect::kInstancing, path);
        }
    }
}

void addLights(EffectCensus& census, const Scene& scene, const LightSampler& lights) {
    const auto pathOf = [&scene](std::uint32_t light) { return scene.lights()[light]->path; };
    for (std::uint32_t i = 0; i < scene.lights().size(); ++i) {
        if (lights.isActive(i)) {
            addAll(census, effectsOf(*scene.lights()[i]), pathOf(i));
        }
    }
    for (std::uint32_t e = 0; e < lights.environmentCount(); ++e) {
        census.add(Effect::kEnvironment, pathOf(lights.lightOfEnvironment(e)));
    }
    for (std::uint32_t s = 0; s < lights.shapeCount(); ++s) {
        const std::string path = pathOf(lights.lightOfShape(s));
        census.add(Effect::kAreaLights, path);
        if (lights.shapeCount() > kMostLooseShapes) {
            census.add(Effect::kManyLights, path);
        }
    }
    if (lights.choiceCount() > 1) {
        for (std::uint32_t i = 0; i < scene.lights().size(); ++i) {
            if (lights.isActive(i)) {
                census.add(Effect::kSeveralLights, pathOf(i));
            }
        }
        const EffectUse glowing = census.uses[static_cast<std::size_t>(Effect::kEmissiveGeometry)];
        for (const std::string& path : glowing.first) {
            census.add(Effect::kSeveralLights, path);
        }
    }
}

} // namespace

EffectSet EffectCensus::effects() const {
    EffectSet found;
    for (const EffectDescriptor& row : effectTable()) {
        if (uses[static_cast<std::size_t>(row.effect)].count > 0) {
            found |= row.effect;
        }
    }
    return found;
}

void EffectCensus::add(Effect effect, const std::string& asker) {
    EffectUse& use = uses[static_cast<std::size_t>(effect)];
    ++use.count;
    if (use.first.size() < kListed &&
        std::find(use.first.begin(), use.first.end(), asker) == use.first.end()) {
        use.first.push_back(asker);
    }
}

void EffectCensus::nameEffects() {
    present = effectNames(effects());
    absent = effectNames(EffectSet::all() - effects());
}

EffectCensus takeCensus(Scene& scene, const Accel& accel, const LightSampler& lights) {
    EffectCensus census;
    addMaterials(census, accel);
    addLights(census, scene, lights);
    census.triangles = accel.triangleCount();
    census.instances = accel.instanceCount();
    census.lights = lights.activeLightCount();
    census.textureBytes = scene.textures().bytes();
    return census;
}

} // namespace mbfeat
