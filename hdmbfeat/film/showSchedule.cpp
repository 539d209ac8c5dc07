#include "film/showSchedule.h"

#include "film/risingPass.h"

namespace mbfeat {

namespace {

/// How long the first grid may take before a part of it is shown.
constexpr std::chrono::milliseconds kPatience(50);
constexpr int kShare = 10; ///< one part in so many of the time is for showing

} // namespace

void ShowSchedule::start(const PixelRect& data, Clock::time_point now) {
    data_ = data;
    grids_ = 0;
    next_ = now + kPatience;
}

bool ShowSchedule::isDue(std::uint64_t samples, Clock::time_point now) const {
    return samples > 0 && (now >= next_ || wholeGrids(data_, samples) > grids_);
}

void ShowSchedule::shown(std::uint64_t samples, Clock::time_point begin, Clock::time_point end) {
    grids_ = wholeGrids(data_, samples);
    next_ = end + (kShare - 1) * (end - begin);
}

} // namespace mbfeat
