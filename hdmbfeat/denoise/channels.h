// From kept paths to what a network is given.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbfeat {

/// Where a path's memory has a field, in words of four bytes, and as what.
struct PathFieldPlace {
    enum class Kind : std::uint8_t {
        kFloat,
        kInteger,     ///< of 32 bits
        kVertexCount, ///< the word's second byte is n, of which the field is the mask (1 << n) - 1
    };
    std::size_t word = 0;
    Kind kind = Kind::kFloat;

    /// The field's value in the memory of a path.
    float read(const float* path) const {
        std::uint32_t bits = 0;
        std::memcpy(&bits, path + word, sizeof(bits));
        switch (kind) {
        case Kind::kInteger:
            return static_cast<float>(static_cast<std::int32_t>(bits));
        case Kind::kVertexCount: {
            constexpr unsigned kByte = 8, kByteMask = 0xFF;
            return static_cast<float>((1U << (bits >> kByte & kByteMask)) - 1U);
        }
        case Kind::kFloat:
            break;
        }
        return path[word];
    }
};

/// Paths of an image: float[height][width][capacity][fields]. Memory of the caller.
struct PathSamples {
    int width = 0, height = 0, capacity = 0;
    const float* data = nullptr;
    std::vector<std::string> fields; ///< names of a path's floats, see pathSampleFields()
    /// Where paths have these; empty: floats side by side in this order, as in `data`.
    std::vector<PathFieldPlace> places;
    /// Paths that each pixel has, at most `capacity`: [height][width]; empty: all have all.
    std::vector<std::uint32_t> counts;
    /// Rotates directions from the world to the camera, whose -z is forward; row-major.
    float worldToCamera[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

    std::size_t pixelCount() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
    std::size_t countOf(std::size_t pixel) const {
        return counts.empty() ? static_cast<std::size_t>(capacity) : counts[pixel];
    }
    const float* path(std::size_t pixel, std::size_t sample) const {
        return data + (pixel * static_cast<std::size_t>(capacity) + sample) * fields.size();
    }
};

/// How much of the paths a network is shown; what is left out is zero.
enum class ShownFeatures : std::uint8_t { kAll, kFirstHit, kNone };

/// Where some channels come from.
struct ChannelSource {
    enum class Kind : std::uint8_t { kZero, kField, kDirection, kBit };
    Kind kind = Kind::kZero;
    std::size_t count = 1; ///< of neighbouring channels from neighbouring fields, or zeros
    std::size_t field = 0; ///< the word of a path; of a direction: of its x
    PathFieldPlace::Kind form = PathFieldPlace::Kind::kFloat; ///< of bits: of what
    std::uint32_t bits = 0;                                   ///< one bit
    std::size_t axis = 0;                                     ///< of the camera
};

/// Paths that are made ready for a network together, as many as a lane type is wide at most.
inline constexpr int kPathGroup = 16;

/// Finds in the fields of paths a network's channels, and the colours that are reconstructed.
class ChannelPlan {
public:
    /// `lights` are the first fields of the colours. An error names what the paths lack.
    static Result<ChannelPlan> make(const std::vector<std::string>& channels,
                                    const PathSamples& paths, ShownFeatures shown,
                                    const std::vector<std::string>& lights);

    /// Writes the path's channels to out[0], out[stride], ...: false, and nothing but zeros, where
    /// one of them or of the colours is not finite.
    bool write(const float* path, float* out, std::size_t stride) const;
    /// The same of `count` paths, at most kPathGroup, on SIMD lanes: out[channel][kPathGroup], zero
    /// beyond `count`. Returns a bit for each path, 1 where write() would return true.
    std::uint32_t writeGroup(const float* const* paths, int count, float* out) const;
    std::size_t size() const { return size_; }
    /// Words of a path that hold all that is read, four in a row from each of these on, and one by
    /// one where a path ends.
    const std::vector<std::size_t>& quads() const { return quads_; }
    const std::vector<std::size_t>& singles() const { return singles_; }
    /// Those of them that are no floats.
    const std::vector<PathFieldPlace>& numbers() const { return numbers_; }
    std::size_t words() const { return words_; } ///< of a path, up to the last that is read
    const std::vector<ChannelSource>& sources() const { return sources_; }
    /// An axis of the camera in the world, three floats.
    const float* axis(std::size_t index) const { return rotation_ + 3 * index; }
    /// Words of the colours' first fields.
    const std::vector<std::size_t>& lights() const { return lights_; }

private:
    void append(const ChannelSource& source);
    void findWords(std::size_t pathWords);

    std::vector<ChannelSource> sources_;
    std::vector<std::size_t> lights_;
    std::vector<std::size_t> quads_, singles_;
    std::vector<PathFieldPlace> numbers_;
    std::size_t size_ = 0; ///< channels
    std::size_t words_ = 0;
    float rotation_[9] = {};

    ChannelPlan() = default;
};

} // namespace mbfeat
