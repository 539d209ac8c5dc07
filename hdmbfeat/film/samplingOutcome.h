// How many samples the pixels of an image got, how exact it is, and why they got no more.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "film/errorEstimate.h"
#include "film/film.h"

namespace mbfeat {

/// Why a render took no more samples.
enum class StopReason : std::uint8_t { kSamples, kTargetError, kTimeLimit, kInterrupted };
/// "samples", "targetError", "timeLimit", "interrupted".
const char* stopReasonName(StopReason reason);

/// What a render to a target error expected of itself at some time.
struct Forecast {
    std::uint64_t samples = 0, allSamples = 0; ///< taken then, and expected in the end
    double seconds = 0.0, allSeconds = 0.0;
};

/// The samples that pixels got.
struct SamplingOutcome {
    std::uint32_t fewest = 0, most = 0;
    double mean = 0.0;
    std::optional<ErrorEstimate> error; ///< where it was asked for and there were samples enough
    StopReason stop = StopReason::kSamples;
    std::vector<Forecast> forecasts; ///< one a look at the error

    /// Adds another view's; `pixels` counts those so far, `otherPixels` the other's. The error
    /// becomes the larger one, the reason the more urgent one.
    void add(const SamplingOutcome& other, double pixels, double otherPixels);
};

/// The counts of a film.
SamplingOutcome countSamples(const Film& film);

/// What to tell a user whose target was not reached with the most samples that a pixel gets.
std::string missedTargetText(const SamplingOutcome& outcome, double target, int mostSamples);

} // namespace mbfeat
