// When an image is good enough: looks at its estimated error after certain numbers of samples,
// says which parts of it need more, and how many that will be.
//
// All is decided between passes, on blocks that are fixed to the image, from sums that do not
// depend on the order of work: so neither do the decisions, whatever threads, tiles and kernel.
#pragma once

#include <cstdint>
#include <vector>

#include "film/errorEstimate.h"

namespace mbfeat {

struct RefinementTarget {
    double error = 0.0;   ///< relative, of whole and 95th percentile; 0: only estimate
    bool adaptive = true; ///< blocks under the target get no more samples
    int mostSamples = 0;  ///< of a pixel
};

class Refinement {
public:
    /// Of a pixel, before anything is decided.
    static constexpr int kLeastSamples = 16;
    static constexpr int kBlock = 16; ///< pixels on a side

    Refinement(const PixelRect& data, const RefinementTarget& target);

    /// Where the samples go.
    HalfSums& sums() { return sums_; }

    /// Samples a pixel at which check() is due: 16, 32, 48, 64, 80, 112 and on in steps of about a
    /// quarter, and mostSamples. Seldom, because each look is another chance to be fooled.
    int nextCheck() const { return nextCheck_; }
    /// Looks at the error when every pixel of the active blocks has `done` samples.
    void check(int done, const RowLoop& loop);
    /// True when the whole is under the target, or every block is.
    bool reached() const { return reached_; }
    /// Of the samples that there are; they need not be as many in all pixels.
    ErrorEstimate estimate(const RowLoop& loop);

    bool allActive() const { return active_.size() == blocks_.size(); }
    /// The blocks that get more samples, from left to right, then down.
    const std::vector<PixelRect>& activeBlocks() const { return active_; }
    /// Samples that the image still needs, as of the last check, if variances go on to fall with
    /// the power of the samples that they fell with: stratified points do better than the power -1.
    std::uint64_t samplesLeft() const { return samplesLeft_; }

private:
    struct Block {
        PixelRect rect;
        bool active = true;
        int samples = 0;           ///< of each pixel
        double squared = 0.0;      ///< mean of the relative squared errors
        double percentile95 = 0.0; ///< squared
        std::vector<float> levels; ///< some of the smooth squared errors, evenly by rank
    };

    void lookAt(Block& block, int done);
    /// Takes what the squared errors of the active blocks were at the last check and are now.
    void fitExponent(int done, double before, double now);
    /// Samples after which the block is expected to be under the target.
    int expectedSamples(const Block& block) const;
    std::uint64_t expectedLeft() const;

    PixelRect data_;
    RefinementTarget target_;
    HalfSums sums_;
    ErrorMap map_;
    std::vector<Block> blocks_;
    std::vector<PixelRect> active_;
    int nextCheck_ = 0;
    bool reached_ = false;
    struct Point {
        double logSamples, logSquared;
    };
    std::vector<Point> curve_; ///< how squared errors fell so far, from check to check
    double exponent_ = 1.0;    ///< of 1 / samples
    std::uint64_t samplesLeft_ = 0;
};

} // namespace mbfeat
