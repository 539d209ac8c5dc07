// Decoding of image files into plain arrays, for the texture cache.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "scene/texture.h"

namespace mbfeat {

/// The texels of a file as stored, before any colour conversion.
struct DecodedImage {
    int width = 0, height = 0, channels = 0;
    /// kUNorm8, kUNorm16, kHalf or kFloat: the smallest that keeps what the file says.
    Image::Storage storage = Image::Storage::kFloat;
    std::vector<std::uint8_t> data; ///< interleaved, row 0 at the bottom; may hold NaN
    /// Colour space that the file itself names (see SourceColorSpace::kAuto); else hasColorSpace
    /// is false.
    bool hasColorSpace = false;
    std::string colorSpace;
    std::string note; ///< something that the user may want to know, or empty
};

/// Size of texels in memory that is refused, whatever a header claims.
inline constexpr std::size_t kMaxImageBytes = std::size_t(8) << 30;

/// "2 MiB" and the like, for messages.
std::string bytesText(std::size_t bytes);

/// An error if an image of that size, as a file claims it, is empty or above kMaxImageBytes.
Status checkImageSize(const std::string& path, std::int64_t width, std::int64_t height,
                      std::int64_t texelBytes);

inline constexpr const char* kTruncatedText =
    "is cut off: its data ends before the image is complete; write it again";

/// Decodes PNG, JPEG, Radiance HDR, TGA, BMP and OpenEXR files, told apart by their content (TGA,
/// which has no signature, by its name). Errors (subject: the file) say what is wrong with it.
/// Throws nothing; any thread.
Result<DecodedImage> decodeImage(const std::string& path);

/// The parts of decodeImage(). `bytes` is the whole file; EXR files are read from disk.
Result<DecodedImage> decodeStbImage(const std::string& path,
                                    const std::vector<std::uint8_t>& bytes);
Result<DecodedImage> decodeRadianceImage(const std::string& path,
                                         const std::vector<std::uint8_t>& bytes);
Result<DecodedImage> decodeExrImage(const std::string& path);

} // namespace mbfeat
