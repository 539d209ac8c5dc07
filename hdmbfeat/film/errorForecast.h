// How many samples an image will take to come under a target error, told from how its errors fell
// so far and from where they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "film/errorEstimate.h"
#include "film/tiles.h"

namespace mbfeat {

struct RefinementTarget {
    double error = 0.0;   ///< relative, of whole and 95th percentile; 0: only estimate
    bool adaptive = true; ///< blocks under the target get no more samples
    int mostSamples = 0;  ///< of a pixel
};

/// A piece of the image that gets samples or none.
struct ErrorBlock {
    static constexpr int kSide = 16; ///< pixels

    PixelRect rect;
    bool active = true;
    int samples = 0;           ///< of each pixel, when it was looked at last
    double squared = 0.0;      ///< mean of the relative squared errors
    double fourth = 0.0;       ///< mean of their squares
    double percentile95 = 0.0; ///< squared

    double pixels() const { return pixelCount(rect); }
    bool isOver(double squaredTarget) const {
        return squared > squaredTarget || percentile95 > squaredTarget;
    }
};

/// The number of samples at the look after the one at `samples`: in steps of about a quarter.
int lookAfter(int samples, int most);

/// The power of the samples that squared errors fall with: 1 for random points, more for
/// stratified ones. A line through the logarithms of the last looks, which are as noisy as the
/// differences between pixels say, and a guess in advance, which counts while there are few looks.
class ErrorExponent {
public:
    /// The squared errors of those pixels that were looked at last, what they were before that
    /// (0 at the first look), and the relative noise of the new ones.
    void add(int samples, double before, double now, double noise);
    double value() const { return value_; }
    /// By what the errors of the last look are to be multiplied to be those of the line, as far as
    /// it is not chance that they are off it.
    double correction() const { return correction_; }

private:
    static constexpr double kGuess =
        1.1; ///< the median of the test scenes (tests/bench/accuracy.py)

    struct Look {
        double logSamples, logSquared;
    };
    std::vector<Look> looks_;
    double value_ = kGuess;
    double correction_ = 1.0;
};

/// Threads: one at a time.
class ErrorForecast {
public:
    ErrorForecast(const PixelRect& data, const RefinementTarget& target);

    /// Looks ahead from the errors of all pixels, and of the blocks from left to right, then down;
    /// the active ones have `done` samples a pixel.
    void update(int done, const ErrorMap& map, const std::vector<ErrorBlock>& blocks,
                const ErrorExponent& exponent);
    /// Samples of a pixel at which the target is expected to be reached, at most mostSamples.
    int finish() const { return finish_; }
    /// Samples of all pixels until then.
    std::uint64_t samplesLeft() const { return samplesLeft_; }

private:
    /// What the image will be when no pixel has more than so many samples.
    struct Outlook {
        bool isUnder = false;   ///< the target
        bool anyActive = false; ///< a block goes on
        double left = 0.0;      ///< samples that it takes
    };

    /// Squared errors of neighbouring pixels, and their squares, which tell how few make them up.
    struct Sums {
        double errors = 0.0, squares = 0.0;
    };

    void fillCells(const ErrorMap& map);
    int expectedSamples(const ErrorBlock& block, int done) const;
    Outlook outlook(int samples, int done, const std::vector<ErrorBlock>& blocks);
    std::size_t blockOf(int row, int column) const;
    /// The 95th percentile of windows, when scales_ say what becomes of the errors of blocks.
    double percentile(double growth);
    /// Fills table_ with the sums of all scaled cells above and to the left.
    void sumUp();
    /// The mean error of a window of so many cells a side, and how few pixels make it up.
    std::pair<double, double> window(int row, int column, int cells) const;

    PixelRect data_;
    RefinementTarget target_;
    double squaredTarget_;
    double exponent_ = 1.0, correction_ = 1.0;
    int cellSide_; ///< pixels; divides that of blocks
    int columns_, rows_, blockColumns_;
    std::vector<Sums> cells_;
    std::vector<float> smooth_;  ///< of the pixel in the middle of each cell
    std::vector<int> expected_;  ///< samples of a pixel in the end, a block each
    std::vector<double> scales_; ///< of squared errors, a block each
    std::vector<Sums> table_;    ///< one more row and column than there are cells
    std::vector<float> levels_;
    int finish_ = 0;
    std::uint64_t samplesLeft_ = 0;
};

} // namespace mbfeat
