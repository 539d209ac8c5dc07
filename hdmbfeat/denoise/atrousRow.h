// A pass of the à-trous filter over part of a row, on a lane type; see atrous.h. Internal.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/lane.h"
#include "core/laneMemory.h"
#include "denoise/atrous.h"

namespace mbfeat {

template <class T>
class ATrousRow {
public:
    ATrousRow(const ATrousPass& pass, int y) : in_(pass), y_(y) {
        for (int tap = 0; tap < atrous::kTaps; ++tap) {
            offsets_[static_cast<std::size_t>(tap)] =
                static_cast<std::ptrdiff_t>(y + pass.dilation * rowOf(tap)) * pass.width +
                static_cast<std::ptrdiff_t>(pass.dilation) * columnOf(tap);
        }
    }

    void run(int x0, int x1) {
        const int reach = atrous::kRadius * in_.dilation;
        const bool hasRows = y_ >= reach && y_ + reach < in_.height;
        for (int x = x0; x < x1; x += kWidth) {
            const bool isInside = hasRows && x >= reach && x + kWidth + reach <= in_.width;
            filter(x, std::min(x1 - x, kWidth), isInside);
        }
    }

private:
    static constexpr int kWidth = LaneTraits<T>::kWidth;
    // Logit of what does not exist: below any that a network gives, and far from overflow.
    static constexpr float kOutside = -1e37F;

    std::size_t pixels() const {
        return static_cast<std::size_t>(in_.width) * static_cast<std::size_t>(in_.height);
    }
    static int columnOf(int tap) { return tap % atrous::kSide - atrous::kRadius; }
    static int rowOf(int tap) { return tap / atrous::kSide - atrous::kRadius; }

    /// A plane's row as far down as a tap lies.
    const float* row(const float* plane, int tap) const {
        return plane + static_cast<std::ptrdiff_t>(y_ + in_.dilation * rowOf(tap)) * in_.width;
    }
    bool hasRow(int tap) const {
        const int y = y_ + in_.dilation * rowOf(tap);
        return y >= 0 && y < in_.height;
    }

    /// Lanes from x on, 0 outside the row.
    T at(const float* row, int x) const {
        if (x >= 0 && x + kWidth <= in_.width) {
            return loadLanes<T>(row + x);
        }
        std::array<float, kWidth> values{};
        for (int lane = std::max(-x, 0); lane < std::min(kWidth, in_.width - x); ++lane) {
            values[static_cast<std::size_t>(lane)] = row[x + lane];
        }
        return loadLanes<T>(values.data());
    }

    /// The tap's logit where there is a pixel.
    T masked(const T& logit, int x) const {
        if (x >= 0 && x + kWidth <= in_.width) {
            return logit;
        }
        std::array<float, kWidth> values;
        storeLanes<T>(values.data(), logit);
        for (int lane = 0; lane < kWidth; ++lane) {
            if (x + lane < 0 || x + lane >= in_.width) {
                values[static_cast<std::size_t>(lane)] = kOutside;
            }
        }
        return loadLanes<T>(values.data());
    }

    /// The scale plane of a feature; null where it has none.
    const float* scalesOf(int channel) const {
        const int guide = channel - (in_.alikeChannels - in_.guides);
        return guide < 0 ? nullptr
                         : in_.scales + static_cast<std::size_t>(guides::group(guide)) * pixels();
    }

    T apart(int tap, int x) const {
        const int there = x + in_.dilation * columnOf(tap);
        T sum(0.0F);
        const float* plane = in_.alike;
        for (int c = 0; c < in_.alikeChannels; ++c, plane += pixels()) {
            const float* const scales = scalesOf(c);
            const T scale = scales == nullptr ? T(1.0F) : at(row(scales, atrous::kMiddle), x);
            const T change =
                (at(row(plane, tap), there) - at(row(plane, atrous::kMiddle), x)) * scale;
            sum = fma(change, change, sum);
        }
        return sum;
    }

    /// Logits where all taps are inside: feature by feature, the sums of all taps in registers.
    void addLogitsInside(int x) {
        std::array<T, atrous::kTaps> sums{};
        const float* plane = in_.alike + x;
        for (int c = 0; c < in_.alikeChannels; ++c, plane += pixels()) {
            const T own = loadLanes<T>(plane + offsets_[atrous::kMiddle]);
            const float* const scales = scalesOf(c);
            const T scale =
                scales == nullptr ? T(1.0F) : loadLanes<T>(scales + offsets_[atrous::kMiddle] + x);
            for (std::size_t tap = 0; tap < atrous::kTaps; ++tap) {
                const T change = (loadLanes<T>(plane + offsets_[tap]) - own) * scale;
                sums[tap] = fma(change, change, sums[tap]);
            }
        }
        for (std::size_t tap = 0; tap < atrous::kTaps; ++tap) {
            weights_[tap] = fma(T(-in_.sharpness), sums[tap], T(in_.spatial[tap]));
        }
        T& middle = weights_[atrous::kMiddle];
        middle = loadLanes<T>(in_.centre + offsets_[atrous::kMiddle] + x) +
                 T(in_.spatial[atrous::kMiddle]);
    }

    void addLogits(int x) {
        for (int tap = 0; tap < atrous::kTaps; ++tap) {
            T& logit = weights_[static_cast<std::size_t>(tap)];
            if (tap == atrous::kMiddle) {
                logit = at(row(in_.centre, tap), x) + T(in_.spatial[tap]);
            } else if (hasRow(tap)) {
                logit = masked(fma(T(-in_.sharpness), apart(tap, x), T(in_.spatial[tap])),
                               x + in_.dilation * columnOf(tap));
            } else {
                logit = T(kOutside);
            }
        }
    }

    /// Weights of all taps, not yet divided by their sum.
    T weigh(int x, bool isInside) {
        if (isInside) {
            addLogitsInside(x);
        } else {
            addLogits(x);
        }
        T largest(kOutside);
        for (const T& logit : weights_) {
            largest = max(largest, logit);
        }
        T total(0.0F);
        for (T& weight : weights_) {
            weight = exp(weight - largest);
            total = total + weight;
        }
        return total;
    }

    T sumOf(const float* plane, int x, bool isInside) const {
        T sum(0.0F);
        for (std::size_t tap = 0; tap < atrous::kTaps; ++tap) {
            const int t = static_cast<int>(tap);
            if (isInside) {
                sum = fma(weights_[tap], loadLanes<T>(plane + offsets_[tap] + x), sum);
            } else if (hasRow(t)) {
                const T light = at(row(plane, t), x + in_.dilation * columnOf(t));
                sum = fma(weights_[tap], light, sum);
            }
        }
        return sum;
    }

    void filter(int x, int count, bool isInside) {
        const T total = weigh(x, isInside);
        for (int c = 0; c < in_.lights; ++c) {
            const std::size_t plane = static_cast<std::size_t>(c) * pixels();
            const T sum = sumOf(in_.light + plane, x, isInside);
            float* const to = in_.out + plane +
                              static_cast<std::size_t>(y_) * static_cast<std::size_t>(in_.width) +
                              static_cast<std::size_t>(x);
            std::array<float, kWidth> values;
            storeLanes<T>(values.data(), sum / total);
            std::copy_n(values.begin(), count, to);
        }
    }

    const ATrousPass& in_;
    int y_;
    std::array<std::ptrdiff_t, atrous::kTaps> offsets_{}; ///< of taps, from column 0 of a plane on
    std::array<T, atrous::kTaps> weights_{};
};

} // namespace mbfeat
