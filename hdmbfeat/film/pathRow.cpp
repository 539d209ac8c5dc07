#include "film/pathRow.h"

#include <cstddef>
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

std::vector<std::string> pathRecordFields(bool parts) {
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

std::vector<PathFieldPlace> pathRecordPlaces(bool parts) {
    using Kind = PathFieldPlace::Kind;
    constexpr std::size_t kWord = sizeof(float);
    std::vector<PathFieldPlace> places;
    const auto append = [&places](std::size_t bytes, std::size_t count, Kind kind = Kind::kFloat) {
        for (std::size_t i = 0; i < count; ++i) {
            places.push_back({bytes / kWord + i, kind});
        }
    };
    static_assert(offsetof(PathRecord, vertexCount) % kWord == 1);
    append(offsetof(PathRecord, radiance), 3);
    append(offsetof(PathRecord, alpha), 1);
    append(offsetof(PathRecord, distance), 1);
    append(offsetof(PathRecord, subpixel), 2);
    append(offsetof(PathRecord, vertexCount), 1, Kind::kVertexCount);
    append(offsetof(PathRecord, features), kFeatureFloats);
    for (std::size_t k = 0; k < kFeatureVertices; ++k) {
        const std::size_t vertex = offsetof(PathRecord, extended) + k * sizeof(VertexExtended);
        append(vertex + offsetof(VertexExtended, roughness), 1);
        append(vertex + offsetof(VertexExtended, distance), 1);
        append(vertex + offsetof(VertexExtended, throughput), 3);
        append(vertex + offsetof(VertexExtended, event), 1, Kind::kInteger);
    }
    if (parts) {
        constexpr std::size_t kParts = kFeatureVertices + 2; // they lie side by side
        append(offsetof(PathRecord, emission), kParts * 3);
        static_assert(offsetof(PathRecord, tail) - offsetof(PathRecord, emission) ==
                      (kParts - 1) * 3 * kWord);
    }
    return places;
}

} // namespace mbfeat
