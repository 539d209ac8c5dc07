// PNG, JPEG, TGA and BMP through stb_image, which is compiled here and only here. (Radiance files
// have a reader of their own: that of stb_image does not end on files that are cut off.)
#include <cstdlib>
#include <cstring>
#include <memory>

#include "scene/imageDecoder.h"

namespace {

// One allocation beyond the limit is refused, so neither a header nor a compressed stream can ask
// for arbitrary memory; stb_image reports it like memory that ran out.
void* limitedMalloc(std::size_t size) {
    // NOLINTNEXTLINE(cppcoreguidelines-owning-memory): stb_image owns its blocks
    return size > mbfeat::kMaxImageBytes ? nullptr : std::malloc(size);
}
void* limitedRealloc(void* block, std::size_t size) {
    // NOLINTNEXTLINE(cppcoreguidelines-owning-memory): stb_image owns its blocks
    return size > mbfeat::kMaxImageBytes ? nullptr : std::realloc(block, size);
}

} // namespace

#define STBI_MALLOC(size) limitedMalloc(size)
#define STBI_REALLOC(block, size) limitedRealloc(block, size)
#define STBI_FREE(block) std::free(block)
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_ONLY_TGA
#define STBI_ONLY_BMP
#define STBI_NO_STDIO
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wsign-compare"
#include <stb_image.h>
#pragma GCC diagnostic pop

namespace mbfeat {

namespace {

/// A file in memory as a source of stb_image that notices when more is asked for than there is;
/// stb_image itself fills most gaps with zeros in silence.
struct Source {
    const std::vector<std::uint8_t>& bytes;
    std::size_t position = 0;
    bool ranOut = false;

    std::size_t left() const { return bytes.size() - position; }

    static int read(void* user, char* out, int size) {
        auto& source = *static_cast<Source*>(user);
        const auto wanted = static_cast<std::size_t>(size);
        const std::size_t got = std::min(wanted, source.left());
        // The buffer refill asks for as much as the buffer holds; only direct reads of rows know
        // what they need.
        source.ranOut = source.ranOut || got == 0 || (got < wanted && wanted != kBufferSize);
        std::memcpy(out, source.bytes.data() + source.position, got);
        std::memset(out + got, 0, wanted - got);
        source.position += got;
        return static_cast<int>(got);
    }
    static void skip(void* user, int count) {
        auto& source = *static_cast<Source*>(user);
        if (count < 0) {
            source.position -= std::min(source.position, static_cast<std::size_t>(-count));
            return;
        }
        const auto wanted = static_cast<std::size_t>(count);
        source.ranOut = source.ranOut || wanted > source.left();
        source.position += std::min(wanted, source.left());
    }
    static int atEnd(void* user) { return static_cast<Source*>(user)->left() == 0 ? 1 : 0; }

    static constexpr std::size_t kBufferSize = sizeof(stbi__context::buffer_start);
    static constexpr stbi_io_callbacks kCallbacks = {read, skip, atEnd};
};

struct StbFree {
    void operator()(void* texels) const { stbi_image_free(texels); }
};
template <class T>
using StbTexels = std::unique_ptr<T, StbFree>;

std::uint32_t bigEndian32(const std::uint8_t* bytes) {
    return static_cast<std::uint32_t>(bytes[0]) << 24 | static_cast<std::uint32_t>(bytes[1]) << 16 |
           static_cast<std::uint32_t>(bytes[2]) << 8 | static_cast<std::uint32_t>(bytes[3]);
}

/// The colour space of a PNG: an sRGB chunk, or a gAMA chunk of about 1/2.2 or exactly 1 (PNG
/// specification, 11.3.3). Other gammas are left to the default rule.
void readPngColorSpace(const std::vector<std::uint8_t>& bytes, DecodedImage& image) {
    std::size_t position = 8;
    while (bytes.size() - position >= 12) {
        const std::uint8_t* chunk = bytes.data() + position;
        const std::size_t length = bigEndian32(chunk);
        if (length > bytes.size() - position - 12 || std::memcmp(chunk + 4, "IDAT", 4) == 0) {
            return;
        }
        if (std::memcmp(chunk + 4, "sRGB", 4) == 0) {
            image.hasColorSpace = true;
            image.colorSpace = "sRGB";
            return;
        }
        if (std::memcmp(chunk + 4, "gAMA", 4) == 0 && length == 4) {
            const std::uint32_t gamma = bigEndian32(chunk + 8);
            image.hasColorSpace = gamma == 100000 || (gamma > 44000 && gamma < 47000);
            image.colorSpace = gamma == 100000 ? "raw" : "sRGB";
        }
        position += length + 12;
    }
}

/// Copies rows bottom up.
void storeRows(const void* texels, std::size_t rowBytes, DecodedImage& image) {
    const auto height = static_cast<std::size_t>(image.height);
    image.data.resize(rowBytes * height);
    for (std::size_t row = 0; row < height; ++row) {
        std::memcpy(image.data.data() + (height - 1 - row) * rowBytes,
                    static_cast<const std::uint8_t*>(texels) + row * rowBytes, rowBytes);
    }
}

Error failure(const std::string& path, const Source& source) {
    if (source.ranOut) {
        return Error{path, kTruncatedText};
    }
    const char* reason = stbi_failure_reason();
    return Error{path, std::string("cannot be decoded: ") + (reason ? reason : "unknown reason")};
}

/// Decodes into image.data; false when stb_image failed.
bool decodeTexels(Source& source, bool sixteenBit, DecodedImage& image) {
    int* const w = &image.width;
    int* const h = &image.height;
    int* const c = &image.channels;
    const auto store = [&image, &source](const void* texels, std::size_t valueBytes) {
        if (texels && !source.ranOut) {
            storeRows(texels,
                      static_cast<std::size_t>(image.width) *
                          static_cast<std::size_t>(image.channels) * valueBytes,
                      image);
        }
        return texels != nullptr;
    };
    if (sixteenBit) {
        image.storage = Image::Storage::kUNorm16;
        const StbTexels<stbi_us> texels(
            stbi_load_16_from_callbacks(&Source::kCallbacks, &source, w, h, c, 0));
        return store(texels.get(), sizeof(stbi_us));
    }
    image.storage = Image::Storage::kUNorm8;
    const StbTexels<stbi_uc> texels(
        stbi_load_from_callbacks(&Source::kCallbacks, &source, w, h, c, 0));
    return store(texels.get(), 1);
}

} // namespace

Result<DecodedImage> decodeStbImage(const std::string& path,
                                    const std::vector<std::uint8_t>& bytes) {
    DecodedImage image;
    Source probe{bytes};
    const bool sixteenBit = stbi_is_16_bit_from_callbacks(&Source::kCallbacks, &probe) != 0;
    Source header{bytes};
    if (stbi_info_from_callbacks(&Source::kCallbacks, &header, &image.width, &image.height,
                                 &image.channels) == 0) {
        return failure(path, header);
    }
    if (Status error = checkImageSize(path, image.width, image.height,
                                      image.channels * (sixteenBit ? 2 : 1))) {
        return *error;
    }
    Source source{bytes};
    const bool decoded = decodeTexels(source, sixteenBit, image);
    if (!decoded || source.ranOut) {
        return failure(path, source);
    }
    if (bytes[0] == 0x89) {
        readPngColorSpace(bytes, image);
    }
    return image;
}

} // namespace mbfeat
