#include "film/pathRow.h"

#include <cstring>
#include <optional>

namespace mbfeat {

namespace {

constexpr int kFeatureFloats = kFeatureVertices * 9;
static_assert(sizeof(PathRecord::features) == kFeatureFloats * sizeof(float));

float* writeRgb(const Rgb& value, float* out) {
    *out++ = value.x;
    *out++ = value.y;
    *out++ = value.z;
    return out;
}

} // namespace

float* writePathRow(const PathRecord& record, bool extended, float* out) {
    out = writeRgb(record.radiance, out);
    *out++ = record.alpha;
    *out++ = record.distance;
    *out++ = record.subpixel.x;
    *out++ = record.subpixel.y;
    *out++ = static_cast<float>(record.validMask());
    std::memcpy(out, &record.features, sizeof(record.features));
    out += kFeatureFloats;
    if (!extended) {
        return out;
    }
    for (const VertexExtended& vertex : record.extended) {
        *out++ = vertex.roughness;
        *out++ = vertex.distance;
        out = writeRgb(vertex.throughput, out);
        *out++ = static_cast<float>(vertex.event);
    }
    return out;
}

std::vector<std::string> pathRowFields(bool parts) {
    std::vector<std::string> names;
    for (const PathSampleField& field : pathSampleFields(true)) {
        names.push_back(field.name);
    }
    if (!parts) {
        return names;
    }
    const auto append = [&](const std::string& part) {
        const std::optional<AovDescriptor> aov = findAov("mbfeat:contribution:" + part);
        for (const std::string& channel : aov->channels) {
            names.push_back(aov->name + "." + channel);
        }
    };
    append("emission");
    for (int k = 0; k < kFeatureVertices; ++k) {
        append(std::to_string(k));
    }
    append("tail");
    return names;
}

float* writePathParts(const PathRecord& record, float* out) {
    out = writeRgb(record.emission, out);
    for (const Rgb& part : record.contributions) {
        out = writeRgb(part, out);
    }
    return writeRgb(record.tail, out);
}

} // namespace mbfeat
