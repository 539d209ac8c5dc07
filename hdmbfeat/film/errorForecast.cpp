#include "film/errorForecast.h"

#include <algorithm>
#include <cmath>

namespace mbfeat {

namespace {

constexpr int kStep = 16; ///< samples: looks come at multiples

int blocksAcross(int pixels) {
    return (pixels + ErrorBlock::kSide - 1) / ErrorBlock::kSide;
}

/// So many pixels that a look ahead at a large image takes no more than that at a small one.
int fittedCell(const PixelRect& data) {
    constexpr double kMostCells = 65536.0;
    int side = 4;
    while (side < ErrorBlock::kSide && pixelCount(data) / (side * side) > kMostCells) {
        side *= 2;
    }
    return side;
}

} // namespace

int lookAfter(int samples, int most) {
    const int quarter = std::max(samples / 4, 1);
    return std::min((samples + quarter + kStep - 1) / kStep * kStep, most);
}

void ErrorExponent::add(int samples, double before, double now, double noise) {
    if (looks_.empty() || !(before > 0.0) || !(now > 0.0)) {
        looks_ = {{std::log(samples), 0.0}};
        value_ = kGuess;
        correction_ = 1.0;
        return;
    }
    // Blocks drop out: only what is left of them is compared.
    looks_.push_back({std::log(samples), looks_.back().logSquared + std::log(now / before)});
    constexpr double kReach = 2.1; // of the logarithm: a factor of eight
    double count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (const Look& look : looks_) {
        if (look.logSamples >= looks_.back().logSamples - kReach) {
            count += 1.0;
            x += look.logSamples;
            y += look.logSquared;
            xx += look.logSamples * look.logSamples;
            xy += look.logSamples * look.logSquared;
        }
    }
    const double spread = xx - x * x / count;
    const double slope = x * y / count - xy;
    // Stratified points get better by leaps, at powers of two: a line fits no better than that.
    constexpr double kLeaps = 0.1;
    constexpr double kGuessDeviation = 0.25;
    const double looksWeight = 1.0 / (noise * noise + kLeaps * kLeaps);
    const double guessWeight = 1.0 / (kGuessDeviation * kGuessDeviation);
    value_ = std::clamp((slope * looksWeight + kGuess * guessWeight) /
                            (spread * looksWeight + guessWeight),
                        1.0, 2.0);
    const double line = y / count - value_ * (looks_.back().logSamples - x / count);
    const double share = kLeaps * kLeaps * looksWeight;
    correction_ = std::exp(share * (line - looks_.back().logSquared));
}

ErrorForecast::ErrorForecast(const PixelRect& data, const RefinementTarget& target)
    : data_(data),
      target_(target),
      squaredTarget_(target.error * target.error),
      cellSide_(fittedCell(data)),
      columns_((data.width + cellSide_ - 1) / cellSide_),
      rows_((data.height + cellSide_ - 1) / cellSide_),
      blockColumns_(blocksAcross(data.width)) {}

void ErrorForecast::fillCells(const ErrorMap& map) {
    cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), Sums());
    smooth_.clear();
    for (int row = 0; row < rows_; ++row) {
        Sums* const cells =
            &cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_)];
        const int end = std::min((row + 1) * cellSide_, data_.height);
        for (int y = row * cellSide_; y < end; ++y) {
            const float* const errors = map.row(y);
            for (int x = 0; x < data_.width; ++x) {
                const auto error = static_cast<double>(errors[x]);
                cells[x / cellSide_].errors += error;
                cells[x / cellSide_].squares += error * error;
            }
        }
        const float* const smooth =
            map.smoothRow(std::min(row * cellSide_ + cellSide_ / 2, data_.height - 1));
        for (int column = 0; column < columns_; ++column) {
            smooth_.push_back(
                smooth[std::min(column * cellSide_ + cellSide_ / 2, data_.width - 1)]);
        }
    }
}

int ErrorForecast::expectedSamples(const ErrorBlock& block, int done) const {
    if (!block.active) {
        return block.samples;
    }
    if (!target_.adaptive) {
        return target_.mostSamples;
    }
    const double factor =
        correction_ * std::max(block.squared, block.percentile95) / squaredTarget_;
    const double needed =
        std::min(std::pow(factor, 1.0 / exponent_) * block.samples, 1.0 * target_.mostSamples);
    int samples = lookAfter(done, target_.mostSamples);
    while (samples < needed) {
        samples = lookAfter(samples, target_.mostSamples);
    }
    return samples;
}

std::size_t ErrorForecast::blockOf(int row, int column) const {
    const int perBlock = ErrorBlock::kSide / cellSide_;
    return static_cast<std::size_t>(row / perBlock) * static_cast<std::size_t>(blockColumns_) +
           static_cast<std::size_t>(column / perBlock);
}

