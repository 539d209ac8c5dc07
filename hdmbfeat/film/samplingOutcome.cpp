#include "film/samplingOutcome.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "film/json.h"

namespace mbfeat {

const char* stopReasonName(StopReason reason) {
    constexpr std::array<const char*, 4> kNames = {"samples", "targetError", "timeLimit",
                                                   "interrupted"};
    return kNames[static_cast<std::size_t>(reason)];
}

void SamplingOutcome::add(const SamplingOutcome& other, double pixels, double otherPixels) {
    fewest = pixels > 0.0 ? std::min(fewest, other.fewest) : other.fewest;
    most = std::max(most, other.most);
    mean = (mean * pixels + other.mean * otherPixels) / std::max(pixels + otherPixels, 1.0);
    if (error && other.error) {
        error = ErrorEstimate{std::max(error->whole, other.error->whole),
                              std::max(error->percentile95, other.error->percentile95)};
    } else {
        error = pixels > 0.0 ? std::nullopt : other.error;
    }
    forecasts.insert(forecasts.end(), other.forecasts.begin(), other.forecasts.end());
    const auto urgency = [](StopReason reason) {
        return reason == StopReason::kTargetError ? -1 : static_cast<int>(reason);
    };
    stop = pixels > 0.0 && urgency(stop) >= urgency(other.stop) ? stop : other.stop;
}

SamplingOutcome countSamples(const Film& film) {
    const PixelRect& data = film.window().data;
    SamplingOutcome outcome;
    outcome.fewest = std::numeric_limits<std::uint32_t>::max();
    double sum = 0.0;
    for (int y = data.y; y < data.y + data.height; ++y) {
        for (int x = data.x; x < data.x + data.width; ++x) {
            const std::uint32_t count = film.sampleCount(x, y);
            outcome.fewest = std::min(outcome.fewest, count);
            outcome.most = std::max(outcome.most, count);
            sum += count;
        }
    }
    outcome.mean = sum / (static_cast<double>(data.width) * data.height);
    return outcome;
}

namespace {

/// Three digits: an estimate has no more.
std::string rounded(double number) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", number);
    return toText(std::strtod(text, nullptr));
}

} // namespace

std::string missedTargetText(const SamplingOutcome& outcome, double target, int mostSamples) {
    const std::string found =
        outcome.error ? "the estimated error is " + rounded(outcome.error->whole) +
                            ", that of the 95th percentile " + rounded(outcome.error->percentile95)
                      : "the error of so few samples is not known";
    return "the target " + toText(target) + " was not reached: " + found +
           ". Raise mbfeat:samplesPerPixel, now " + std::to_string(mostSamples) +
           ", which is the most that a pixel gets.";
}

} // namespace mbfeat
