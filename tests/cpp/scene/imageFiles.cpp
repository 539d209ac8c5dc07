#include "scene/imageFiles.h"

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfOutputFile.h>
#include <ImfTileDescription.h>
#include <ImfTiledOutputFile.h>

namespace mbfeat {

namespace {

void append32(std::vector<std::uint8_t>& out, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) {
        out.push_back(static_cast<std::uint8_t>(value >> shift));
    }
}

std::uint32_t crc32(const std::uint8_t* bytes, std::size_t size) {
    std::uint32_t crc = 0xffffffffU;
    for (std::size_t i = 0; i < size; ++i) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
        }
    }
    return ~crc;
}

void appendChunk(std::vector<std::uint8_t>& out, const char* type,
                 const std::vector<std::uint8_t>& data) {
    append32(out, static_cast<std::uint32_t>(data.size()));
    const std::size_t start = out.size();
    out.insert(out.end(), type, type + 4);
    out.insert(out.end(), data.begin(), data.end());
    append32(out, crc32(out.data() + start, out.size() - start));
}

/// A zlib stream of stored blocks.
std::vector<std::uint8_t> store(const std::vector<std::uint8_t>& data) {
    std::vector<std::uint8_t> out = {0x78, 0x01};
    constexpr std::size_t kBlock = 65535;
    std::size_t position = 0;
    do {
        const std::size_t size = std::min(kBlock, data.size() - position);
        const bool last = position + size == data.size();
        const auto low = static_cast<std::uint8_t>(size & 0xff);
        const auto high = static_cast<std::uint8_t>(size >> 8);
        out.insert(out.end(), {static_cast<std::uint8_t>(last ? 1 : 0), low, high,
                               static_cast<std::uint8_t>(~low), static_cast<std::uint8_t>(~high)});
        out.insert(out.end(), data.begin() + static_cast<std::ptrdiff_t>(position),
                   data.begin() + static_cast<std::ptrdiff_t>(position + size));
        position += size;
    } while (position < data.size());
    std::uint32_t a = 1;
    std::uint32_t b = 0;
    for (const std::uint8_t byte : data) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    append32(out, b << 16 | a);
    return out;
}

} // namespace

std::vector<std::uint8_t> PngFile::encode() const {
    std::vector<std::uint8_t> out = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    constexpr std::array<std::uint8_t, 5> kColorTypes = {0, 0, 4, 2, 6};
    std::vector<std::uint8_t> header;
    append32(header, static_cast<std::uint32_t>(width));
    append32(header, static_cast<std::uint32_t>(height));
    header.insert(header.end(), {static_cast<std::uint8_t>(bits),
                                 kColorTypes[static_cast<std::size_t>(channels)], 0, 0, 0});
    appendChunk(out, "IHDR", header);
    if (srgbChunk) {
        appendChunk(out, "sRGB", {0});
    }
    if (gamma != 0) {
        std::vector<std::uint8_t> data;
        append32(data, gamma);
        appendChunk(out, "gAMA", data);
    }
    std::vector<std::uint8_t> rows;
    const auto rowValues = static_cast<std::size_t>(width * channels);
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i % rowValues == 0) {
            rows.push_back(0);
        }
        if (bits == 16) {
            rows.push_back(static_cast<std::uint8_t>(values[i] >> 8));
        }
        rows.push_back(static_cast<std::uint8_t>(values[i] & 0xff));
    }
    appendChunk(out, "IDAT", store(rows));
    appendChunk(out, "IEND", {});
    return out;
}

void writeExr(const std::string& path, Imf::Header header,
              const std::vector<ExrChannel>& channels) {
    const Imath::Box2i window = header.dataWindow();
    const auto width = static_cast<std::size_t>(window.max.x - window.min.x + 1);
    std::vector<std::vector<char>> stored(channels.size());
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < channels.size(); ++c) {
        const ExrChannel& channel = channels[c];
        header.channels().insert(channel.name, Imf::Channel(channel.type));
        const std::size_t size = channel.type == Imf::HALF ? 2 : 4;
        stored[c].resize(channel.values.size() * size);
        for (std::size_t i = 0; i < channel.values.size(); ++i) {
            const float value = channel.values[i];
            const Imath::half half(value);
            const auto whole = static_cast<std::uint32_t>(value);
            const void* source = channel.type == Imf::HALF   ? static_cast<const void*>(&half)
                                 : channel.type == Imf::UINT ? static_cast<const void*>(&whole)
                                                             : static_cast<const void*>(&value);
            std::memcpy(stored[c].data() + i * size, source, size);
        }
        const auto origin = static_cast<std::ptrdiff_t>(size) *
                            (window.min.x + window.min.y * static_cast<std::ptrdiff_t>(width));
        frame.insert(channel.name,
                     Imf::Slice(channel.type, stored[c].data() - origin, size, size * width));
    }
    if (header.hasTileDescription()) {
        Imf::TiledOutputFile file(path.c_str(), header);
        file.setFrameBuffer(frame);
        file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    } else {
        Imf::OutputFile file(path.c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(window.max.y - window.min.y + 1);
    }
}

std::vector<std::uint8_t> readBytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void writeBytes(const std::string& path, const std::vector<std::uint8_t>& bytes) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
}

void writeText(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

} // namespace mbfeat