void ErrorForecast::sumUp() {
    const auto stride = static_cast<std::size_t>(columns_) + 1;
    table_.assign(stride * (static_cast<std::size_t>(rows_) + 1), Sums());
    const Sums* cell = cells_.data();
    for (int row = 0; row < rows_; ++row) {
        const Sums* above = &table_[static_cast<std::size_t>(row) * stride + 1];
        Sums* sums = &table_[static_cast<std::size_t>(row + 1) * stride + 1];
        Sums left;
        for (int column = 0; column < columns_; ++column, ++cell, ++above, ++sums) {
            const double scale = scales_[blockOf(row, column)];
            left.errors += scale * cell->errors;
            left.squares += scale * scale * cell->squares;
            *sums = {above->errors + left.errors, above->squares + left.squares};
        }
    }
}

std::pair<double, double> ErrorForecast::window(int row, int column, int cells) const {
    const int radius = cells / 2;
    const int top = std::max(row - radius, 0), bottom = std::min(row + radius + 1, rows_);
    const int left = std::max(column - radius, 0), right = std::min(column + radius + 1, columns_);
    const int height = std::min(bottom * cellSide_, data_.height) - top * cellSide_;
    const int width = std::min(right * cellSide_, data_.width) - left * cellSide_;
    const auto at = [this](int y, int x) -> const Sums& {
        return table_[static_cast<std::size_t>(y) * (static_cast<std::size_t>(columns_) + 1) +
                      static_cast<std::size_t>(x)];
    };
    const auto sum = [&](double Sums::*part) {
        return at(bottom, right).*part - at(top, right).*part - at(bottom, left).*part +
               at(top, left).*part;
    };
    const double errors = std::max(sum(&Sums::errors), 0.0), squares = sum(&Sums::squares);
    return {errors / (static_cast<double>(width) * height),
            squares > 0.0 ? errors * errors / squares : 0.0};
}

double ErrorForecast::percentile(double growth) {
    // Where light is rare few windows have met it, and in those that have it is one pixel's. With m
    // times the samples a window meets as much as m windows do now: its error will be the mean over
    // as many, by m. So where few pixels make up an error it is taken over a wider window, up to m
    // times the area.
    constexpr double kEnough = 10.0;
    constexpr int kWindows[] = {3, 5, 9}; // cells
    const auto areaOf = [this](int cells) {
        const double side = static_cast<double>(cells) * cellSide_ / ErrorMap::kWindow;
        return side * side;
    };
    const bool widens = growth >= areaOf(kWindows[0]);
    if (widens) {
        sumUp();
    }
    levels_.clear();
    std::size_t cell = 0;
    for (int row = 0; row < rows_; ++row) {
        for (int column = 0; column < columns_; ++column, ++cell) {
            double level = static_cast<double>(smooth_[cell]) * scales_[blockOf(row, column)];
            for (const int cells : kWindows) {
                if (!widens || growth < areaOf(cells)) {
                    break;
                }
                const auto [error, pixels] = window(row, column, cells);
                if (cells == kWindows[0] && pixels >= kEnough * areaOf(cells)) {
                    break; // in the estimate's own window there are enough
                }
                level = error;
                if (pixels >= kEnough) {
                    break;
                }
            }
            levels_.push_back(static_cast<float>(level));
        }
    }
    return static_cast<double>(quantile(levels_, 0.95));
}

ErrorForecast::Outlook ErrorForecast::outlook(int samples, int done,
                                              const std::vector<ErrorBlock>& blocks) {
    Outlook then;
    double squared = 0.0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        const ErrorBlock& block = blocks[i];
        const int taken = std::min(samples, expected_[i]);
        scales_[i] = std::pow(static_cast<double>(block.samples) / taken, exponent_) *
                     (block.active ? correction_ : 1.0);
        then.left += block.pixels() * (taken - block.samples);
        then.anyActive = then.anyActive || expected_[i] > samples;
        squared += block.pixels() * block.squared * scales_[i];
    }
    then.isUnder = squared <= squaredTarget_ * pixelCount(data_) &&
                   percentile(static_cast<double>(samples) / done) <= squaredTarget_;
    return then;
}

void ErrorForecast::update(int done, const ErrorMap& map, const std::vector<ErrorBlock>& blocks,
                           const ErrorExponent& exponent) {
    exponent_ = exponent.value();
    correction_ = exponent.correction();
    fillCells(map);
    expected_.clear();
    for (const ErrorBlock& block : blocks) {
        expected_.push_back(expectedSamples(block, done));
    }
    scales_.resize(blocks.size());
    // The least multiple of kStep at which the target is reached or no block goes on.
    const auto ends = [](const Outlook& then) { return then.isUnder || !then.anyActive; };
    int below = done / kStep, above = (target_.mostSamples + kStep - 1) / kStep;
    while (above - below > 1) {
        const int middle = below + (above - below) / 2;
        (ends(outlook(middle * kStep, done, blocks)) ? above : below) = middle;
    }
    finish_ = std::clamp(above * kStep, done, std::max(done, target_.mostSamples));
    samplesLeft_ = static_cast<std::uint64_t>(outlook(finish_, done, blocks).left);
}

} // namespace mbfeat
