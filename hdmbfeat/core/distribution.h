// Discrete and piecewise-constant distributions. Weights that are negative or not finite count as
// zero; where all are zero the distribution is uniform and says so (isDegenerate).
#pragma once

#include <cstdint>
#include <vector>

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
    friend class PiecewiseConstant2D;
    std::vector<float> cdf_;
    bool degenerate_ = false;
};

/// Density on [0, 1]^2 that is constant on the cells of a grid. Probabilities are differences of
/// the stored distribution function, so they are exactly those that sample() realises.
class PiecewiseConstant2D {
public:
    PiecewiseConstant2D() = default;
    /// weights[y * width + x], proportional to the probability of the cell.
    PiecewiseConstant2D(int width, int height, const std::vector<float>& weights);

    struct Sample {
        int x = 0, y = 0;            ///< cell
        Float2 fraction{0.0F, 0.0F}; ///< position within the cell, [0, 1)
        float probability = 0.0F;    ///< of the cell
    };
    Sample sample(Float2 u) const;
    /// Probability of a cell. Density per unit area of the square is this times width * height.
    float probability(int x, int y) const;
    int width() const { return width_; }
    int height() const { return rows_.size(); }
    bool isDegenerate() const { return rows_.isDegenerate(); }

private:
    int width_ = 0;
    PiecewiseConstant1D rows_;
    std::vector<float> cdf_; ///< width_ + 1 values a row
};

} // namespace mbfeat
