// The splat of one tile on a lane type; see splat.h. Internal.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <utility>
#include <vector>

#include "core/lane.h"
#include "denoise/splat.h"

namespace mbfeat {

template <class T>
class TileSplatter {
public:
    TileSplatter(const SplatInput& input, const SplatTile& tile)
        : in_(input),
          tile_(tile),
          radius_(input.kernel / 2),
          blockWidth_(roundUp(tile.x1 - tile.x0)),
          sourceWidth_(roundUp(blockWidth_ + 2 * radius_) + kWidth),
          sourceHeight_(tile.y1 - tile.y0 + 2 * radius_),
          hidden_(size(input.channels, sourceHeight_)),
          light_(size(input.lights, sourceHeight_)),
          alike_(size(input.alikeChannels, sourceHeight_)),
          scales_(size(guides::groups(input.guides), sourceHeight_)),
          logits_(size(input.kernel, 1)),
          sums_((static_cast<std::size_t>(input.lights) + 2) * blockSize()),
          weights_(static_cast<std::size_t>(input.kernel) * kWidth) {}

    void run(float* out) {
        if (!in_.apart) {
            clearSums();
        }
        for (int unit = 0; unit < in_.units; ++unit) {
            if (in_.apart) {
                clearSums();
            }
            load(unit);
            for (int y = tile_.y0; y < tile_.y1; ++y) {
                gather(unit, y);
            }
            if (in_.apart) {
                store(out, unit);
            }
        }
        if (!in_.apart) {
            store(out, 0);
        }
    }

private:
    static constexpr int kWidth = LaneTraits<T>::kWidth;
    static constexpr int kMostTaps = 13; ///< rows of logits at once, as many as have registers
    // Logits of what does not exist: below any that a network gives, and far from overflow.
    static constexpr float kOutside = -1e37F;

    static int roundUp(int n) { return (n + kWidth - 1) / kWidth * kWidth; }
    static T load(const float* from) {
        if constexpr (kWidth == 1) {
            return *from;
        } else {
            return T::load_unaligned(from);
        }
    }
    static void store(float* to, const T& value) {
        if constexpr (kWidth == 1) {
            *to = value;
        } else {
            value.store_unaligned(to);
        }
    }

    std::size_t size(int planes, int rows) const {
        return static_cast<std::size_t>(planes) * static_cast<std::size_t>(rows) *
               static_cast<std::size_t>(sourceWidth_);
    }
    std::size_t blockSize() const {
        return static_cast<std::size_t>(blockWidth_) *
               static_cast<std::size_t>(tile_.y1 - tile_.y0);
    }
    std::size_t pixels() const {
        return static_cast<std::size_t>(in_.width) * static_cast<std::size_t>(in_.height);
    }
    // Accumulators of a destination row: the largest logit, the sum of weights, those of lights.
    float* sums(int slot, int y) {
        return sums_.data() + static_cast<std::size_t>(slot) * blockSize() +
               static_cast<std::size_t>(y - tile_.y0) * static_cast<std::size_t>(blockWidth_);
    }

    void clearSums() {
        std::fill(sums_.begin(), sums_.end(), 0.0F);
        std::fill_n(sums_.begin(), blockSize(), kOutside);
    }

    /// Copies the unit's planes around the tile, zeros outside the image.
    void load(int unit) {
        copyPlanes(in_.hidden, unit, in_.channels, hidden_.data());
        copyPlanes(in_.light, unit, in_.lights, light_.data());
        copyPlanes(in_.alike, unit, in_.alikeChannels, alike_.data());
        if (in_.guides > 0) {
            copyPlanes(in_.scales, unit, guides::groups(in_.guides), scales_.data());
        }
    }

    void copyPlanes(const float* from, int unit, int planes, float* to) const {
        const int firstX = std::max(tile_.x0 - radius_, 0);
        const int lastX = std::min(tile_.x1 + radius_, in_.width);
        const int left = firstX - (tile_.x0 - radius_);
        const std::size_t plane = pixels();
        for (int p = 0; p < planes; ++p) {
            const float* const source =
                from + (static_cast<std::size_t>(unit) * static_cast<std::size_t>(planes) +
                        static_cast<std::size_t>(p)) *
                           plane;
            for (int row = 0; row < sourceHeight_; ++row, to += sourceWidth_) {
                const int y = tile_.y0 - radius_ + row;
                std::fill_n(to, sourceWidth_, 0.0F);
                if (y >= 0 && y < in_.height) {
                    std::copy_n(
                        source + static_cast<std::size_t>(y) * static_cast<std::size_t>(in_.width) +
                            static_cast<std::size_t>(firstX),
                        lastX - firstX, to + left);
                }
            }
        }
    }

