// Path records whose values all differ and are exact in double sums and in halves.
#pragma once

#include "film/film.h"

namespace mbfeat {

/// A record in which every float is a small multiple of 1/8 that depends on the sample and on the
/// field, so that sums are exact and no two fields can be mistaken for each other.
inline PathRecord makeRecord(int sample) {
    PathRecord record;
    float next = static_cast<float>(sample);
    const auto value = [&] { return next += 0.125F; };
    const auto triple = [&] {
        const float x = value();
        const float y = value();
        return Float3(x, y, value());
    };
    record.radiance = triple();
    record.alpha = value();
    for (VertexFeatures& vertex : record.features) {
        vertex.albedo = triple();
        vertex.normal = triple();
        vertex.direct = triple();
    }
    record.emission = triple();
    for (Rgb& contribution : record.contributions) {
        contribution = triple();
    }
    record.tail = triple();
    int event = sample;
    for (VertexExtended& vertex : record.extended) {
        vertex.roughness = value();
        vertex.distance = value();
        vertex.throughput = triple();
        vertex.event = ++event;
    }
    record.vertexCount = static_cast<std::uint8_t>(1 + sample % kFeatureVertices);
    record.nonDeltaAlbedo = triple();
    record.nonDeltaNormal = triple();
    record.nonDeltaDepth = value();
    record.nonDeltaTint = triple();
    record.primId = 100 + sample;
    record.instanceId = 200 + sample;
    record.elementId = 300 + sample;
    record.depth = value();
    record.cameraDepth = value();
    record.distance = value();
    record.normal = triple();
    record.eyeNormal = triple();
    for (Float4& primvar : record.primvars) {
        primvar.x = value();
        primvar.y = value();
        primvar.z = value();
        primvar.w = value();
    }
    return record;
}

inline ImageWindow makeWindow(int width, int height) {
    ImageWindow window;
    window.width = width;
    window.height = height;
    window.data = {0, 0, width, height};
    return window;
}

/// Every AOV of the table and a primvar.
inline std::vector<std::string> allAovs() {
    std::vector<std::string> names;
    for (const AovDescriptor& aov : aovTable()) {
        names.push_back(aov.name);
    }
    names.emplace_back("primvars:st");
    return names;
}

/// The value of a bound AOV at one pixel of the data window.
inline std::vector<float> valueOf(const Film& film, const std::string& aov, int column = 0,
                                  int row = 0) {
    const int index = film.findBound(aov);
    const auto width =
        static_cast<std::size_t>(film.aovs()[static_cast<std::size_t>(index)].width());
    const auto columns = static_cast<std::size_t>(film.window().data.width);
    std::vector<float> values(columns * static_cast<std::size_t>(film.window().data.height) *
                              width);
    film.resolve(index, values.data());
    const auto first =
        values.begin() +
        static_cast<std::ptrdiff_t>(
            (static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)) * width);
    return {first, first + static_cast<std::ptrdiff_t>(width)};
}

} // namespace mbfeat
