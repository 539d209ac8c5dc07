// Writes image files for tests: what the library's own writers cannot (16-bit PNG, PNG metadata,
// odd EXR files), and damage.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <ImfHeader.h>
#include <ImfPixelType.h>

namespace mbfeat {

/// A PNG of 8 or 16 bits with 1..4 channels, row 0 at the top, without compression.
struct PngFile {
    int width = 1, height = 1, channels = 3, bits = 8;
    std::vector<std::uint16_t> values;
    bool srgbChunk = false;
    std::uint32_t gamma = 0; ///< gAMA chunk when not 0

    std::vector<std::uint8_t> encode() const;
};

/// Channels of an EXR file, in any order; each has one float a pixel of the data window, row 0 at
/// the top, and is stored with its own type.
struct ExrChannel {
    std::string name;
    Imf::PixelType type = Imf::FLOAT;
    std::vector<float> values;
};

/// Writes a scanline file, or a tiled one when the header has a tile description.
void writeExr(const std::string& path, Imf::Header header, const std::vector<ExrChannel>& channels);

std::vector<std::uint8_t> readBytes(const std::string& path);
void writeBytes(const std::string& path, const std::vector<std::uint8_t>& bytes);
void writeText(const std::string& path, const std::string& text);

} // namespace mbfeat