    /// Adds all that a unit gives to a destination row.
    void gather(int unit, int y) {
        for (int j = 0; j < in_.kernel; ++j) {
            const int sourceY = y - radius_ + j;
            if (sourceY < 0 || sourceY >= in_.height) {
                continue;
            }
            const int row = sourceY - (tile_.y0 - radius_);
            for (int tap = 0; tap < in_.kernel; tap += kMostTaps) {
                const int count = std::min(in_.kernel - tap, kMostTaps);
                dispatch(count, std::make_integer_sequence<int, kMostTaps>{}, [&](auto taps) {
                    logitRows<taps.value>(j * in_.kernel + tap, row,
                                          logits_.data() +
                                              static_cast<std::size_t>(tap) *
                                                  static_cast<std::size_t>(sourceWidth_));
                });
            }
            maskOutside(unit, sourceY);
            for (int x = 0; x < blockWidth_; x += kWidth) {
                takeLogits(x);
                subtractDistances(x, y, row);
                add(x, y, row);
            }
        }
    }

    template <class F, int... Counts>
    static void dispatch(int count, std::integer_sequence<int, Counts...> /*counts*/, F&& body) {
        ((count == Counts + 1 ? body(std::integral_constant<int, Counts + 1>{}) : void()), ...);
    }

    /// Logits of `Taps` taps from `first` on, for a source row: [tap][x].
    template <int Taps>
    void logitRows(int first, int row, float* out) const {
        const float* const weight =
            in_.weight + static_cast<std::size_t>(first) * static_cast<std::size_t>(in_.channels);
        const std::size_t plane = size(1, sourceHeight_);
        const float* const hidden =
            hidden_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(sourceWidth_);
        for (int x = 0; x + kWidth <= sourceWidth_; x += kWidth) {
            std::array<T, Taps> sum;
            for (int t = 0; t < Taps; ++t) {
                sum[static_cast<std::size_t>(t)] = T(in_.bias[first + t]);
            }
            for (int c = 0; c < in_.channels; ++c) {
                const T h = load(hidden + static_cast<std::size_t>(c) * plane + x);
                for (int t = 0; t < Taps; ++t) {
                    const auto s = static_cast<std::size_t>(t);
                    sum[s] = fma(h,
                                 T(weight[s * static_cast<std::size_t>(in_.channels) +
                                          static_cast<std::size_t>(c)]),
                                 sum[s]);
                }
            }
            for (int t = 0; t < Taps; ++t) {
                const auto s = static_cast<std::size_t>(t);
                store(out + s * static_cast<std::size_t>(sourceWidth_) + x, sum[s]);
            }
        }
    }

    /// Logits of columns outside the image, and of units that are not there.
    void maskOutside(int unit, int sourceY) {
        const int left = std::max(radius_ - tile_.x0, 0);
        const int right = std::min(in_.width - (tile_.x0 - radius_), sourceWidth_);
        for (int t = 0; t < in_.kernel; ++t) {
            float* const row = logits_.data() +
                               static_cast<std::size_t>(t) * static_cast<std::size_t>(sourceWidth_);
            std::fill_n(row, left, kOutside);
            std::fill(row + right, row + sourceWidth_, kOutside);
            if (in_.presence == nullptr) {
                continue;
            }
            const float* const present =
                in_.presence + static_cast<std::size_t>(unit) * pixels() +
                static_cast<std::size_t>(sourceY) * static_cast<std::size_t>(in_.width);
            for (int x = left; x < right; ++x) {
                if (present[tile_.x0 - radius_ + x] == 0.0F) {
                    row[x] = kOutside;
                }
            }
        }
    }

    /// The logits with which a row of taps reaches the destinations from x (in the tile) on.
    void takeLogits(int x) {
        const auto k = static_cast<std::size_t>(in_.kernel);
        const auto width = static_cast<std::size_t>(sourceWidth_);
        for (std::size_t i = 0; i < k; ++i) {
            store(&weights_[i * kWidth], load(logits_.data() + i * width + i + x));
        }
    }

