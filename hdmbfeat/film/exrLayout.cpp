#include "film/exrLayout.h"

#include <algorithm>
#include <utility>

namespace mbfeat {

namespace {

/// Meaning of the fields of a path that are no AOVs.
std::string deepFieldDoc(const std::string& layer) {
    if (layer == "color") {
        return "One path: its radiance and alpha, and the distance of its first hit along the ray, "
               "scene units, 0 at the background.";
    }
    if (layer == "subpixel") {
        return "Position of the path in its pixel, 0 to 1 from the upper left corner.";
    }
    return "Bit k is set where the path reached vertex k; features of other vertices are zero.";
}

} // namespace

std::vector<ExrLayer> exrLayers(const ProductSpec& product) {
    std::vector<ExrLayer> layers;
    for (const ProductLayer& wanted : product.layers) {
        std::optional<AovDescriptor> aov = findAov(wanted.aov);
        if (!aov) {
            continue;
        }
        ExrLayer layer;
        const bool unnamed = wanted.layer.empty() || wanted.layer == "color";
        layer.name = unnamed ? "color" : wanted.layer;
        layer.prefix = unnamed ? "" : wanted.layer + ".";
        layer.type = aov->type == AovType::kInt             ? PixelType::kUInt
                     : wanted.pixelType == PixelType::kHalf ? PixelType::kHalf
                                                            : PixelType::kFloat;
        layer.aov = *std::move(aov);
        layers.push_back(std::move(layer));
    }
    return layers;
}

const char* pixelTypeName(PixelType type) {
    return type == PixelType::kHalf ? "half" : type == PixelType::kFloat ? "float" : "uint";
}

std::size_t pixelTypeBytes(PixelType type) {
    return type == PixelType::kHalf ? 2 : 4;
}

std::vector<AovLayoutEntry> deepLayers(bool extended) {
    std::vector<AovLayoutEntry> layers;
    for (const PathSampleField& field : pathSampleFields(extended)) {
        const std::size_t dot = field.name.rfind('.');
        const bool isMask = field.name == "validMask";
        const std::string layer = dot != std::string::npos ? field.name.substr(0, dot)
                                  : isMask                 ? field.name
                                                           : "color";
        if (layers.empty() || layers.back().layer != layer) {
            AovLayoutEntry entry;
            entry.layer = layer;
            entry.type = pixelTypeName(field.isInteger ? PixelType::kUInt : PixelType::kFloat);
            if (const std::optional<AovDescriptor> aov = findAov(layer); aov && layer != "color") {
                entry.aov = aov->name;
                entry.vertex = aov->vertex;
                entry.doc = aov->doc;
            } else {
                entry.doc = deepFieldDoc(layer);
            }
            layers.push_back(std::move(entry));
        }
        layers.back().channels.push_back(field.name);
        layers.back().bytes += sizeof(float);
    }
    return layers;
}

bool isExtendedAov(const std::string& aov) {
    const std::optional<AovDescriptor> found = findAov(aov);
    return found && (found->recordFlags & kRecordExtended) != 0;
}

bool isExtendedDeep(const ProductSpec& product) {
    return std::any_of(product.layers.begin(), product.layers.end(),
                       [](const ProductLayer& layer) { return isExtendedAov(layer.aov); });
}

std::string layerAttributeName(const std::string& layer) {
    return "mbfeat:aov:" + layer;
}

std::size_t AovLayout::bytes() const {
    std::size_t sum = 0;
    for (const AovLayoutEntry& layer : layers) {
        sum += layer.bytes;
    }
    return sum;
}

AovLayout describeProduct(const ProductSpec& product) {
    AovLayout layout;
    layout.deep = product.deep;
    layout.compression =
        product.deep && product.compression == "zip" ? "zips" : product.compression;
    if (product.deep) {
        layout.layers = deepLayers(isExtendedDeep(product));
        return layout;
    }
    int part = 0;
    for (const ExrLayer& layer : exrLayers(product)) {
        AovLayoutEntry entry;
        entry.aov = layer.aov.name;
        entry.layer = layer.name;
        entry.type = pixelTypeName(layer.type);
        entry.vertex = layer.aov.vertex;
        for (int c = 0; c < layer.aov.width(); ++c) {
            entry.channels.push_back(layer.channel(c));
        }
        entry.doc = layer.aov.doc;
        entry.bytes = pixelTypeBytes(layer.type) * entry.channels.size();
        entry.part = product.multiPart ? part : 0;
        ++part;
        layout.layers.push_back(std::move(entry));
    }
    layout.parts = product.multiPart ? std::max(part, 1) : 1;
    return layout;
}

} // namespace mbfeat
