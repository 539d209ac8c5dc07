#include "film/exrHeader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <ImfChromaticitiesAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfStringAttribute.h>

#include "film/json.h"

namespace mbfeat {

namespace {

constexpr std::array<std::pair<const char*, Imf::Compression>, 10> kCompressions{{
    {"none", Imf::NO_COMPRESSION},
    {"rle", Imf::RLE_COMPRESSION},
    {"zips", Imf::ZIPS_COMPRESSION},
    {"zip", Imf::ZIP_COMPRESSION},
    {"piz", Imf::PIZ_COMPRESSION},
    {"pxr24", Imf::PXR24_COMPRESSION},
    {"b44", Imf::B44_COMPRESSION},
    {"b44a", Imf::B44A_COMPRESSION},
    {"dwaa", Imf::DWAA_COMPRESSION},
    {"dwab", Imf::DWAB_COMPRESSION},
}};

/// Attributes that are part of the file format or that this file writes with a fixed meaning.
constexpr std::array<std::string_view, 18> kReserved{"channels",
                                                     "chunkCount",
                                                     "compression",
                                                     "dataWindow",
                                                     "deepImageState",
                                                     "displayWindow",
                                                     "idManifest",
                                                     "lineOrder",
                                                     "maxSamplesPerPixel",
                                                     "multiView",
                                                     "name",
                                                     "pixelAspectRatio",
                                                     "preview",
                                                     "screenWindowCenter",
                                                     "screenWindowWidth",
                                                     "tiles",
                                                     "type",
                                                     "version"};

/// Standard attributes of type float (ImfStandardAttributes.h).
constexpr std::array<std::string_view, 9> kFloats{"xDensity", "utcOffset", "longitude",
                                                  "latitude", "altitude",  "focus",
                                                  "expTime",  "aperture",  "isoSpeed"};

/// Standard attributes whose type has no textual form here, so that a text would mislead readers.
constexpr std::array<std::string_view, 9> kOtherTypes{
    "whiteLuminance",  "adoptedNeutral", "envmap",     "keyCode",           "timeCode",
    "framesPerSecond", "worldToCamera",  "worldToNDC", "originalDataWindow"};

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// The finite numbers of a text that holds nothing else than numbers, spaces, commas and brackets;
/// empty otherwise.
std::vector<float> parseFloats(std::string text) {
    std::replace_if(
        text.begin(), text.end(),
        [](char c) { return c == ',' || c == '(' || c == ')' || c == '[' || c == ']'; }, ' ');
    std::vector<float> numbers;
    const char* rest = text.data();
    const char* const end = rest + text.size();
    for (;;) {
        rest = std::find_if(rest, end, [](char c) { return c != ' '; });
        if (rest == end) {
            return numbers;
        }
        float number = 0.0F;
        const std::from_chars_result read = std::from_chars(rest, end, number);
        if (read.ec != std::errc() || !std::isfinite(number)) {
            return {};
        }
        numbers.push_back(number);
        rest = read.ptr;
    }
}

/// Other programs' names for what EXR has a standard attribute for.
std::string standardName(const std::string& name) {
    if (name == "artist" || name == "Artist") {
        return "owner";
    }
    if (name == "comment" || name == "Comment" || name == "description") {
        return "comments";
    }
    return name;
}

/// Writes a product's own attribute with the type that readers expect of its name.
void addProductAttribute(Imf::Header& header, const std::string& authoredName,
                         const std::string& text) {
    const std::string name = standardName(authoredName);
    const std::vector<float> numbers = parseFloats(text);
    if (contains(kFloats, name) && numbers.size() == 1) {
        header.insert(name, Imf::FloatAttribute(numbers[0]));
        return;
    }
    if (name == "chromaticities" && numbers.size() == 8) {
        const Imf::Chromaticities chromaticities({numbers[0], numbers[1]}, {numbers[2], numbers[3]},
                                                 {numbers[4], numbers[5]},
                                                 {numbers[6], numbers[7]});
        header.insert(name, Imf::ChromaticitiesAttribute(chromaticities));
        return;
    }
    const bool taken = contains(kReserved, name) || contains(kFloats, name) ||
                       contains(kOtherTypes, name) || name == "chromaticities" ||
                       name.compare(0, 7, "mbfeat:") == 0 || header.find(name) != header.end();
    addTextAttribute(header, taken ? "product:" + authoredName : name, text);
}

/// For Imath's row vectors; the camera looks along -z, y is up.
Imath::M44f worldToCamera(const AffineD& cameraToWorld) {
    if (cameraToWorld.determinant() == 0.0) {
        return {};
    }
    const AffineD inverse = cameraToWorld.inverse();
    Imath::M44f matrix;
    int row = 0;
    for (const Double3& axis : {inverse.x, inverse.y, inverse.z, inverse.t}) {
        matrix[row][0] = static_cast<float>(axis.x);
        matrix[row][1] = static_cast<float>(axis.y);
        matrix[row][2] = static_cast<float>(axis.z);
        ++row;
    }
    return matrix;
}

} // namespace

std::optional<Imf::Compression> exrCompression(const std::string& name, bool deep) {
    if (deep && name == "zip") {
        return Imf::ZIPS_COMPRESSION;
    }
    for (const auto& [known, compression] : kCompressions) {
        if (name == known && (!deep || compression <= Imf::ZIPS_COMPRESSION)) {
            return compression;
        }
    }
    return std::nullopt;
}

std::string exrCompressionName(Imf::Compression compression) {
    for (const auto& [name, known] : kCompressions) {
        if (known == compression) {
            return name;
        }
    }
    return "unknown";
}

void addTextAttribute(Imf::Header& header, const std::string& name, const std::string& text) {
    constexpr std::size_t kLongest = 255; // OpenEXR's limit for names
    std::string valid = toValidUtf8(name);
    valid.erase(std::remove_if(valid.begin(), valid.end(),
                               [](char c) { return static_cast<unsigned char>(c) < 0x20; }),
                valid.end());
    while (valid.size() > kLongest) {
        valid.pop_back();
    }
    // Cutting may have split a character.
    while (!valid.empty() && toValidUtf8(valid) != valid) {
        valid.pop_back();
    }
    if (!valid.empty()) {
        header.insert(valid, Imf::StringAttribute(toValidUtf8(text)));
    }
}

Imf::Header exrHeader(const ProductSpec& product, const Film& film, const RenderReport& report) {
    const ImageWindow& window = film.window();
    const PixelRect& data = window.data;
    const Imath::Box2i displayWindow({0, 0}, {window.width - 1, window.height - 1});
    const Imath::Box2i dataWindow({data.x, data.y},
                                  {data.x + data.width - 1, data.y + data.height - 1});
    // OpenEXR refuses aspect ratios outside of this range.
    const bool sane = window.pixelAspectRatio >= 1e-6F && window.pixelAspectRatio <= 1e6F;
    Imf::Header header(displayWindow, dataWindow, sane ? window.pixelAspectRatio : 1.0F);
    header.compression() =
        exrCompression(product.compression, product.deep).value_or(Imf::ZIPS_COMPRESSION);
    if (film.cameraToWorld()) {
        header.insert("worldToCamera", Imf::M44fAttribute(worldToCamera(*film.cameraToWorld())));
    }
    for (const auto& [name, text] : report.headerAttributes()) {
        addTextAttribute(header, name, text);
    }
    for (const auto& [name, text] : product.attributes) {
        addProductAttribute(header, name, text);
    }
    return header;
}

} // namespace mbfeat