    void subtractDistances(int x, int y, int row) {
        const auto k = static_cast<std::size_t>(in_.kernel);
        const auto width = static_cast<std::size_t>(sourceWidth_);
        const auto radius = static_cast<std::size_t>(radius_);
        const std::size_t source = static_cast<std::size_t>(row) * width;
        const std::size_t here = static_cast<std::size_t>(y - tile_.y0 + radius_) * width + radius;
        const int learned = in_.alikeChannels - in_.guides;
        for (int c = 0; c < in_.alikeChannels; ++c) {
            const float* const plane = alike_.data() + size(c, sourceHeight_) + x;
            const T own = load(plane + here);
            T scale(1.0F);
            if (c >= learned) {
                scale = load(scales_.data() + size(guides::group(c - learned), sourceHeight_) + x +
                             here);
            }
            for (std::size_t i = 0; i < k; ++i) {
                const T change = (load(plane + source + i) - own) * scale;
                store(&weights_[i * kWidth], load(&weights_[i * kWidth]) - change * change);
            }
        }
    }

    /// Adds the row of taps to the destinations; its logits become weights.
    void add(int x, int y, int row) {
        const auto k = static_cast<std::size_t>(in_.kernel);
        const auto width = static_cast<std::size_t>(sourceWidth_);
        float* const largest = sums(0, y) + x;
        const T before = load(largest);
        T raised = before;
        for (std::size_t i = 0; i < k; ++i) {
            raised = max(raised, load(&weights_[i * kWidth]));
        }
        store(largest, raised);
        const T fade = exp(before - raised);
        T total = load(sums(1, y) + x) * fade;
        for (std::size_t i = 0; i < k; ++i) {
            const T w = exp(load(&weights_[i * kWidth]) - raised);
            total = total + w;
            store(&weights_[i * kWidth], w);
        }
        store(sums(1, y) + x, total);
        for (int c = 0; c < in_.lights; ++c) {
            const float* const light =
                light_.data() + size(c, sourceHeight_) + static_cast<std::size_t>(row) * width + x;
            T sum = load(sums(c + 2, y) + x) * fade;
            for (std::size_t i = 0; i < k; ++i) {
                sum = fma(load(&weights_[i * kWidth]), load(light + i), sum);
            }
            store(sums(c + 2, y) + x, sum);
        }
    }

    /// Writes what has arrived, or unless units are separate adds that of all but the first.
    void store(float* out, int unit) {
        const std::size_t plane = pixels();
        const bool isGated = in_.gate != nullptr && !in_.separate;
        const int lights = isGated ? in_.lights / 2 : in_.lights;
        if (in_.separate) {
            out += static_cast<std::size_t>(unit) * static_cast<std::size_t>(lights) * plane;
        }
        for (int y = tile_.y0; y < tile_.y1; ++y) {
            for (int x = tile_.x0; x < tile_.x1; ++x) {
                const int i = x - tile_.x0;
                const float total = sums(1, y)[i];
                // Where nothing exists every weight was exp(0).
                const bool reached = sums(0, y)[i] > kOutside && total > 0.0F;
                const std::size_t pixel =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(in_.width) +
                    static_cast<std::size_t>(x);
                for (int c = 0; c < lights; ++c) {
                    float value = reached ? sums(c + 2, y)[i] / total : 0.0F;
                    if (isGated && reached) {
                        const float divided = sums(lights + c + 2, y)[i] / total;
                        value = modulatedLight(in_, value, divided, unit, c % 3, pixel);
                    }
                    float& to = out[static_cast<std::size_t>(c) * plane + pixel];
                    to = unit > 0 && !in_.separate ? to + value : value;
                }
            }
        }
    }

    const SplatInput& in_;
    SplatTile tile_;
    int radius_, blockWidth_, sourceWidth_, sourceHeight_;
    /// [plane][row][x] of the unit, from -radius on
    std::vector<float> hidden_, light_, alike_, scales_;
    std::vector<float> logits_;  ///< [tap][x] of a source row
    std::vector<float> sums_;    ///< [slot][row][x]
    std::vector<float> weights_; ///< [tap][lane], logits before
};

} // namespace mbfeat
