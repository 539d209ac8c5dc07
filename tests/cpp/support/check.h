// Checks shared by test files.
#pragma once

#include <doctest/doctest.h>

#include "support/chiSquared.h"

namespace mbfeat::test {

inline void checkPassed(const ChiSquaredResult& result) {
    INFO(result.message);
    CHECK(result.passed);
}

/// |a - b| within a relative (to the larger) or absolute tolerance.
inline bool isNear(double a, double b, double relative, double absolute = 0.0) {
    return std::abs(a - b) <= std::max(relative * std::max(std::abs(a), std::abs(b)), absolute);
}

/// Mean and standard error of a stream of values.
class Statistics {
public:
    void add(double x) {
        ++count_;
        const double delta = x - mean_;
        mean_ += delta / static_cast<double>(count_);
        sum_ += delta * (x - mean_);
    }
    double mean() const { return mean_; }
    double standardError() const {
        return count_ < 2 ? 0.0 : std::sqrt(sum_ / static_cast<double>(count_ - 1) / count_);
    }

private:
    std::int64_t count_ = 0;
    double mean_ = 0.0, sum_ = 0.0;
};

/// The mean lies within 4.5 standard errors (false alarms: 7e-6) of the truth, and the standard
/// error is below `precision` of it, so that the check means something.
inline void checkMean(const Statistics& statistics, double truth, double precision = 0.01) {
    INFO("mean " << statistics.mean() << " +- " << statistics.standardError() << ", expected "
                 << truth);
    CHECK(std::abs(statistics.mean() - truth) <=
          4.5 * statistics.standardError() + 2e-5 * std::abs(truth));
    CHECK(statistics.standardError() <= precision * std::abs(truth));
}

} // namespace mbfeat::test
