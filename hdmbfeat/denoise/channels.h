// From kept paths to what a network is given.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbfeat {

/// Paths of an image: float[height][width][capacity][fields]. Memory of the caller.
struct PathSamples {
    int width = 0, height = 0, capacity = 0;
    const float* data = nullptr;
    std::vector<std::string> fields; ///< names of a path's floats, see pathSampleFields()
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
    std::size_t count = 1;  ///< of neighbouring channels from neighbouring fields, or zeros
    std::size_t field = 0;  ///< of a direction: its x
    std::uint32_t bits = 0; ///< one bit
    std::size_t axis = 0;   ///< of the camera
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
    std::size_t fieldCount() const { return fieldCount_; } ///< floats of a path
    const std::vector<ChannelSource>& sources() const { return sources_; }
    /// An axis of the camera in the world, three floats.
    const float* axis(std::size_t index) const { return rotation_ + 3 * index; }
    /// Places of the colours' first fields.
    const std::vector<std::size_t>& lights() const { return lights_; }

private:
    void append(const ChannelSource& source);

    std::vector<ChannelSource> sources_;
    std::vector<std::size_t> lights_;
    std::size_t size_ = 0; ///< channels
    std::size_t fieldCount_ = 0;
    float rotation_[9] = {};

    ChannelPlan() = default;
};

} // namespace mbfeat
