#include "film/imageWriter.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include <unistd.h>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb_image_write.h>

namespace mbfeat {

namespace {

constexpr int kJpegQuality = 95;

using Bytes = std::vector<std::uint8_t>;

enum class Format { kPng, kJpeg, kBmp, kTga, kHdr };

struct Extension {
    const char* text;
    Format format;
};
constexpr std::array<Extension, 6> kExtensions = {{{".png", Format::kPng},
                                                   {".jpg", Format::kJpeg},
                                                   {".jpeg", Format::kJpeg},
                                                   {".bmp", Format::kBmp},
                                                   {".tga", Format::kTga},
                                                   {".hdr", Format::kHdr}}};

std::string extensionOf(const std::string& path) {
    const std::size_t slash = path.find_last_of('/');
    const std::size_t dot = path.find_last_of('.');
    if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) {
        return "";
    }
    std::string extension = path.substr(dot);
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

extern "C" void appendBytes(void* context, void* data, int size) {
    const auto* const first = static_cast<const std::uint8_t*>(data);
    auto& bytes = *static_cast<Bytes*>(context);
    bytes.insert(bytes.end(), first, first + size);
}

/// The values with the channels that the format takes: colour without alpha where it has none.
std::vector<float> channelsOf(const float* values, std::size_t texels, int channels, int kept) {
    std::vector<float> result(texels * static_cast<std::size_t>(kept));
    for (std::size_t i = 0; i < texels; ++i) {
        std::copy_n(values + i * static_cast<std::size_t>(channels), kept,
                    result.data() + i * static_cast<std::size_t>(kept));
    }
    return result;
}

Bytes quantized(const std::vector<float>& values) {
    Bytes bytes(values.size());
    std::transform(values.begin(), values.end(), bytes.begin(), [](float v) {
        const float inside = v > 0.0F ? std::min(v, 1.0F) : 0.0F; // 0 for a NaN too
        return static_cast<std::uint8_t>(std::lround(inside * 255.0F));
    });
    return bytes;
}

bool encode(Format format, int width, int height, int channels, const std::vector<float>& values,
            Bytes& file) {
    if (format == Format::kHdr) {
        return stbi_write_hdr_to_func(appendBytes, &file, width, height, channels, values.data()) !=
               0;
    }
    const Bytes bytes = quantized(values);
    switch (format) {
    case Format::kJpeg:
        return stbi_write_jpg_to_func(appendBytes, &file, width, height, channels, bytes.data(),
                                      kJpegQuality) != 0;
    case Format::kBmp:
        return stbi_write_bmp_to_func(appendBytes, &file, width, height, channels, bytes.data()) !=
               0;
    case Format::kTga:
        return stbi_write_tga_to_func(appendBytes, &file, width, height, channels, bytes.data()) !=
               0;
    default:
        return stbi_write_png_to_func(appendBytes, &file, width, height, channels, bytes.data(),
                                      width * channels) != 0;
    }
}

struct CloseFile {
    void operator()(std::FILE* file) const {
        std::fclose(file); // NOLINT(cppcoreguidelines-owning-memory): this is the owner
    }
};

Error systemError(const std::string& path, const char* what) {
    return {path, std::string("the image could not be ") + what + " (" + std::strerror(errno) +
                      "); name a file in a folder that can be written"};
}

Status writeAndRename(const std::string& path, const Bytes& bytes) {
    const std::string partial = path + "." + std::to_string(getpid()) + ".partial";
    std::unique_ptr<std::FILE, CloseFile> file(std::fopen(partial.c_str(), "wb"));
    if (file == nullptr) {
        return systemError(path, "opened for writing");
    }
    const bool whole = std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size() &&
                       std::fflush(file.get()) == 0;
    file.reset();
    if (!whole || std::rename(partial.c_str(), path.c_str()) != 0) {
        Error error = systemError(path, "written");
        std::remove(partial.c_str());
        return error;
    }
    return std::nullopt;
}

} // namespace

std::string imageFileExtensions() {
    std::string text;
    for (const Extension& extension : kExtensions) {
        text += (text.empty() ? "" : ", ") + std::string(extension.text);
    }
    return text;
}

Status writeImageFile(const std::string& path, int width, int height, int channels,
                      const float* values) {
    const std::string extension = extensionOf(path);
    const auto* const found = std::find_if(kExtensions.begin(), kExtensions.end(),
                                           [&](const Extension& e) { return extension == e.text; });
    if (found == kExtensions.end()) {
        return Error{path, "no image format has the extension \"" + extension +
                               "\"; use one of .exr, " + imageFileExtensions()};
    }
    const bool hasAlpha = channels == 2 || channels == 4;
    const bool takesAlpha = found->format == Format::kPng || found->format == Format::kTga;
    const int kept = hasAlpha && !takesAlpha ? channels - 1 : channels;
    const std::size_t texels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    Bytes file;
    if (width < 1 || height < 1 || channels < 1 || channels > 4 ||
        !encode(found->format, width, height, kept, channelsOf(values, texels, channels, kept),
                file)) {
        return Error{path, "an image of " + std::to_string(width) + " x " + std::to_string(height) +
                               " pixels and " + std::to_string(channels) +
                               " channels cannot be stored as " + extension +
                               "; it was not written"};
    }
    return writeAndRename(path, file);
}

} // namespace mbfeat
