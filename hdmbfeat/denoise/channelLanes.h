// ChannelPlan::writeGroup() on a lane type. Internal.
//
// The rows of a group of paths are transposed in registers, after which a channel is one store:
// written path by path, the channels of each lay a cache line apart, and that took longer than what
// a small network computes of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/laneMemory.h"
#include "core/laneQuads.h"
#include "denoise/channels.h"

namespace mbfeat {

template <class T>
class ChannelLanes {
public:
    explicit ChannelLanes(const ChannelPlan& plan) : plan_(plan) {
        // Memory of the thread, kept from group to group.
        thread_local std::vector<float> memory;
        memory.resize(std::max(memory.size(), plan.words() * kStride));
        fields_ = memory.data();
    }

    /// A bit for each of `count` paths, at most the width of the lanes; out[channel][kPathGroup].
    std::uint32_t run(const float* const* paths, int count, float* out) {
        transpose(paths, count);
        T check(0.0F);
        std::size_t channel = 0;
        for (const ChannelSource& source : plan_.sources()) {
            for (std::size_t i = 0; i < source.count; ++i, ++channel) {
                storeLanes<T>(out + channel * kPathGroup, value(source, i, check));
            }
        }
        for (const std::size_t light : plan_.lights()) {
            for (std::size_t i = 0; i < 3; ++i) {
                look(field(light + i), check);
            }
        }
        return cleared(check == T(0.0F), count, out);
    }

private:
    static constexpr int kWidth = LaneTraits<T>::kWidth;
    static constexpr std::size_t kStride = static_cast<std::size_t>(kWidth);
    static constexpr float kNumbersEnd = 4294967040.0F; ///< of those that hold 32 bits

    T field(std::size_t index) const { return loadLanes<T>(fields_ + index * kStride); }
    /// Zero times anything that is not finite is no number, and stays one in a sum.
    static void look(const T& value, T& check) { check = fma(T(0.0F), value, check); }

    /// Of all words that are read; lanes beyond `count` see the first path.
    void transpose(const float* const* paths, int count) {
        const auto path = [&](int lane) { return paths[lane < count ? lane : 0]; };
        for (const std::size_t first : plan_.quads()) {
            const auto quad = loadQuadsAt<T>([&](int lane) { return path(lane) + first; });
            float* const to = fields_ + first * kStride;
            storeLanes<T>(to, quad.x);
            storeLanes<T>(to + kStride, quad.y);
            storeLanes<T>(to + 2 * kStride, quad.z);
            storeLanes<T>(to + 3 * kStride, quad.w);
        }
        for (const std::size_t word : plan_.singles()) {
            for (int lane = 0; lane < kWidth; ++lane) {
                fields_[word * kStride + static_cast<std::size_t>(lane)] = path(lane)[word];
            }
        }
        for (const PathFieldPlace& number : plan_.numbers()) {
            float* const lanes = fields_ + number.word * kStride;
            for (std::size_t lane = 0; lane < kStride; ++lane) {
                lanes[lane] = PathFieldPlace{0, number.kind}.read(lanes + lane);
            }
        }
    }

    T value(const ChannelSource& source, std::size_t i, T& check) const {
        switch (source.kind) {
        case ChannelSource::Kind::kField: {
            const T found = field(source.field + i);
            look(found, check);
            return found;
        }
        case ChannelSource::Kind::kDirection: {
            const float* const axis = plan_.axis(source.axis);
            const T found = T(axis[0]) * field(source.field) +
                            T(axis[1]) * field(source.field + 1) +
                            T(axis[2]) * field(source.field + 2);
            look(found, check);
            return found;
        }
        case ChannelSource::Kind::kBit: {
            const T number = field(source.field);
            const Mask<T> isNumber = number >= T(0.0F) && number < T(kNumbersEnd);
            look(select(isNumber, T(0.0F), T(std::numeric_limits<float>::infinity())), check);
            const T shifted = floor(number * T(1.0F / static_cast<float>(source.bits)));
            return shifted - T(2.0F) * floor(shifted * T(0.5F));
        }
        case ChannelSource::Kind::kZero:
            break;
        }
        return T(0.0F);
    }

    /// Bits of the paths that are kept; the channels of all other lanes become zero.
    std::uint32_t cleared(const Mask<T>& finite, int count, float* out) const {
        LaneBuffer<T> kept(select(finite, T(1.0F), T(0.0F)));
        std::uint32_t bits = 0;
        for (int lane = 0; lane < kWidth; ++lane) {
            if (lane < count && kept[lane] != 0.0F) {
                bits |= 1U << static_cast<unsigned>(lane);
            } else {
                kept[lane] = 0.0F;
            }
        }
        const Mask<T> isKept = kept.lanes() != T(0.0F);
        if (!all(isKept)) {
            for (std::size_t channel = 0; channel < plan_.size(); ++channel) {
                float* const to = out + channel * kPathGroup;
                storeLanes<T>(to, select(isKept, loadLanes<T>(to), T(0.0F)));
            }
        }
        return bits;
    }

    const ChannelPlan& plan_;
    float* fields_; ///< [field][lane]
};

/// ChannelPlan::writeGroup() on a lane type.
template <class T>
std::uint32_t writeChannels(const ChannelPlan& plan, const float* const* paths, int count,
                            float* out) {
    constexpr int kWidth = LaneTraits<T>::kWidth;
    std::uint32_t bits = 0;
    for (int first = 0; first < kPathGroup; first += kWidth) {
        const int here = std::clamp(count - first, 0, kWidth);
        if (here == 0) {
            for (std::size_t channel = 0; channel < plan.size(); ++channel) {
                std::fill_n(out + channel * kPathGroup + first, kWidth, 0.0F);
            }
            continue;
        }
        const std::uint32_t found = ChannelLanes<T>(plan).run(paths + first, here, out + first);
        bits |= found << static_cast<unsigned>(first);
    }
    return bits;
}

} // namespace mbfeat
