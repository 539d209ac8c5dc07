#include "core/distribution.h"

#include <algorithm>
#include <cmath>

namespace mbfeat {

namespace {

/// The weights that count: finite and positive ones.
double usable(double weight) {
    return std::isfinite(weight) && weight > 0.0 ? weight : 0.0;
}

/// Fills cdf[0..n] from n weights, rising from 0 to exactly 1. Returns the sum; 0 makes it uniform.
template <class Weight>
double fillCdf(const Weight* weights, int n, float* cdf) {
    // Scaled by the largest weight: a sum of huge weights must not overflow.
    double largest = 0.0;
    for (int i = 0; i < n; ++i) {
        largest = std::max(largest, usable(static_cast<double>(weights[i])));
    }
    double scaled = 0.0;
    for (int i = 0; i < n && largest > 0.0; ++i) {
        scaled += usable(static_cast<double>(weights[i])) / largest;
    }
    double sum = 0.0;
    cdf[0] = 0.0F;
    for (int i = 0; i < n; ++i) {
        sum += largest > 0.0 ? usable(static_cast<double>(weights[i])) / largest : 1.0;
        cdf[i + 1] = static_cast<float>(sum / (largest > 0.0 ? scaled : n));
    }
    cdf[n] = 1.0F;
    // Rounding may leave the last intervals of weight zero with a speck: flatten them.
    for (int i = n - 1; i > 0 && largest > 0.0; --i) {
        if (usable(static_cast<double>(weights[i])) > 0.0) {
            break;
        }
        cdf[i] = 1.0F;
    }
    return largest > 0.0 ? scaled * largest : 0.0;
}

/// The interval of a distribution function that u in [0, 1) falls in; never an empty one.
int findInterval(const float* cdf, int n, float u) {
    const float* above = std::upper_bound(cdf + 1, cdf + n, u);
    return static_cast<int>(above - cdf) - 1;
}

float fractionWithin(const float* cdf, int i, float u) {
    const float width = cdf[i + 1] - cdf[i];
    const float f = width > 0.0F ? (u - cdf[i]) / width : 0.0F;
    return std::clamp(f, 0.0F, kOneMinusEpsilon);
}

} // namespace

AliasTable::AliasTable(const std::vector<double>& weights) : entries_(weights.size()) {
    const std::size_t n = weights.size();
    double largest = 0.0, sum = 0.0;
    for (const double w : weights) {
        largest = std::max(largest, usable(w));
    }
    degenerate_ = !(largest > 0.0);
    std::vector<double> scaled(n, 1.0);
    for (std::size_t i = 0; i < n && !degenerate_; ++i) {
        scaled[i] = usable(weights[i]) / largest;
        sum += scaled[i];
    }
    std::vector<std::uint32_t> small, large;
    for (std::size_t i = 0; i < n; ++i) {
        const double probability = degenerate_ ? 1.0 / n : scaled[i] / sum;
        entries_[i].probability = static_cast<float>(probability);
        entries_[i].alias = static_cast<std::uint32_t>(i);
        scaled[i] = probability * n;
        (scaled[i] < 1.0 ? small : large).push_back(static_cast<std::uint32_t>(i));
    }
    while (!small.empty() && !large.empty()) {
        const std::uint32_t s = small.back(), l = large.back();
        small.pop_back();
        entries_[s].threshold = static_cast<float>(scaled[s]);
        entries_[s].alias = l;
        scaled[l] = (scaled[l] + scaled[s]) - 1.0;
        if (scaled[l] < 1.0) {
            large.pop_back();
            small.push_back(l);
        }
    }
    // What is left is one up to rounding, except that an index of weight zero must not be picked.
    for (const std::uint32_t i : small) {
        if (entries_[i].probability == 0.0F) {
            entries_[i].threshold = 0.0F;
            entries_[i].alias = static_cast<std::uint32_t>(
                std::max_element(weights.begin(), weights.end(),
                                 [](double a, double b) { return usable(a) < usable(b); }) -
                weights.begin());
        }
    }
}

AliasTable::Pick AliasTable::sample(float u) const {
    const auto n = static_cast<float>(entries_.size());
    const auto last = static_cast<std::uint32_t>(entries_.size() - 1);
    const float scaled = u * n;
    const std::uint32_t slot = std::min(static_cast<std::uint32_t>(scaled), last);
    const float rest = std::min(scaled - static_cast<float>(slot), kOneMinusEpsilon);
    const Entry& entry = entries_[slot];
    Pick pick;
    if (rest < entry.threshold) {
        pick.index = slot;
        pick.u = rest / entry.threshold;
    } else {
        pick.index = entry.alias;
        pick.u = (rest - entry.threshold) / (1.0F - entry.threshold);
    }
    pick.u = std::min(pick.u, kOneMinusEpsilon);
    pick.probability = entries_[pick.index].probability;
    return pick;
}

PiecewiseConstant1D::PiecewiseConstant1D(const std::vector<double>& weights)
    : cdf_(weights.size() + 1) {
    degenerate_ = !(fillCdf(weights.data(), static_cast<int>(weights.size()), cdf_.data()) > 0.0);
}

PiecewiseConstant1D::Sample PiecewiseConstant1D::sample(float u) const {
    Sample s;
    s.index = findInterval(cdf_.data(), size(), u);
    s.fraction = fractionWithin(cdf_.data(), s.index, u);
    s.x = std::min((static_cast<float>(s.index) + s.fraction) / static_cast<float>(size()),
                   kOneMinusEpsilon);
    s.pdf = probability(s.index) * static_cast<float>(size());
    return s;
}

float PiecewiseConstant1D::pdf(float x) const {
    if (!(x >= 0.0F && x < 1.0F)) {
        return 0.0F;
    }
    const int i = std::min(static_cast<int>(x * static_cast<float>(size())), size() - 1);
    return probability(i) * static_cast<float>(size());
}

IntervalGuide::IntervalGuide(const std::vector<float>& cdf, int intervals) : intervals_(intervals) {
    // One part for every four to eight intervals: what is left is searched in two or three steps,
    // and the table has an eighth of the bytes of the function.
    while (parts_ * 8 <= intervals) {
        parts_ *= 2;
    }
    const auto rowValues = static_cast<std::size_t>(intervals) + 1;
    ends_.reserve(cdf.size() / rowValues * (static_cast<std::size_t>(parts_) + 1));
    for (std::size_t row = 0; row < cdf.size(); row += rowValues) {
        for (int part = 0; part <= parts_; ++part) {
            const float end = static_cast<float>(part) / static_cast<float>(parts_);
            ends_.push_back(
                static_cast<std::uint16_t>(findInterval(cdf.data() + row, intervals, end)));
        }
    }
}

PiecewiseConstant2D::PiecewiseConstant2D(int width, int height, const std::vector<float>& weights,
                                         int layers)
    : width_(width),
      height_(height) {
    const auto lines = static_cast<std::size_t>(height) * layers;
    cdf_.resize((static_cast<std::size_t>(width) + 1) * lines);
    rows_.resize((static_cast<std::size_t>(height) + 1) * layers);
    std::vector<double> sums(lines);
    for (std::size_t line = 0; line < lines; ++line) {
        sums[line] = fillCdf(&weights[line * width], width, &cdf_[line * (width + std::size_t{1})]);
    }
    degenerate_ = true;
    for (std::size_t layer = 0; layer < static_cast<std::size_t>(layers); ++layer) {
        const double sum =
            fillCdf(&sums[layer * height], height, &rows_[layer * (height + std::size_t{1})]);
        degenerate_ = degenerate_ && !(sum > 0.0);
    }
    rowGuide_ = IntervalGuide(rows_, height);
    cellGuide_ = IntervalGuide(cdf_, width);
}

} // namespace mbfeat
