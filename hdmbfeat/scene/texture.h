// Images as textures, and what a material asks of them.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "core/diagnostics.h"
#include "core/vec.h"

namespace mbfeat {

enum class Wrap : std::uint8_t { kBlack, kClamp, kRepeat, kMirror };

/// Colour space of the stored values. kAuto follows UsdPreviewSurface: what the file's metadata
/// says (PNG sRGB and gAMA chunks, EXR chromaticities, colorInteropID and oiio:ColorSpace); without
/// any, sRGB for 8-bit images of three or four channels, linear Rec.709 for Radiance files, raw
/// otherwise.
enum class SourceColorSpace : std::uint8_t { kAuto, kRaw, kSrgb, kNamed };

/// What identifies a loaded image: two materials that ask for the same key share one Image.
struct ImageKey {
    std::string path; ///< resolved, or as authored where it did not resolve
    SourceColorSpace colorSpace = SourceColorSpace::kAuto;
    std::string colorSpaceName; ///< OpenColorIO name when colorSpace is kNamed

    bool operator<(const ImageKey& o) const {
        return std::tie(path, colorSpace, colorSpaceName) <
               std::tie(o.path, o.colorSpace, o.colorSpaceName);
    }
};

/// A decoded image, already in the rendering colour space (raw data untouched). Texel (0, 0) is
/// the bottom left, at texture coordinate (0, 0), as in USD. Values are finite: texels that were
/// not have been replaced by zero and reported once with their count.
class Image {
public:
    enum class Storage : std::uint8_t { kUNorm8, kSrgb8, kUNorm16, kSrgb16, kHalf, kFloat };

    /// Takes over interleaved texels, row 0 at the bottom; in the sRGB storages alpha is linear.
    /// data has width * height * channels values; half and float ones are finite.
    Image(int width, int height, int channels, Storage storage, std::vector<std::uint8_t> data);

    int width() const { return width_; }
    int height() const { return height_; }
    int channels() const { return channels_; }
    Storage storage() const { return storage_; }
    std::size_t bytes() const { return bytes_; }

    /// The texel as RGBA: one channel is replicated to rgb with alpha 1; two are luminance and
    /// alpha; three get alpha 1. x, y inside the image.
    Float4 texel(int x, int y) const;

    /// Bilinear look-up at st with the given wrap modes. kBlack is black (all four zero) outside
    /// [0, 1] and clamps inside, so that an edge shows no dark seam. st that is not finite: black.
    Float4 sample(Float2 st, Wrap wrapS, Wrap wrapT) const;

    /// Whether scene/textureLanes.h can look it up: 8-bit or float texels, at most 2 GiB.
    bool hasLanes() const;
    /// The texels, and where they are bytes and fewer than four channels three bytes behind them.
    const std::uint8_t* data() const { return data_.data(); }
    /// Linear light of the 256 sRGB codes.
    static const float* srgbCodes();

private:
    /// So that the last texel can be read as 32 bits.
    static constexpr std::size_t kPadding = 3;
    int width_ = 0, height_ = 0, channels_ = 0;
    Storage storage_ = Storage::kFloat;
    std::size_t bytes_ = 0;
    std::vector<std::uint8_t> data_;
};

/// An image from float values (row 0 at the bottom, channels interleaved), for tests and for
/// procedural lights. Errors: size mismatch, no texels, values that are not finite.
Result<std::shared_ptr<const Image>> makeImage(int width, int height, int channels,
                                               std::vector<float> values);

/// Loads images once and keeps them while somebody holds them. get() may be called from any
/// thread.
class TextureCache {
public:
    explicit TextureCache(Diagnostics& diagnostics);
    ~TextureCache();

    /// The image, or null if it cannot be read; that is reported once, naming the file and
    /// `subject` (the prim that asked). A file that failed is read again when it has changed.
    std::shared_ptr<const Image> get(const ImageKey& key, const std::string& subject);

    /// OpenColorIO name of the rendering space that colour textures are taken to; empty means
    /// linear Rec.709. Images loaded before keep theirs: call clear() and ask again.
    void setRenderingColorSpace(const std::string& name);
    void clear();
    /// Forgets images that are not among these, and what was wrong with them.
    void releaseOthers(const std::set<ImageKey>& used);

    std::size_t bytes() const;
    int count() const;
    /// Images that were read from files, since the cache was made.
    std::uint64_t loaded() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
