#include "film/samplingRate.h"

#include <algorithm>

namespace mbfeat {

void SamplingRate::start(double seconds) {
    const std::lock_guard lock(mutex_);
    marks_ = {{0, seconds}};
}

void SamplingRate::mark(std::uint64_t samples, double seconds) {
    const std::lock_guard lock(mutex_);
    marks_.push_back({samples, seconds});
}

double SamplingRate::secondsFor(std::uint64_t more, std::uint64_t samples, double seconds) const {
    const std::lock_guard lock(mutex_);
    if (marks_.empty()) {
        return 0.0;
    }
    const double half = 0.5 * (marks_.front().seconds + seconds);
    const auto later =
        std::upper_bound(marks_.begin() + 1, marks_.end(), half,
                         [](double value, const Mark& mark) { return value < mark.seconds; });
    const Mark& from = *(later - 1);
    if (samples <= from.samples) {
        return 0.0;
    }
    return (seconds - from.seconds) * static_cast<double>(more) /
           static_cast<double>(samples - from.samples);
}

} // namespace mbfeat
