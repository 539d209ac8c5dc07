#include <optional>

#include "film/film.h"

namespace mbfeat {

namespace {

void appendFields(std::vector<PathSampleField>& fields, const std::string& feature, int vertex) {
    const std::optional<AovDescriptor> aov =
        findAov("mbfeat:" + feature + ":" + std::to_string(vertex));
    for (const std::string& channel : aov->channels) {
        fields.push_back({aov->name + "." + channel, aov->type == AovType::kInt});
    }
}

} // namespace

std::vector<PathSampleField> pathSampleFields(bool extended) {
    std::vector<PathSampleField> fields = {
        {"R", false}, {"G", false},          {"B", false},          {"A", false},
        {"Z", false}, {"subpixel.X", false}, {"subpixel.Y", false}, {"validMask", true}};
    for (int k = 0; k < kFeatureVertices; ++k) {
        for (const char* feature : {"albedo", "normal", "direct"}) {
            appendFields(fields, feature, k);
        }
    }
    for (int k = 0; extended && k < kFeatureVertices; ++k) {
        for (const char* feature : {"roughness", "distance", "throughput", "event"}) {
            appendFields(fields, feature, k);
        }
    }
    return fields;
}

} // namespace mbfeat
