// Discrete and piecewise-constant distributions. Weights that are negative or not finite count as
// zero; where all are zero the distribution is uniform and says so (isDegenerate).
#pragma once

#include <cstdint>
#include <vector>

#include "core/laneMemory.h"
#include "core/vec.h"

namespace mbfeat {

/// Picks an index with probability proportional to its weight in constant time (Walker 1977, in
/// the numerically stable form of Vose 1991).
class AliasTable {
public:
    AliasTable() = default;
    explicit AliasTable(const std::vector<double>& weights);

    struct Pick {
        std::uint32_t index = 0;
        float probability = 0.0F;
        float u = 0.0F; ///< the number left over, uniform in [0, 1)
    };
    /// u in [0, 1). The table must not be empty.
    Pick sample(float u) const;
    float probability(std::uint32_t index) const { return entries_[index].probability; }
    std::size_t size() const { return entries_.size(); }
    /// All weights were zero: every index is as likely as the others.
    bool isDegenerate() const { return degenerate_; }

private:
    struct Entry {
        float threshold = 1.0F; ///< below it the entry itself, else the alias
        std::uint32_t alias = 0;
        float probability = 0.0F;
    };
    std::vector<Entry> entries_;
    bool degenerate_ = false;
};

/// Density on [0, 1] that is constant on equal intervals.
class PiecewiseConstant1D {
public:
    PiecewiseConstant1D() = default;
    explicit PiecewiseConstant1D(const std::vector<double>& weights);

    struct Sample {
        float x = 0.0F; ///< [0, 1)
        float pdf = 0.0F;
        int index = 0;
        float fraction = 0.0F; ///< position within the interval, [0, 1)
    };
    Sample sample(float u) const;
    float pdf(float x) const;
    /// Probability of the interval.
    float probability(int index) const { return cdf_[index + 1] - cdf_[index]; }
    int size() const { return static_cast<int>(cdf_.size()) - 1; }
    bool isDegenerate() const { return degenerate_; }

private:
    std::vector<float> cdf_;
    bool degenerate_ = false;
};

/// Which interval of a distribution function a number falls in, for rows of such functions of
/// equally many intervals, lane by lane. Each row has a coarse table of the intervals that the ends
/// of equal parts of [0, 1) fall in, so that what is left to search lies in a cache line or two.
class IntervalGuide {
public:
    IntervalGuide() = default;
    /// `intervals` + 1 rising values a row, at most 32,768 intervals, and rows; cdf is not kept.
    IntervalGuide(const std::vector<float>& cdf, int intervals);

    /// The interval of row `row` with cdf[i] <= u < cdf[i + 1], of the cdf that the guide was made
    /// from; u in [0, 1).
    template <class T>
    IntLane<T> find(const std::vector<float>& cdf, const IntLane<T>& row, const T& u) const {
        // A power of two of parts: the product is exact.
        const IntLane<T> part = toInteger(u * T(static_cast<float>(parts_)));
        const IntLane<T> place = row * IntLane<T>(parts_ + 1) + part;
        const auto* const bytes = reinterpret_cast<const std::uint8_t*>(ends_.data());
        const IntLane<T> ends =
            gatherWordsAt<T>(bytes, place * IntLane<T>(static_cast<int>(sizeof(ends_[0]))));
        IntLane<T> low = ends & IntLane<T>(0xFFFF);
        IntLane<T> high = (ends >> 16) & IntLane<T>(0xFFFF);
        const IntLane<T> second = row * IntLane<T>(intervals_ + 1) + IntLane<T>(1);
        while (any(low < high)) {
            const IntLane<T> middle = (low + high) >> 1;
            const Mask<T> below = u < gatherLanes<T>(cdf.data(), second + middle);
            low = selectInt(below, low, min(middle + IntLane<T>(1), high));
            high = selectInt(below, middle, high);
        }
        return low;
    }

private:
    int intervals_ = 0, parts_ = 1;
    std::vector<std::uint16_t> ends_; ///< parts_ + 1 a row
};

/// Density on [0, 1]^2 that is constant on the cells of a grid, or several such densities, its
/// layers. Probabilities are differences of the stored distribution function, so they are exactly
/// those that sample() realises. At most 32,768 cells a side, and 2^28 in all layers (places among
/// them are 32-bit numbers); all lane types give the same bits.
class PiecewiseConstant2D {
public:
    PiecewiseConstant2D() = default;
    /// weights[(layer * height + y) * width + x], proportional to the probability of the cell in
    /// its layer.
    PiecewiseConstant2D(int width, int height, const std::vector<float>& weights, int layers = 1);

    template <class T>
    struct LaneSample {
        IntLane<T> x{}, y{}; ///< cell
        Vec2<T> fraction{};  ///< position within the cell, [0, 1)
        T probability{};     ///< of the cell
    };
    using Sample = LaneSample<float>;
    Sample sample(Float2 u) const { return sample<float>(u); }
    template <class T>
    LaneSample<T> sample(const Vec2<T>& u, const IntLane<T>& layer = IntLane<T>(0)) const {
        LaneSample<T> s;
        s.y = rowGuide_.find<T>(rows_, layer, u.y);
        const IntLane<T> line = layer * IntLane<T>(height_) + s.y;
        s.x = cellGuide_.find<T>(cdf_, line, u.x);
        const Ends<T> row = endsOf<T>(rows_, line + layer);
        const Ends<T> cell = endsOf<T>(cdf_, line * IntLane<T>(width_ + 1) + s.x);
        s.fraction = {cell.fraction(u.x), row.fraction(u.y)};
        s.probability = cell.probability() * row.probability();
        return s;
    }
    /// Probability of a cell. Density per unit area of the square is this times width * height.
    float probability(int x, int y) const { return probability<float>(x, y); }
    template <class T>
    T probability(const IntLane<T>& x, const IntLane<T>& y,
                  const IntLane<T>& layer = IntLane<T>(0)) const {
        const IntLane<T> line = layer * IntLane<T>(height_) + y;
        return endsOf<T>(cdf_, line * IntLane<T>(width_ + 1) + x).probability() *
               endsOf<T>(rows_, line + layer).probability();
    }
    int width() const { return width_; }
    int height() const { return height_; }
    /// All weights of all layers were zero.
    bool isDegenerate() const { return degenerate_; }

private:
    /// The distribution function at both ends of an interval.
    template <class T>
    struct Ends {
        T low, high;
        T probability() const { return high - low; }
        T fraction(const T& u) const {
            const T size = high - low;
            const Mask<T> wide = size > T(0);
            const T f = select(wide, (u - low) / select(wide, size, T(1)), T(0));
            return min(max(f, T(0)), T(kOneMinusEpsilon));
        }
    };
    template <class T>
    static Ends<T> endsOf(const std::vector<float>& cdf, const IntLane<T>& place) {
        return {gatherLanes<T>(cdf.data(), place), gatherLanes<T>(cdf.data() + 1, place)};
    }

    int width_ = 0, height_ = 0;
    std::vector<float> rows_; ///< height_ + 1 values a layer
    std::vector<float> cdf_;  ///< width_ + 1 values a row
    IntervalGuide rowGuide_, cellGuide_;
    bool degenerate_ = false;
};

} // namespace mbfeat
