#include "integrate/census.h"

#include <array>
#include <utility>

namespace mbfeat {

namespace {

using Source = MaterialInput::Source;

bool isAbove(const MaterialInput& input, float threshold) {
    return input.source != Source::kConstant || input.value.x > threshold;
}

struct MaterialEffects {
    bool transmission = false, roughGlass = false, clearcoat = false, metal = false;
    bool cutouts = false, textures = false, normalMaps = false, emission = false;

    void add(const Material& material) {
        transmission |= material.mayTransmit();
        roughGlass |= material.mayTransmit() && isAbove(material.roughness, 0.0F);
        clearcoat |= isAbove(material.clearcoat, 0.0F);
        metal |= isAbove(material.metallic, 0.0F);
        cutouts |= material.mayCutOut();
        textures |= !material.textures.empty();
        normalMaps |= material.normal.source != Source::kConstant;
        emission |= material.emits();
    }
};

} // namespace

EffectCensus takeCensus(Scene& scene, const Accel& accel, const LightSampler& lights) {
    MaterialEffects effects;
    EffectCensus census;
    for (const std::unique_ptr<AccelGeometry>& geometry : accel.geometries()) {
        for (const MaterialBinding& binding : geometry->bindings) {
            effects.add(*binding.material);
        }
    }
    bool lightTextures = false;
    for (const std::shared_ptr<const Light>& light : scene.lights()) {
        lightTextures |= light->image != nullptr;
    }
    const std::array<std::pair<const char*, bool>, 13> found{{
        {"transmission", effects.transmission},
        {"rough glass", effects.roughGlass},
        {"clearcoat", effects.clearcoat},
        {"metal", effects.metal},
        {"cutouts", effects.cutouts},
        {"textures", effects.textures},
        {"normal maps", effects.normalMaps},
        {"emissive geometry", !accel.emissiveTriangles().empty()},
        {"environment", lights.environmentCount() > 0},
        {"area lights", lights.shapeCount() > 0},
        {"light textures", lightTextures},
        {"many lights", lights.activeLightCount() > 16},
        {"instancing", accel.instanceCount() > 0},
    }};
    for (const auto& [name, present] : found) {
        (present ? census.present : census.absent).emplace_back(name);
    }
    census.triangles = accel.triangleCount();
    census.instances = accel.instanceCount();
    census.lights = lights.activeLightCount();
    census.textureBytes = scene.textures().bytes();
    return census;
}

} // namespace mbfeat
