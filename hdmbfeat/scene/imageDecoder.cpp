#include "scene/imageDecoder.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>

namespace mbfeat {

namespace {

constexpr std::uint8_t kExrMagic[4] = {0x76, 0x2f, 0x31, 0x01};

bool startsWith(const std::uint8_t* bytes, std::size_t size, const void* prefix,
                std::size_t length) {
    return size >= length && std::memcmp(bytes, prefix, length) == 0;
}

bool hasKnownSignature(const std::uint8_t* bytes, std::size_t size) {
    return startsWith(bytes, size, "\x89PNG", 4) || startsWith(bytes, size, "\xff\xd8\xff", 3) ||
           startsWith(bytes, size, "BM", 2);
}

bool isNamedTga(const std::string& path) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos) {
        return false;
    }
    std::string extension = path.substr(dot + 1);
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension == "tga" || extension == "targa";
}

Result<DecodedImage> decodeFile(const std::string& path) {
    struct stat info = {};
    if (stat(path.c_str(), &info) != 0) {
        const char* hint = path.find("<UDIM>") != std::string::npos
                               ? " (sets of UDIM tiles are not supported: name one file)"
                               : "";
        return Error{path, std::string("cannot be opened: ") + std::strerror(errno) + hint};
    }
    if (!S_ISREG(info.st_mode)) {
        return Error{path, "is not a file"};
    }
    const auto size = static_cast<std::size_t>(info.st_size);
    if (size == 0) {
        return Error{path, "is empty (0 bytes)"};
    }
    std::ifstream file(path, std::ios::binary);
    std::uint8_t head[16] = {};
    file.read(reinterpret_cast<char*>(head), sizeof(head));
    const auto headSize = static_cast<std::size_t>(file.gcount());
    if (headSize == 0) {
        return Error{path, std::string("cannot be read: ") + std::strerror(errno)};
    }
    if (startsWith(head, headSize, kExrMagic, sizeof(kExrMagic))) {
        return decodeExrImage(path);
    }
    const bool radiance = startsWith(head, headSize, "#?", 2);
    if (!radiance && !hasKnownSignature(head, headSize) && !isNamedTga(path)) {
        return Error{path, "is not a PNG, JPEG, Radiance HDR, TGA, BMP or OpenEXR image, or its "
                           "beginning is damaged"};
    }
    if (size > kMaxImageBytes) {
        return Error{path, "is a file of " + bytesText(size) + ", more than the limit of " +
                               bytesText(kMaxImageBytes)};
    }
    std::vector<std::uint8_t> bytes(size);
    file.clear();
    file.seekg(0);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    if (static_cast<std::size_t>(file.gcount()) != size) {
        return Error{path, "cannot be read to its end"};
    }
    return radiance ? decodeRadianceImage(path, bytes) : decodeStbImage(path, bytes);
}

} // namespace

std::string bytesText(std::size_t bytes) {
    constexpr const char* kUnits[] = {"bytes", "KiB", "MiB", "GiB"};
    int unit = 0;
    auto value = static_cast<double>(bytes);
    while (value >= 1024.0 && unit < 3) {
        value /= 1024.0;
        ++unit;
    }
    char text[48];
    std::snprintf(text, sizeof(text), "%.*f %s", unit == 0 || value >= 10.0 ? 0 : 1, value,
                  kUnits[unit]);
    return text;
}

Status checkImageSize(const std::string& path, std::int64_t width, std::int64_t height,
                      std::int64_t texelBytes) {
    constexpr std::int64_t kMaxSide = std::int64_t(1) << 24;
    const auto limit = static_cast<std::int64_t>(kMaxImageBytes);
    if (width > 0 && height > 0 && width <= kMaxSide && height <= kMaxSide &&
        width * height <= limit / texelBytes) {
        return std::nullopt;
    }
    return Error{path, "claims to have " + std::to_string(width) + " x " + std::to_string(height) +
                           " texels, which is none or more than the limit of " +
                           bytesText(kMaxImageBytes)};
}

Result<DecodedImage> decodeImage(const std::string& path) {
    try {
        return decodeFile(path);
    } catch (const std::bad_alloc&) {
        return Error{path, "needs more memory than there is"};
    }
}

} // namespace mbfeat
