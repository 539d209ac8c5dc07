// Names and types of a product's EXR channels: what the writers, the checks and the descriptions
// agree on. Internal to film/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "film/product.h"

namespace mbfeat {

/// A layer with everything that follows from its AOV.
struct ExrLayer {
    AovDescriptor aov;
    std::string name;   ///< "color" for the unnamed layer
    std::string prefix; ///< "" or "name."
    PixelType type = PixelType::kFloat;

    std::string channel(int component) const {
        return prefix + aov.channels[static_cast<std::size_t>(component)];
    }
};

/// The layers of a raster product in the order in which they were asked for, without those of
/// unknown AOVs.
std::vector<ExrLayer> exrLayers(const ProductSpec& product);

/// "half", "float", "uint".
const char* pixelTypeName(PixelType type);
std::size_t pixelTypeBytes(PixelType type);

/// The fields of a deep file grouped as layers: RGBA and Z, subpixel, validMask, the features. The
/// first three have no AOV.
std::vector<AovLayoutEntry> deepLayers(bool extended);
/// Whether a deep product holds the extended set.
bool isExtendedDeep(const ProductSpec& product);

/// Name of the header attribute that tells which AOV a layer holds.
std::string layerAttributeName(const std::string& layer);

} // namespace mbfeat
