// Render products: what goes into a file, and writing it.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/diagnostics.h"
#include "film/film.h"
#include "film/report.h"

namespace mbfeat {

enum class PixelType : std::uint8_t { kHalf, kFloat, kUInt };

/// One RenderVar of a product.
struct ProductLayer {
    std::string aov;    ///< AOV name in the film
    std::string layer;  ///< EXR layer name; "" or "color" for the unnamed RGBA layer
    PixelType pixelType = PixelType::kFloat;  ///< kInt AOVs are always kUInt
};

struct ProductSpec {
    std::string path;     ///< file to write
    std::string primPath; ///< RenderProduct prim, for messages; may be empty
    bool deep = false;    ///< productType deepRaster: every path as a deep sample
    std::vector<ProductLayer> layers;
    std::string compression = "zip";  ///< OpenEXR's names; deep files: "zips", "rle", "none"
    bool multiPart = false;           ///< one part a layer
    /// Further header attributes, as authored (artist, comment, ...).
    std::vector<std::pair<std::string, std::string>> attributes;
};

/// Checks a product before anything renders: known AOVs, no two layers or channels of one name, a
/// directory that can be written. All problems, each naming prim or file.
std::vector<Error> validateProduct(const ProductSpec& product);

/// Writes beside the target and renames, so a reader never sees half a file and a killed run
/// leaves the last good one. Not thread-safe on the same path.
Status writeProduct(const ProductSpec& product, const Film& film, const RenderReport& report);

/// The file's channels against the AOV table: empty when it conforms, else what differs.
std::vector<std::string> checkProductFile(const std::string& path);

}  // namespace mbfeat
