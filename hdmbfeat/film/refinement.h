// When an image is good enough: looks at its estimated error after certain numbers of samples,
// says which parts of it need more, and how many that will be.
//
// All is decided between passes, on blocks that are fixed to the image, from sums that do not
// depend on the order of work: so neither do the decisions, whatever threads, tiles and kernel.
#pragma once

#include <cstdint>
#include <vector>

#include "film/errorEstimate.h"
#include "film/errorForecast.h"

namespace mbfeat {

class Refinement {
public:
    /// Of a pixel, before anything is decided.
    static constexpr int kLeastSamples = 16;

    Refinement(const PixelRect& data, const RefinementTarget& target);

    /// Where the samples go.
    HalfSums& sums() { return sums_; }

    /// Samples a pixel at which check() is due. Seldom, because each look is another chance to be
    /// fooled: 8, only to look ahead; then 16, 32, 48, 64, 80, 112 and on in steps of about a
    /// quarter, and mostSamples. Sooner, but a sixteenth later at least, where the target is
    /// expected to be reached.
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
    /// Samples that the image still needs, as of the last check.
    std::uint64_t samplesLeft() const { return reached_ ? 0 : forecast_.samplesLeft(); }

private:
    /// Brings the errors of the block up to date.
    void lookAt(ErrorBlock& block, int done);

    PixelRect data_;
    RefinementTarget target_;
    HalfSums sums_;
    ErrorMap map_;
    std::vector<ErrorBlock> blocks_;
    std::vector<PixelRect> active_;
    ErrorExponent exponent_;
    ErrorForecast forecast_;
    int nextCheck_ = 0;
    bool reached_ = false;
};

} // namespace mbfeat
