#include "film/refinement.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "film/tiles.h"

namespace mbfeat {

namespace {

constexpr int kPixelsPerLevel = 32;

int checkAfter(int samples, int most) {
    constexpr int kStep = Refinement::kLeastSamples;
    const int quarter = samples / 4;
    const int steps = (samples + std::max(quarter, 1) + kStep - 1) / kStep;
    return std::min(steps * kStep, most);
}

} // namespace

Refinement::Refinement(const PixelRect& data, const RefinementTarget& target)
    : data_(data),
      target_(target),
      sums_(data),
      active_(makeTiles(data, kBlock)),
      nextCheck_(target.error > 0.0 ? checkAfter(0, target.mostSamples) : target.mostSamples) {
    blocks_.reserve(active_.size());
    for (const PixelRect& rect : active_) {
        Block block;
        block.rect = rect;
        blocks_.push_back(std::move(block));
    }
}

ErrorEstimate Refinement::estimate(const RowLoop& loop) {
    map_.update(sums_, loop);
    return map_.estimate();
}

void Refinement::check(int done, const RowLoop& loop) {
    nextCheck_ = checkAfter(done, target_.mostSamples);
    if (target_.error <= 0.0 || done < kLeastSamples) {
        return;
    }
    const ErrorEstimate whole = estimate(loop);
    active_.clear();
    double before = 0.0;
    double now = 0.0;
    for (Block& block : blocks_) {
        if (block.active) {
            const double pixels = pixelCount(block.rect);
            before += pixels * block.squared;
            lookAt(block, done);
            now += pixels * block.squared;
        }
        if (block.active) {
            active_.push_back(block.rect);
        }
    }
    fitExponent(done, before, now);
    reached_ =
        active_.empty() || (whole.whole <= target_.error && whole.percentile95 <= target_.error);
    samplesLeft_ = reached_ ? 0 : expectedLeft();
}

void Refinement::lookAt(Block& block, int done) {
    std::vector<float> smooth;
    double sum = 0.0;
    for (int y = block.rect.y - data_.y; y < block.rect.y - data_.y + block.rect.height; ++y) {
        const int x = block.rect.x - data_.x;
        const float* const raw = map_.row(y) + x;
        for (int i = 0; i < block.rect.width; ++i) {
            sum += static_cast<double>(raw[i]);
        }
        const float* const averaged = map_.smoothRow(y) + x;
        smooth.insert(smooth.end(), averaged, averaged + block.rect.width);
    }
    std::sort(smooth.begin(), smooth.end());
    const std::size_t pixels = smooth.size();
    block.samples = done;
    block.squared = sum / static_cast<double>(pixels);
    block.percentile95 = smooth[static_cast<std::size_t>(0.95 * static_cast<double>(pixels - 1))];
    const std::size_t levels = (pixels + kPixelsPerLevel - 1) / kPixelsPerLevel;
    block.levels.clear();
    for (std::size_t k = 0; k < levels; ++k) {
        block.levels.push_back(smooth[(2 * k + 1) * pixels / (2 * levels)]);
    }
    const double target = target_.error * target_.error;
    block.active = !target_.adaptive || block.squared > target || block.percentile95 > target;
}

void Refinement::fitExponent(int done, double before, double now) {
    if (curve_.empty() || !(before > 0.0) || !(now > 0.0)) {
        curve_ = {{std::log(done), 0.0}};
        return;
    }
    // Blocks drop out: only what is left of them is compared.
    curve_.push_back({std::log(done), curve_.back().logSquared + std::log(now / before)});
    constexpr double kReach = 1.4; // of the logarithm: a factor of four
    double count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (const Point& point : curve_) {
        if (point.logSamples >= curve_.back().logSamples - kReach) {
            count += 1.0;
            x += point.logSamples;
            y += point.logSquared;
            xx += point.logSamples * point.logSamples;
            xy += point.logSamples * point.logSquared;
        }
    }
    const double spread = count * xx - x * x;
    // Beyond -2 there is but noise, above -1 an outlier that was met late.
    exponent_ = spread > 0.0 ? std::clamp((x * y - count * xy) / spread, 1.0, 2.0) : 1.0;
}

int Refinement::expectedSamples(const Block& block) const {
    if (!block.active) {
        return block.samples;
    }
    if (!target_.adaptive) {
        return target_.mostSamples;
    }
    const double target = target_.error * target_.error;
    const double factor = std::max(block.squared, block.percentile95) / target;
    const double needed =
        std::min(std::pow(factor, 1.0 / exponent_) * block.samples, 1.0 * target_.mostSamples);
    int samples = nextCheck_;
    while (samples < needed) {
        samples = checkAfter(samples, target_.mostSamples);
    }
    return samples;
}

/// Goes through the checks to come until one of them would find the target reached.
std::uint64_t Refinement::expectedLeft() const {
    std::vector<int> expected;
    expected.reserve(blocks_.size());
    for (const Block& block : blocks_) {
        expected.push_back(expectedSamples(block));
    }
    const double target = target_.error * target_.error;
    std::vector<float> levels;
    for (int samples = nextCheck_;; samples = checkAfter(samples, target_.mostSamples)) {
        double left = 0.0;
        double squared = 0.0;
        bool anyActive = false;
        levels.clear();
        for (std::size_t i = 0; i < blocks_.size(); ++i) {
            const Block& block = blocks_[i];
            const double pixels = pixelCount(block.rect);
            const int then = std::min(samples, expected[i]);
            const double scale = std::pow(static_cast<double>(block.samples) / then, exponent_);
            left += pixels * (then - block.samples);
            squared += pixels * block.squared * scale;
            anyActive = anyActive || expected[i] > samples;
            for (const float level : block.levels) {
                levels.push_back(level * static_cast<float>(scale));
            }
        }
        const bool isUnder = squared <= target * pixelCount(data_) &&
                             static_cast<double>(quantile(levels, 0.95)) <= target;
        if (isUnder || !anyActive || samples >= target_.mostSamples) {
            return static_cast<std::uint64_t>(left);
        }
    }
}

} // namespace mbfeat
