// Images of what a film holds.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <vector>

#include "film/filmImpl.h"

namespace mbfeat {

namespace {

constexpr int kMostChannels = 4; ///< of an AOV

std::int32_t toInt(float value) {
    constexpr float kLimit = 2147483520.0F; // the largest float below 2^31
    return std::isnan(value) ? 0 : static_cast<std::int32_t>(std::clamp(value, -kLimit, kLimit));
}

} // namespace

void Film::Impl::resolveMean(const PixelValues& pixel, int slot, int width, float* out) {
    const double scale = meanScale(pixel.sums[0], pixel.count);
    for (int c = 0; c < width; ++c) {
        out[c] = static_cast<float>(pixel.sums[slot + c] * scale);
    }
}

/// Variance of the ratio sum w x / sum w by linearisation, n / (n - 1) sum w^2 (x - m)^2 / (sum
/// w)^2: with equal weights the unbiased s^2 / n.
void Film::Impl::resolveVariance(const PixelValues& pixel, float* out) const {
    const double n = pixel.count;
    const double total = pixel.sums[0];
    if (n < 2.0 || total == 0.0) {
        std::fill(out, out + 3, 0.0F);
        return;
    }
    const Spread spread = readSpread(pixel.sums + spreadSlot);
    const int colorSlot = 1 + means.slot(aovs.front().recordOffset);
    for (int c = 0; c < 3; ++c) {
        const double shift = spread.mean[c] - pixel.sums[colorSlot + c] / total;
        const double squares = spread.squares[c] + spread.weight * shift * shift;
        out[c] = static_cast<float>(n / (n - 1.0) * squares / (total * total));
    }
}

template <class T>
void Film::Impl::resolvePixel(int aovIndex, const PixelValues& pixel, T* out) const {
    const AovDescriptor& aov = aovs[static_cast<std::size_t>(aovIndex)];
    const int slot = slots[static_cast<std::size_t>(aovIndex)];
    const int width = aov.width();
    const auto convert = [](auto value) {
        if constexpr (std::is_same_v<T, float> || std::is_integral_v<decltype(value)>) {
            return static_cast<T>(value);
        } else {
            return toInt(value);
        }
    };
    if (pixel.count == 0) {
        std::fill(out, out + width, convert(aov.clearValue));
        return;
    }
    float values[kMostChannels];
    switch (aov.reduction) {
    case AovReduction::kSum: {
        const bool ofSamples = aov.recordOffset == kNoRecordField;
        *out = static_cast<T>(ofSamples ? pixel.count : pixel.words[nonFiniteSlot]);
        return;
    }
    case AovReduction::kMean:
        resolveMean(pixel, slot, width, values);
        break;
    case AovReduction::kVariance:
        resolveVariance(pixel, values);
        break;
    case AovReduction::kNearest:
        if (aov.type == AovType::kInt) {
            for (int c = 0; c < width; ++c) {
                out[c] = convert(static_cast<std::int32_t>(pixel.words[slot + c]));
            }
            return;
        }
        std::memcpy(values, pixel.words + slot, static_cast<std::size_t>(width) * sizeof(float));
        break;
    }
    std::transform(values, values + width, out, convert);
}

template <class T>
void Film::Impl::resolveAll(int aovIndex, T* out) const {
    const int width = aovs[static_cast<std::size_t>(aovIndex)].width();
    T* to = out;
    for (std::size_t pixel = 0; pixel < pixelCount(); ++pixel, to += width) {
        if (counts->data()[pixel].load() == 0) { // a viewer's first images have many such pixels
            resolvePixel(aovIndex, {0, nullptr, nullptr}, to);
            continue;
        }
        const HeldPixel held(counts->data()[pixel]);
        resolvePixel(aovIndex, {held.count(), sumsOf(pixel), wordsOf(pixel)}, to);
    }
    replaceReconstructed(aovIndex, 0, pixelCount(), out);
}

/// Colours of consecutive pixels that were reconstructed take the place of what they resolved to.
template <class T>
void Film::Impl::replaceReconstructed(int aovIndex, std::size_t firstPixel, std::size_t pixels,
                                      T* out) const {
    if constexpr (std::is_same_v<T, float>) {
        if (!denoiser) {
            return;
        }
        const AovDescriptor& aov = aovs[static_cast<std::size_t>(aovIndex)];
        const std::vector<std::string>& names = denoiser->aovs();
        const auto found = std::find(names.begin(), names.end(), aov.name);
        std::shared_ptr<const std::vector<float>> image;
        {
            const std::lock_guard lock(reconstructionMutex);
            image = reconstruction;
        }
        if (!image || found == names.end()) {
            return;
        }
        const auto light = static_cast<std::size_t>(found - names.begin());
        const auto width = static_cast<std::size_t>(aov.width());
        for (std::size_t c = 0; c < 3; ++c) {
            const float* const from = image->data() + (light * 3 + c) * pixelCount() + firstPixel;
            for (std::size_t i = 0; i < pixels; ++i) {
                out[i * width + c] = from[i];
            }
        }
    }
}

FilmRow::FilmRow(const Film& film)
    : film_(*film.impl_),
      counts_(static_cast<std::size_t>(film_.window.data.width)),
      sums_(counts_.size() * static_cast<std::size_t>(film_.sumStride)),
      words_(counts_.size() * static_cast<std::size_t>(film_.wordStride)) {}

void FilmRow::read(int row) {
    row_ = row;
    const auto sumStride = static_cast<std::size_t>(film_.sumStride);
    const auto wordStride = static_cast<std::size_t>(film_.wordStride);
    const std::size_t first = static_cast<std::size_t>(row) * counts_.size();
    for (std::size_t i = 0; i < counts_.size(); ++i) {
        const HeldPixel held(film_.counts->data()[first + i]);
        counts_[i] = held.count();
        const double* const sums = film_.sumsOf(first + i);
        std::copy(sums, sums + sumStride, sums_.data() + i * sumStride);
        const std::uint32_t* const words = film_.wordsOf(first + i);
        std::copy(words, words + wordStride, words_.data() + i * wordStride);
    }
}

template <class T>
void FilmRow::resolveTo(int aovIndex, T* out) const {
    const int width = film_.aovs[static_cast<std::size_t>(aovIndex)].width();
    for (std::size_t i = 0; i < counts_.size(); ++i, out += width) {
        film_.resolvePixel(aovIndex,
                           {counts_[i],
                            sums_.data() + i * static_cast<std::size_t>(film_.sumStride),
                            words_.data() + i * static_cast<std::size_t>(film_.wordStride)},
                           out);
    }
}

/// Most AOVs are means of one to four channels: short loops of known length.
template <int Width>
void FilmRow::resolveMeans(const AovDescriptor& aov, int slot, float* out) const {
    const double* sums = sums_.data();
    for (const std::uint32_t count : counts_) {
        if (count == 0) {
            std::fill(out, out + Width, aov.clearValue);
        } else {
            const double scale = Film::Impl::meanScale(sums[0], count);
            for (int c = 0; c < Width; ++c) {
                out[c] = static_cast<float>(sums[slot + c] * scale);
            }
        }
        sums += film_.sumStride;
        out += Width;
    }
}

void FilmRow::resolve(int aovIndex, float* out) const {
    const AovDescriptor& aov = film_.aovs[static_cast<std::size_t>(aovIndex)];
    const int slot = film_.slots[static_cast<std::size_t>(aovIndex)];
    if (aov.reduction == AovReduction::kMean && aov.width() == 3) {
        resolveMeans<3>(aov, slot, out);
    } else if (aov.reduction == AovReduction::kMean && aov.width() == 1) {
        resolveMeans<1>(aov, slot, out);
    } else {
        resolveTo(aovIndex, out);
    }
    film_.replaceReconstructed(aovIndex, static_cast<std::size_t>(row_) * counts_.size(),
                               counts_.size(), out);
}

void FilmRow::resolveInt(int aovIndex, std::int32_t* out) const {
    resolveTo(aovIndex, out);
}

void Film::resolve(int aovIndex, float* out) const {
    impl_->resolveAll(aovIndex, out);
}

void Film::resolveInt(int aovIndex, std::int32_t* out) const {
    impl_->resolveAll(aovIndex, out);
}

} // namespace mbfeat
