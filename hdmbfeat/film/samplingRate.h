// How long samples will take, from how long the last ones took.
#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

namespace mbfeat {

/// Threads: any.
class SamplingRate {
public:
    /// Nothing was sampled before these seconds, which only grow.
    void start(double seconds);
    /// So many samples were there at that time. From now on they may be dearer or cheaper: others
    /// than those of all pixels.
    void mark(std::uint64_t samples, double seconds);
    /// Seconds that `more` samples will take, told from the later half of the time so far and
    /// back to the next mark before it; 0 when unknown.
    double secondsFor(std::uint64_t more, std::uint64_t samples, double seconds) const;

private:
    struct Mark {
        std::uint64_t samples;
        double seconds;
    };
    mutable std::mutex mutex_;
    std::vector<Mark> marks_;
};

} // namespace mbfeat
