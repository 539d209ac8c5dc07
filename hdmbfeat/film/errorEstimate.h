// How far an image is from the one that more samples would give, told from the samples.
//
// The samples of a pixel alternate between two independent sequences of points (see
// alternatingIndex()), and each half has a mean, a and b. The pixel's value is m = (a + b) / 2, and
// ((a - b) / 2)^2 is an unbiased estimate of its variance for any kind of points; the spread of
// single samples is not, since stratified points do better than it says. The relative squared error
// of a pixel is the mean over its three colours of
//
//     ((a - b) / 2)^2 / (n^2 + 0.01)
//
// where n stands for the pixel's true value. With n = m a bright outlier would hide itself in its
// own denominator, so n is the median of m over 3 x 3 pixels; or, where a small bright thing makes
// that too dark, the mean of min(a, b) and the harmonic mean of a and b, at most 1.5 times the
// darker half. The error of the whole is the root of the mean over the pixels. For the percentile
// the squared errors are averaged over 9 x 9 pixels first: the estimate of a single pixel has but
// three degrees of freedom, and none where no sample met what is rare.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "integrate/pathRecord.h"
#include "scene/camera.h"

namespace mbfeat {

/// Relative errors: 0.02 is 2 %.
struct ErrorEstimate {
    double whole = 0.0; ///< root mean square over the pixels
    double percentile95 = 0.0;
};

/// The added radiance of both halves of each pixel's samples. Threads: add() for different pixels
/// at once.
class HalfSums {
public:
    explicit HalfSums(const PixelRect& data);

    /// Adds samples of pixel (x, y), the first to that half (0 or 1), then by turns.
    void add(int x, int y, int half, ConstPathRecords records, int count);
    const PixelRect& data() const { return data_; }
    /// Means of both halves of the pixel at (column, row) of the data window; false while one has
    /// none.
    bool means(int column, int row, Rgb& a, Rgb& b) const;

private:
    struct Sums {
        double weight = 0.0, value[3] = {};
    };
    struct Pixel {
        Sums half[2];
    };
    const Pixel& pixel(int column, int row) const {
        return pixels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(data_.width) +
                       static_cast<std::size_t>(column)];
    }

    PixelRect data_;
    std::vector<Pixel> pixels_;
};

/// Runs body(row) for every row, in any order and on any threads.
using RowLoop = std::function<void(int rows, const std::function<void(int row)>& body)>;

/// Relative squared errors of the pixels, rows from the top.
class ErrorMap {
public:
    static constexpr int kWindow = 9; ///< pixels on a side, of the smooth errors

    /// Reads the sums, to which nothing may be added meanwhile. Any loop gives the same bits.
    void update(const HalfSums& sums, const RowLoop& loop);

    int width() const { return width_; }
    int height() const { return height_; }
    /// Of each pixel alone.
    const float* row(int y) const { return &raw_[index(y)]; }
    /// Averaged over 9 x 9 pixels.
    const float* smoothRow(int y) const { return &smooth_[index(y)]; }
    ErrorEstimate estimate() const;

private:
    std::size_t index(int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    }

    int width_ = 0, height_ = 0;
    std::vector<Rgb> mean_, differences_, darker_;
    std::vector<float> raw_, columns_, smooth_; ///< columns_: averaged down the columns alone
};

/// The value below which that share of the values lies; reorders them. 0 of none.
float quantile(std::vector<float>& values, double share);

} // namespace mbfeat
