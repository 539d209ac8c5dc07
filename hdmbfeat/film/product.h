// Render products: what goes into a file, writing it, and reading its layout back.
//
// Raster products are scanline EXR files, with one part or one part a layer. A deep product holds
// the kept paths of a film: one deep sample is one path, in path order, not sorted by depth; its
// channels are pathSampleFields(), all 32 bits wide, so that it holds exactly Film::pathSamples().
#pragma once

#include <cstdint>
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
    std::string aov;   ///< AOV name in the film
    std::string layer; ///< EXR layer name; "" or "color" for the unnamed RGBA layer
    PixelType pixelType = PixelType::kFloat; ///< kInt AOVs are always kUInt, kFloat ones never
};

struct ProductSpec {
    std::string path;                 ///< file to write
    std::string primPath;             ///< RenderProduct prim, for messages; may be empty
    bool deep = false;                ///< productType deepRaster: every path as a deep sample
    std::vector<ProductLayer> layers; ///< of a deep product: only tells whether it is extended
    /// OpenEXR's names: none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab. Deep files: none,
    /// rle, zips, and zip which means zips there.
    std::string compression = "zip";
    bool multiPart = false; ///< one part a layer
    /// Further header attributes, as authored (artist, comment, ...). Those that OpenEXR gives a
    /// type get it; names that the file format or MBFeat uses are prefixed with "product:".
    std::vector<std::pair<std::string, std::string>> attributes;
};

/// True for an AOV of the extended set; one of them in a deep product's layers, or in the film,
/// makes the kept paths extended.
bool isExtendedAov(const std::string& aov);

/// Checks a product before anything renders: known AOVs, no two layers or channels of one name, a
/// directory that can be written. All problems, each naming prim or file. A layer of an unknown
/// AOV is left out of the file; with any other problem writeProduct() fails.
std::vector<Error> validateProduct(const ProductSpec& product);

/// Writes beside the target and renames, so a reader never sees half a file and a killed run
/// leaves the last good one. Not thread-safe on the same path. Values that a half cannot hold are
/// written as +-65504, counted in the header and reported to `diagnostics`, which may be null.
Status writeProduct(const ProductSpec& product, const Film& film, const RenderReport& report,
                    Diagnostics* diagnostics = nullptr);

/// One layer of a file: the channels of one AOV.
struct AovLayoutEntry {
    std::string aov;   ///< name in the AOV table; empty for channels that are not ours
    std::string layer; ///< as in ProductLayer; "color" for the unnamed one
    std::string type;  ///< "half", "float" or "uint"; "mixed" in foreign files
    int vertex = -1;   ///< 0..5 for per-vertex AOVs
    std::vector<std::string> channels; ///< full EXR names, in the AOV's order
    std::string doc;                   ///< meaning, unit, space
    std::size_t bytes = 0;             ///< uncompressed, a pixel; in deep files a sample
    int part = 0;
};

/// What is in a file, or will be.
struct AovLayout {
    bool deep = false;
    ImageWindow window; ///< empty when not known yet
    int parts = 1;
    std::string compression;
    std::vector<AovLayoutEntry> layers; ///< a product's as asked for; a file's in the table's order
    std::vector<std::pair<std::string, std::string>> attributes; ///< text ones of the first part

    std::size_t bytes() const; ///< of all layers, a pixel or deep sample
    /// True for a file that MBFeat wrote, by its header.
    bool isOwn() const;
};

/// The layout that writeProduct() gives a product.
AovLayout describeProduct(const ProductSpec& product);
/// The layout of an EXR file, ours or not; an error where it cannot be read.
Result<AovLayout> describeProductFile(const std::string& path);

/// The file's channels against the AOV table: empty when it conforms, else what differs.
std::vector<std::string> checkProductFile(const std::string& path);

} // namespace mbfeat
