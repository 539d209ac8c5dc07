#include "film/aovTable.h"

#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "core/editDistance.h"
#include "integrate/pathRecord.h"

namespace mbfeat {

namespace {

using Channels = std::vector<std::string>;

const Channels kRgb{"R", "G", "B"};
const Channels kXyz{"X", "Y", "Z"};
const Channels kDistance{"Z"};
const Channels kScalar{"Y"};
constexpr std::string_view kPrimvarPrefix = "primvars:";

AovDescriptor makeAov(std::string name, const Channels& channels, std::size_t recordOffset,
                      std::uint32_t recordFlags, std::string doc) {
    AovDescriptor aov;
    aov.name = std::move(name);
    aov.channels = channels;
    aov.recordOffset = recordOffset;
    aov.recordFlags = recordFlags;
    aov.doc = std::move(doc);
    return aov;
}

/// An AOV of the camera ray's hit that is taken from the sample nearest the pixel centre.
AovDescriptor makeNearest(std::string name, AovType type, const Channels& channels,
                          std::size_t recordOffset, float clearValue, std::string doc) {
    AovDescriptor aov =
        makeAov(std::move(name), channels, recordOffset, kRecordFirstHit, std::move(doc));
    aov.type = type;
    aov.reduction = AovReduction::kNearest;
    aov.clearValue = clearValue;
    return aov;
}

AovDescriptor makeCount(std::string name, std::size_t recordOffset, std::string doc) {
    AovDescriptor aov = makeAov(std::move(name), kScalar, recordOffset, 0, std::move(doc));
    aov.type = AovType::kInt;
    aov.reduction = AovReduction::kSum;
    return aov;
}

void addStandard(std::vector<AovDescriptor>& table) {
    table.push_back(makeAov("color", {"R", "G", "B", "A"}, offsetof(PathRecord, radiance), 0,
                            "Linear radiance in the rendering colour space, and alpha; "
                            "reconstructed where mbfeat:denoise:enabled is on."));
    table.push_back(makeAov("alpha", {"A"}, offsetof(PathRecord, alpha), 0,
                            "Share of the pixel that is not background, 0 to 1."));
    table.push_back(makeNearest("depth", AovType::kFloat, kDistance, offsetof(PathRecord, depth),
                                1.0F, "Projected depth, 0 at the near and 1 at the far plane."));
    table.push_back(makeNearest("cameraDepth", AovType::kFloat, kDistance,
                                offsetof(PathRecord, cameraDepth), 0.0F,
                                "Distance along the view axis, scene units; 0 at the background."));
    table.push_back(makeAov("normal", kXyz, offsetof(PathRecord, normal), kRecordFirstHit,
                            "Shading normal of the first hit, world space, facing the camera."));
    table.push_back(makeAov("Neye", kXyz, offsetof(PathRecord, eyeNormal), kRecordFirstHit,
                            "Shading normal of the first hit, camera space, facing the camera."));
    table.push_back(makeNearest("primId", AovType::kInt, kScalar, offsetof(PathRecord, primId),
                                -1.0F, "Hydra id of the prim that was hit; -1 at the background."));
    table.push_back(
        makeNearest("instanceId", AovType::kInt, kScalar, offsetof(PathRecord, instanceId), -1.0F,
                    "Index of the instance that was hit, 0 for a prim that is not instanced; -1 "
                    "at the background."));
    table.push_back(makeNearest("elementId", AovType::kInt, kScalar,
                                offsetof(PathRecord, elementId), -1.0F,
                                "Index of the authored face that was hit; -1 at the background."));
    table.push_back(makeAov("albedo", kRgb, offsetof(PathRecord, features), kRecordFeatures,
                            "Albedo of the first hit, 0 to 1: the same as mbfeat:albedo:0."));
    table.push_back(makeAov("mbfeat:raw", {"R", "G", "B", "A"}, offsetof(PathRecord, radiance), 0,
                            "The same as color, but never reconstructed by the denoiser."));
    AovDescriptor variance = makeAov("variance", kRgb, offsetof(PathRecord, radiance), 0,
                                     "Unbiased variance of the pixel's mean color; 0 with fewer "
                                     "than two samples.");
    variance.reduction = AovReduction::kVariance;
    table.push_back(std::move(variance));
    table.push_back(makeCount("sampleCount", kNoRecordField, "Number of samples of the pixel."));
    table.push_back(makeCount("nonFinite", offsetof(PathRecord, nonFinite),
                              "Number of samples that were not finite and were replaced by zero."));
}

AovDescriptor makeVertexAov(const char* feature, int vertex, const Channels& channels,
                            std::size_t recordOffset, std::uint32_t recordFlags,
                            const std::string& doc) {
    const std::string number = std::to_string(vertex);
    AovDescriptor aov = makeAov("mbfeat:" + std::string(feature) + ":" + number, channels,
                                recordOffset, recordFlags, doc);
    aov.vertex = vertex;
    return aov;
}

/// The paper's 18, vertex-major, as they lie in the record.
void addFeatures(std::vector<AovDescriptor>& table) {
    for (int k = 0; k < kFeatureVertices; ++k) {
        const std::size_t base = offsetof(PathRecord, features) + k * sizeof(VertexFeatures);
        const std::string at = " at vertex " + std::to_string(k);
        const std::string missing = "; zero for paths that did not reach it.";
        table.push_back(makeVertexAov("albedo", k, kRgb, base + offsetof(VertexFeatures, albedo),
                                      kRecordFeatures, "Albedo" + at + ", 0 to 1" + missing));
        table.push_back(makeVertexAov(
            "normal", k, kXyz, base + offsetof(VertexFeatures, normal), kRecordFeatures,
            "Shading normal" + at + ", world space, facing the ray" + missing));
        table.push_back(makeVertexAov(
            "direct", k, kRgb, base + offsetof(VertexFeatures, direct), kRecordFeatures,
            "Light-sampled radiance" + at + ", before path throughput" + missing));
    }
}

void addContributions(std::vector<AovDescriptor>& table) {
    for (int k = 0; k < kFeatureVertices; ++k) {
        table.push_back(makeVertexAov(
            "contribution", k, kRgb, offsetof(PathRecord, contributions) + k * sizeof(Rgb),
            kRecordContributions,
            "What vertex " + std::to_string(k) +
                " adds to color: its direct light and the "
                "emission that the ray leaving it meets, times the path's throughput."));
    }
    table.push_back(makeAov("mbfeat:contribution:emission", kRgb, offsetof(PathRecord, emission),
                            kRecordContributions,
                            "Emission and background that the camera ray itself sees."));
    table.push_back(makeAov(
        "mbfeat:contribution:tail", kRgb, offsetof(PathRecord, tail), kRecordContributions,
        "What all vertices from " + std::to_string(kFeatureVertices) + " on add to color."));
}

void addFirstNonDelta(std::vector<AovDescriptor>& table) {
    const std::string prefix = "mbfeat:firstNonDelta:";
    table.push_back(makeAov(prefix + "albedo", kRgb, offsetof(PathRecord, nonDeltaAlbedo),
                            kRecordFirstNonDelta,
                            "Albedo of the first vertex that is neither mirror nor clear "
                            "glass."));
    table.push_back(makeAov(prefix + "normal", kXyz, offsetof(PathRecord, nonDeltaNormal),
                            kRecordFirstNonDelta,
                            "Shading normal of the first vertex that is neither mirror nor "
                            "clear glass, world space."));
    table.push_back(makeAov(prefix + "depth", kDistance, offsetof(PathRecord, nonDeltaDepth),
                            kRecordFirstNonDelta,
                            "Length of the path to the first vertex that is neither mirror "
                            "nor clear glass, scene units."));
    table.push_back(makeAov(prefix + "tint", kRgb, offsetof(PathRecord, nonDeltaTint),
                            kRecordFirstNonDelta,
                            "Throughput of the path to the first vertex that is neither "
                            "mirror nor clear glass, without the choice between reflection and "
                            "refraction."));
}

void addExtended(std::vector<AovDescriptor>& table) {
    for (int k = 0; k < kFeatureVertices; ++k) {
        const std::size_t base = offsetof(PathRecord, extended) + k * sizeof(VertexExtended);
        const std::string number = std::to_string(k);
        table.push_back(makeVertexAov("roughness", k, kScalar,
                                      base + offsetof(VertexExtended, roughness), kRecordExtended,
                                      "Roughness of the lobe that continued the path at vertex " +
                                          number + "; 1 is diffuse."));
        table.push_back(makeVertexAov(
            "distance", k, kDistance, base + offsetof(VertexExtended, distance), kRecordExtended,
            "Distance from the previous vertex to vertex " + number + ", scene units."));
        table.push_back(makeVertexAov("throughput", k, kRgb,
                                      base + offsetof(VertexExtended, throughput), kRecordExtended,
                                      "Throughput of the path up to vertex " + number + "."));
        AovDescriptor event = makeVertexAov(
            "event", k, kScalar, base + offsetof(VertexExtended, event), kRecordExtended,
            "Scattering at vertex " + number +
                ": bits 1 reflect, 2 transmit, 4 diffuse, 8 glossy, "
                "16 specular, 32 emission; 0 where the path ended.");
        event.type = AovType::kInt;
        event.reduction = AovReduction::kNearest;
        table.push_back(std::move(event));
    }
}

std::vector<AovDescriptor> makeTable() {
    std::vector<AovDescriptor> table;
    addStandard(table);
    addFeatures(table);
    addContributions(table);
    addFirstNonDelta(table);
    addExtended(table);
    return table;
}

AovDescriptor makePrimvar(const std::string& name) {
    const std::string primvar = name.substr(kPrimvarPrefix.size());
    const Channels channels = primvar == "displayColor"     ? kRgb
                              : primvar == "displayOpacity" ? Channels{"A"}
                                                            : kXyz;
    return makeAov(name, channels, offsetof(PathRecord, primvars), kRecordPrimvars,
                   "Value of the primvar " + primvar + " at the first hit.");
}

} // namespace

const std::vector<AovDescriptor>& aovTable() {
    static const std::vector<AovDescriptor> table = makeTable();
    return table;
}

std::optional<AovDescriptor> findAov(const std::string& name) {
    if (name.size() > kPrimvarPrefix.size() &&
        name.compare(0, kPrimvarPrefix.size(), kPrimvarPrefix) == 0) {
        return makePrimvar(name);
    }
    static const std::unordered_map<std::string, std::size_t> index = [] {
        std::unordered_map<std::string, std::size_t> map;
        for (std::size_t i = 0; i < aovTable().size(); ++i) {
            map.emplace(aovTable()[i].name, i);
        }
        return map;
    }();
    const auto found = index.find(name);
    if (found == index.end()) {
        return std::nullopt;
    }
    return aovTable()[found->second];
}

std::string aovOfHostName(const std::string& name) {
    constexpr std::string_view kPrimvarIdentifier = "primvars_";
    if (name.size() > kPrimvarIdentifier.size() &&
        name.compare(0, kPrimvarIdentifier.size(), kPrimvarIdentifier) == 0) {
        return std::string(kPrimvarPrefix) + name.substr(kPrimvarIdentifier.size());
    }
    static const std::unordered_map<std::string, std::string> index = [] {
        std::unordered_map<std::string, std::string> map;
        for (const AovDescriptor& aov : aovTable()) {
            std::string identifier = aov.name;
            std::replace(identifier.begin(), identifier.end(), ':', '_');
            map.emplace(std::move(identifier), aov.name);
        }
        return map;
    }();
    const auto found = index.find(name);
    return found == index.end() ? name : found->second;
}

std::string nearestAovName(const std::string& name) {
    const std::size_t colon = name.find(':');
    // `primvar:st` and the like: the part after the colon is the user's, so keep it.
    if (colon != std::string::npos && colon + 1 < name.size() &&
        editDistance(name.substr(0, colon + 1), kPrimvarPrefix) <= 2) {
        return std::string(kPrimvarPrefix) + name.substr(colon + 1);
    }
    std::vector<std::string> names;
    names.reserve(aovTable().size());
    for (const AovDescriptor& aov : aovTable()) {
        names.push_back(aov.name);
    }
    return nearestName(name, names);
}

} // namespace mbfeat
