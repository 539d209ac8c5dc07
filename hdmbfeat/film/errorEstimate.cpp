#include "film/errorEstimate.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mbfeat {

namespace {

constexpr double kRegulariser = 0.01; ///< of squared radiance: darker pixels need not be as exact
constexpr double kLargest = 1e30;     ///< of a squared error, so that sums of floats stay finite
constexpr int kSmoothRadius = ErrorMap::kWindow / 2;

/// Median of up to nine numbers, of an even count the lower one.
float median(std::array<float, 9>& values, int count) {
    float* const middle = values.data() + (count - 1) / 2;
    std::nth_element(values.data(), middle, values.data() + count);
    return *middle;
}

/// Stands for the value of a pixel with these halves: between the smaller and their mean, and never
/// far above the smaller.
float darkerHalf(float a, float b) {
    const float smaller = std::min(a, b);
    if (smaller <= 0.0F) {
        return smaller;
    }
    const float larger = std::max(a, b);
    return smaller * (0.5F + 1.0F / (1.0F + smaller / larger));
}

} // namespace

HalfSums::HalfSums(const PixelRect& data)
    : data_(data),
      pixels_(static_cast<std::size_t>(data.width) * static_cast<std::size_t>(data.height)) {}

void HalfSums::add(int x, int y, int half, ConstPathRecords records, int count) {
    Pixel& pixel =
        pixels_[static_cast<std::size_t>(y - data_.y) * static_cast<std::size_t>(data_.width) +
                static_cast<std::size_t>(x - data_.x)];
    for (int i = 0; i < count; ++i) {
        Sums& sums = pixel.half[(half + i) % 2];
        const PathRecord& record = records[static_cast<std::size_t>(i)];
        const double weight = record.filterWeight;
        sums.weight += weight;
        sums.value[0] += weight * static_cast<double>(record.radiance.x);
        sums.value[1] += weight * static_cast<double>(record.radiance.y);
        sums.value[2] += weight * static_cast<double>(record.radiance.z);
    }
}

bool HalfSums::means(int column, int row, Rgb& a, Rgb& b) const {
    const Pixel& sums = pixel(column, row);
    if (sums.half[0].weight == 0.0 || sums.half[1].weight == 0.0) {
        return false;
    }
    const auto mean = [](const Sums& half) {
        const double scale = 1.0 / half.weight;
        return Rgb(static_cast<float>(half.value[0] * scale),
                   static_cast<float>(half.value[1] * scale),
                   static_cast<float>(half.value[2] * scale));
    };
    a = mean(sums.half[0]);
    b = mean(sums.half[1]);
    return true;
}

void ErrorMap::update(const HalfSums& sums, const RowLoop& loop) {
    width_ = sums.data().width;
    height_ = sums.data().height;
    const std::size_t pixels = index(height_);
    mean_.resize(pixels);
    raw_.resize(pixels);
    columns_.resize(pixels);
    smooth_.resize(pixels);
    differences_.resize(pixels);
    darker_.resize(pixels);
    loop(height_, [&](int y) {
        for (int x = 0; x < width_; ++x) {
            const std::size_t i = index(y) + static_cast<std::size_t>(x);
            Rgb a(0.0F), b(0.0F);
            sums.means(x, y, a, b); // a pixel without samples is black and exact
            mean_[i] = a * 0.5F + b * 0.5F;
            differences_[i] = a * 0.5F - b * 0.5F;
            darker_[i] = Rgb(darkerHalf(a.x, b.x), darkerHalf(a.y, b.y), darkerHalf(a.z, b.z));
        }
    });
    loop(height_, [&](int y) {
        for (int x = 0; x < width_; ++x) {
            std::array<float, 9> red{}, green{}, blue{};
            int count = 0;
            for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v) {
                for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u) {
                    const Rgb& mean = mean_[index(v) + static_cast<std::size_t>(u)];
                    const auto k = static_cast<std::size_t>(count++);
                    red[k] = mean.x;
                    green[k] = mean.y;
                    blue[k] = mean.z;
                }
            }
            const auto relative = [count](double difference, float darker,
                                          std::array<float, 9>& means) {
                const double n = std::max(median(means, count), darker);
                return difference * difference / (n * n + kRegulariser);
            };
            const std::size_t i = index(y) + static_cast<std::size_t>(x);
            const Rgb& d = differences_[i];
            const double sum = relative(d.x, darker_[i].x, red) +
                               relative(d.y, darker_[i].y, green) +
                               relative(d.z, darker_[i].z, blue);
            raw_[i] = static_cast<float>(std::min(sum / 3.0, kLargest));
        }
    });
    loop(height_, [&](int y) {
        const int first = std::max(y - kSmoothRadius, 0);
        const int last = std::min(y + kSmoothRadius, height_ - 1);
        for (int x = 0; x < width_; ++x) {
            float sum = 0.0F;
            for (int v = first; v <= last; ++v) {
                sum += raw_[index(v) + static_cast<std::size_t>(x)];
            }
            columns_[index(y) + static_cast<std::size_t>(x)] =
                sum / static_cast<float>(last - first + 1);
        }
    });
    loop(height_, [&](int y) {
        const float* const in = &columns_[index(y)];
        for (int x = 0; x < width_; ++x) {
            const int first = std::max(x - kSmoothRadius, 0);
            const int last = std::min(x + kSmoothRadius, width_ - 1);
            float sum = 0.0F;
            for (int u = first; u <= last; ++u) {
                sum += in[u];
            }
            smooth_[index(y) + static_cast<std::size_t>(x)] =
                sum / static_cast<float>(last - first + 1);
        }
    });
}

ErrorEstimate ErrorMap::estimate() const {
    double sum = 0.0;
    for (const float square : raw_) {
        sum += static_cast<double>(square);
    }
    std::vector<float> smooth = smooth_;
    const double mean = sum / std::max(static_cast<double>(raw_.size()), 1.0);
    return {std::sqrt(mean), std::sqrt(static_cast<double>(quantile(smooth, 0.95)))};
}

float quantile(std::vector<float>& values, double share) {
    if (values.empty()) {
        return 0.0F;
    }
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
}

} // namespace mbfeat
