#include "film/refinement.h"

#include <algorithm>
#include <cmath>

#include "film/tiles.h"

namespace mbfeat {

namespace {

constexpr int kFirstLook = 8; ///< samples a pixel

/// The next look where the target is expected at `finish` samples, and else at `regular`.
int soonerLook(int done, int finish, int regular) {
    constexpr int kStep = Refinement::kLeastSamples;
    const int least = done + std::max((done / 16 + kStep - 1) / kStep, 1) * kStep;
    return std::min(std::max(finish, least), regular);
}

} // namespace

Refinement::Refinement(const PixelRect& data, const RefinementTarget& target)
    : data_(data),
      target_(target),
      sums_(data),
      active_(makeTiles(data, ErrorBlock::kSide)),
      forecast_(data, target),
      nextCheck_(target.error > 0.0 ? std::min(kFirstLook, target.mostSamples)
                                    : target.mostSamples) {
    blocks_.reserve(active_.size());
    for (const PixelRect& rect : active_) {
        ErrorBlock block;
        block.rect = rect;
        blocks_.push_back(block);
    }
}

ErrorEstimate Refinement::estimate(const RowLoop& loop) {
    map_.update(sums_, loop);
    return map_.estimate();
}

void Refinement::check(int done, const RowLoop& loop) {
    nextCheck_ = lookAfter(done, target_.mostSamples);
    if (target_.error <= 0.0) {
        return;
    }
    const ErrorEstimate whole = estimate(loop);
    const double squaredTarget = target_.error * target_.error;
    const bool decides = done >= kLeastSamples;
    double pixels = 0.0, before = 0.0, now = 0.0, fourth = 0.0;
    active_.clear();
    for (ErrorBlock& block : blocks_) {
        if (!block.active) {
            continue;
        }
        before += block.pixels() * block.squared;
        lookAt(block, done);
        pixels += block.pixels();
        now += block.pixels() * block.squared;
        fourth += block.pixels() * block.fourth;
        block.active = !decides || !target_.adaptive || block.isOver(squaredTarget);
        if (block.active) {
            active_.push_back(block.rect);
        }
    }
    reached_ = decides && (active_.empty() ||
                           (whole.whole <= target_.error && whole.percentile95 <= target_.error));
    if (reached_) {
        return;
    }
    exponent_.add(done, before, now, now > 0.0 ? std::sqrt(fourth) / now : 0.0);
    forecast_.update(done, map_, blocks_, exponent_);
    if (decides) {
        nextCheck_ = soonerLook(done, forecast_.finish(), nextCheck_);
    }
}

void Refinement::lookAt(ErrorBlock& block, int done) {
    std::vector<float> smooth;
    double sum = 0.0, squares = 0.0;
    for (int y = block.rect.y - data_.y; y < block.rect.y - data_.y + block.rect.height; ++y) {
        const int x = block.rect.x - data_.x;
        const float* const raw = map_.row(y) + x;
        for (int i = 0; i < block.rect.width; ++i) {
            const auto error = static_cast<double>(raw[i]);
            sum += error;
            squares += error * error;
        }
        const float* const averaged = map_.smoothRow(y) + x;
        smooth.insert(smooth.end(), averaged, averaged + block.rect.width);
    }
    std::sort(smooth.begin(), smooth.end());
    const std::size_t pixels = smooth.size();
    block.samples = done;
    block.squared = sum / static_cast<double>(pixels);
    block.fourth = squares / static_cast<double>(pixels);
    block.percentile95 = smooth[static_cast<std::size_t>(0.95 * static_cast<double>(pixels - 1))];
}

} // namespace mbfeat
