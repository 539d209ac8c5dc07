// How long a job has worked: the time since it started, less its pauses.
#pragma once

#include <atomic>

#include "core/clock.h"

namespace mbfeat {

/// setPaused() by one thread at a time, and not beside start(); the rest by any.
class RenderClock {
public:
    /// A pause that lasts goes on, and counts from now.
    void start() {
        begin_ = Clock::now();
        pauseBegin_ = begin_.load();
        pausedSeconds_ = 0.0;
    }
    void setPaused(bool on) {
        if (on) {
            pauseBegin_ = Clock::now();
        } else {
            pausedSeconds_ = pausedSeconds_ + secondsSince(pauseBegin_.load());
        }
        paused_ = on;
    }
    bool isPaused() const { return paused_.load(std::memory_order_relaxed); }

    double activeSeconds() const {
        const double pause = paused_ ? secondsSince(pauseBegin_.load()) : 0.0;
        return allSeconds() - pausedSeconds_ - pause;
    }
    /// Pauses included.
    double allSeconds() const { return secondsSince(begin_.load()); }

private:
    std::atomic<bool> paused_{false};
    std::atomic<Clock::time_point> begin_{Clock::time_point{}};
    std::atomic<Clock::time_point> pauseBegin_{Clock::time_point{}};
    std::atomic<double> pausedSeconds_{0.0};
};

} // namespace mbfeat
