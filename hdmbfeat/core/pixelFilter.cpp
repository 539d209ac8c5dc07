#include "core/pixelFilter.h"

#include <algorithm>
#include <cmath>

namespace mbfeat {

namespace {

/// Intervals of the tabulated density. Even, so that the centre is a node.
constexpr int kIntervals = 1024;
constexpr float kMinWidth = 0.01F; // one too small is a point all the same
constexpr float kMaxWidth = 64.0F;

float triangle(float x) {
    return 1.0F - std::abs(x);
}

/// Gaussian of three standard deviations to the edge, lowered so that it ends at zero.
float gaussian(float x) {
    const auto bell = [](float t) { return std::exp(-4.5F * t * t); };
    return bell(x) - bell(1.0F);
}

/// Four-term Blackman-Harris window (Harris 1978, "On the Use of Windows for Harmonic Analysis
/// with the Discrete Fourier Transform", table 1, minimum 4-term, -92 dB).
float blackmanHarris(float x) {
    const float t = kPi * x;
    return 0.35875F + 0.48829F * std::cos(t) + 0.14128F * std::cos(2.0F * t) +
           0.01168F * std::cos(3.0F * t);
}

/// Mitchell and Netravali 1988 with B = C = 1/3, whose support of [-2, 2] is scaled to [-1, 1].
float mitchell(float x) {
    constexpr float b = 1.0F / 3.0F, c = 1.0F / 3.0F;
    const float t = std::abs(2.0F * x);
    const float t2 = t * t;
    if (t < 1.0F) {
        return ((12.0F - 9.0F * b - 6.0F * c) * t2 * t + (-18.0F + 12.0F * b + 6.0F * c) * t2 +
                (6.0F - 2.0F * b)) /
               6.0F;
    }
    return ((-b - 6.0F * c) * t2 * t + (6.0F * b + 30.0F * c) * t2 + (-12.0F * b - 48.0F * c) * t +
            (8.0F * b + 24.0F * c)) /
           6.0F;
}

/// One-dimensional profile, not normalised, on [-1, 1].
float profile(PixelFilter filter, float x) {
    switch (filter) {
    case PixelFilter::kBox:
        return 1.0F;
    case PixelFilter::kTriangle:
        return triangle(x);
    case PixelFilter::kGaussian:
        return gaussian(x);
    case PixelFilter::kBlackmanHarris:
        return blackmanHarris(x);
    case PixelFilter::kMitchell:
        return mitchell(x);
    }
    return 1.0F;
}

float nodePosition(int i) {
    return 2.0F * static_cast<float>(i) / kIntervals - 1.0F;
}

} // namespace

FilterSampler::FilterSampler(PixelFilter filter, float width)
    : filter_(filter),
      radius_(0.5F),
      cdf_(kIntervals + 1),
      density_(kIntervals + 1) {
    radius_ = 0.5F * (std::isfinite(width) ? std::clamp(width, kMinWidth, kMaxWidth) : 1.0F);
    std::vector<double> cumulative(kIntervals + 1, 0.0);
    double signedArea = 0.0;
    for (int i = 0; i <= kIntervals; ++i) {
        density_[i] = std::abs(profile(filter, nodePosition(i)));
        // Rounding of a profile that ends at zero must not leave a speck of density there.
        density_[i] = density_[i] < 1e-6F ? 0.0F : density_[i];
    }
    for (int i = 0; i < kIntervals; ++i) {
        const double mean = 0.5 * (static_cast<double>(density_[i]) + density_[i + 1]);
        const bool negative = profile(filter, nodePosition(i) + 1.0F / kIntervals) < 0.0F;
        const double sign = negative && mean > 0.0 ? -1.0 : 1.0;
        hasNegative_ = hasNegative_ || sign < 0.0;
        cumulative[i + 1] = cumulative[i] + mean * (2.0 / kIntervals);
        signedArea += sign * mean * (2.0 / kIntervals);
    }
    const double area = cumulative[kIntervals];
    for (int i = 0; i <= kIntervals; ++i) {
        cdf_[i] = static_cast<float>(cumulative[i] / area);
        density_[i] = static_cast<float>(density_[i] / area);
    }
    guide_.resize(kIntervals);
    for (std::size_t k = 0; k < guide_.size(); ++k) {
        const float u = static_cast<float>(k) / kIntervals;
        guide_[k] = static_cast<std::uint16_t>(
            std::upper_bound(cdf_.begin() + 1, cdf_.end() - 1, u) - cdf_.begin());
    }
    const double ratio = area / signedArea;
    normalisation_ = static_cast<float>(ratio * ratio);
}

/// Inverts the distribution function of a density that is linear between the nodes.
float FilterSampler::invert(float u) const {
    // The guide leaves a step or two of what would be a search over the whole table.
    // A u that was rounded up to 1 belongs to the last entry.
    const auto entry = static_cast<std::size_t>(u * kIntervals);
    std::size_t above = guide_[std::min(entry, guide_.size() - 1)];
    while (above < kIntervals && !(cdf_[above] > u)) {
        ++above;
    }
    const std::size_t i = above - 1;
    const float d0 = density_[i], d1 = density_[i + 1];
    // Solve d0 t + (d1 - d0) t^2 / 2 = rest / h for t in [0, 1]; this form has no cancellation.
    const float rest = (u - cdf_[i]) * (0.5F * kIntervals);
    const float root = std::sqrt(std::max(0.0F, d0 * d0 + 2.0F * (d1 - d0) * rest));
    const float denominator = d0 + root;
    const float t = denominator > 0.0F ? 2.0F * rest / denominator : 0.0F;
    return nodePosition(static_cast<int>(i)) + std::min(t, 1.0F) * (2.0F / kIntervals);
}

FilterSample FilterSampler::sample(Float2 u) const {
    FilterSample result;
    if (filter_ == PixelFilter::kBox) {
        result.offset = {radius_ * (2.0F * u.x - 1.0F), radius_ * (2.0F * u.y - 1.0F)};
        return result;
    }
    const Float2 p{invert(u.x), invert(u.y)};
    result.offset = {radius_ * p.x, radius_ * p.y};
    const bool negative =
        hasNegative_ && (profile(filter_, p.x) < 0.0F) != (profile(filter_, p.y) < 0.0F);
    result.weight = negative ? -normalisation_ : normalisation_;
    return result;
}

float FilterSampler::pdf(Float2 offset) const {
    const auto along = [&](float x) {
        const float t = x / radius_;
        if (!(std::abs(t) <= 1.0F)) {
            return 0.0F;
        }
        const float position = 0.5F * (t + 1.0F) * kIntervals;
        const int i = std::min(static_cast<int>(position), kIntervals - 1);
        const float f = position - static_cast<float>(i);
        return (density_[i] + f * (density_[i + 1] - density_[i])) / radius_;
    };
    return along(offset.x) * along(offset.y);
}

float FilterSampler::evaluate(Float2 offset) const {
    const float px = offset.x / radius_, py = offset.y / radius_;
    if (!(std::abs(px) <= 1.0F) || !(std::abs(py) <= 1.0F)) {
        return 0.0F;
    }
    const bool negative = (profile(filter_, px) < 0.0F) != (profile(filter_, py) < 0.0F);
    return (negative ? -normalisation_ : normalisation_) * pdf(offset);
}

} // namespace mbfeat
