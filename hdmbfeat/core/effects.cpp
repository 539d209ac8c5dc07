#include "core/effects.h"

#include <algorithm>
#include <string_view>

#include "core/editDistance.h"
#include "core/text.h"

namespace mbfeat {

namespace {

constexpr std::array<EffectDescriptor, kEffectCount> kTable{{
    {Effect::kReflection, "reflection",
     "a material's surface reflects: its ior is not 1, it is a metal, or it has a specular colour",
     nullptr},
    {Effect::kMetal, "metal", "a material's metallic is above 0", "metallic 0"},
    {Effect::kSpecularWorkflow, "specular workflow", "a material uses the specular workflow",
     "the metallic workflow"},
    {Effect::kClearcoat, "clearcoat", "a material's clearcoat is above 0", "clearcoat 0"},
    {Effect::kTransmission, "transmission",
     "a material's opacity is below 1 in transparent mode, without a threshold", "opacity 1"},
    {Effect::kRoughGlass, "rough glass", "a material that transmits is rough",
     "roughness 0 where light passes"},
    {Effect::kCutouts, "cutouts", "a material's opacity cuts holes: presence mode or a threshold",
     "opacity 1"},
    {Effect::kTextures, "textures", "a material's input other than its normal reads an image",
     "the mean of the image"},
    {Effect::kNormalMaps, "normal maps", "a material's normal is not constant", "no bending"},
    {Effect::kPrimvars, "primvars", "a material's input reads a primvar of the mesh",
     "the input's fallback"},
    {Effect::kEmissiveGeometry, "emissive geometry", "a mesh emits", "emissiveColor 0"},
    {Effect::kEnvironment, "environment", "a dome, or a distant light of some width",
     "no such light"},
    {Effect::kAreaLights, "area lights", "a rect, disk, sphere or cylinder light of some size",
     "no such light"},
    {Effect::kLightTextures, "light textures", "a dome or rect light has an image",
     "white in its place"},
    {Effect::kLightShaping, "light shaping", "a light has a cone or a focus", "no shaping"},
    {Effect::kLightMultipliers, "light multipliers",
     "a light's diffuse or specular multiplier is not 1", "multipliers of 1"},
    {Effect::kShadowlessLights, "lights without shadows", "a light casts no shadows",
     "shadows as of other lights"},
    {Effect::kSeveralLights, "several lights",
     "there is more than one light or emissive triangle to choose from", nullptr},
    {Effect::kManyLights, "many lights",
     "more lights of some shape than are met one by one: they are in the acceleration structure",
     nullptr},
    {Effect::kInstancing, "instancing", "a mesh is instanced", nullptr},
    {Effect::kDepthOfField, "depth of field", "the camera has a lens", "a pinhole"},
    {Effect::kPathFeatures, "path features", "albedo, normal and direct of the six vertices",
     nullptr},
    {Effect::kContributions, "contributions", "what each vertex adds to the pixel", nullptr},
    {Effect::kExtendedFeatures, "extended features",
     "roughness, distance, throughput or event of the vertices", nullptr},
    {Effect::kFirstNonDelta, "first non-delta", "the first vertex that is no mirror", nullptr},
    {Effect::kFirstHit, "first hit", "ids, depths or normals of the camera ray's hit", nullptr},
    {Effect::kPrimvarAovs, "primvar AOVs", "a primvar is an AOV", nullptr},
    {Effect::kPathSamples, "path samples", "every path is kept", nullptr},
}};

Error wrongWord(std::string_view word, const std::string& nearest) {
    return {"mbfeat:effects", "\"" + std::string(word) +
                                  "\" is neither auto, full, +EFFECT nor -EFFECT; the nearest is "
                                  "\"" +
                                  nearest + "\""};
}

} // namespace

const std::array<EffectDescriptor, kEffectCount>& effectTable() {
    return kTable;
}

const char* effectName(Effect effect) {
    return kTable[static_cast<std::size_t>(effect)].name;
}

std::vector<std::string> effectNames(EffectSet set) {
    std::vector<std::string> names;
    for (const EffectDescriptor& row : kTable) {
        if (set.has(row.effect)) {
            names.emplace_back(row.name);
        }
    }
    return names;
}

Result<EffectRequest> parseEffects(const std::string& text) {
    const std::vector<std::string> names = effectNames(EffectSet::all());
    EffectRequest request;
    std::string_view rest(text);
    while (!rest.empty()) {
        const std::size_t comma = std::min(rest.find(','), rest.size());
        const std::string_view word = trimmed(rest.substr(0, comma));
        rest.remove_prefix(std::min(comma + 1, rest.size()));
        if (word == "full") {
            request.full = true;
            continue;
        }
        if (word.empty() || word == "auto") {
            continue;
        }
        const bool signedWord = word.front() == '+' || word.front() == '-';
        const std::string name(trimmed(word.substr(signedWord ? 1 : 0)));
        const auto found = std::find(names.begin(), names.end(), name);
        const char sign = word.front() == '-' ? '-' : '+';
        if (!signedWord || found == names.end()) {
            return wrongWord(word, sign + nearestName(name, names));
        }
        const EffectDescriptor& row = kTable[static_cast<std::size_t>(found - names.begin())];
        if (sign == '+') {
            request.forced |= row.effect;
        } else if (row.without != nullptr) {
            request.taken |= row.effect;
        } else {
            return Error{"mbfeat:effects", "\"" + std::string(word) +
                                               "\" cannot be taken away, since nothing could stand "
                                               "in its place"};
        }
    }
    return request;
}

} // namespace mbfeat
