#include "catalogue.h"

#include <algorithm>
#include <cstdio>

namespace mbfeat::stability {

namespace {

/// Normal score of the same upper tail as Student's t with n degrees of freedom: Wallace 1959's
/// approximation, within 0.4 % of |t| for n > 5 up to scores of 6.
double normalScore(double t, double n) {
    const double scale = (8.0 * n + 1.0) / (8.0 * n + 3.0);
    return scale * std::sqrt(n * std::log1p(t * t / n));
}

} // namespace

Text& Text::add(const std::string& name, double value) {
    char number[40];
    std::snprintf(number, sizeof number, "%.9g", value);
    text_ += (text_.empty() ? "" : ", ") + name + " " + number;
    return *this;
}

double relativeError(double value, double truth) {
    if (value == truth) {
        return 0.0;
    }
    const double error = std::abs(value - truth);
    return truth == 0.0 ? std::numeric_limits<double>::infinity() : error / std::abs(truth);
}

double ulps(double value, double truth) {
    if (value == truth) {
        return 0.0;
    }
    const float nearest = static_cast<float>(std::abs(truth));
    const float above = std::nextafter(nearest, std::numeric_limits<float>::infinity());
    return std::abs(value - truth) / (static_cast<double>(above) - static_cast<double>(nearest));
}

double standardScore(const std::vector<double>& values, double truth, double rounding) {
    const auto n = static_cast<double>(values.size());
    double mean = 0.0;
    for (const double v : values) {
        mean += v / n;
    }
    double squares = 0.0;
    for (const double v : values) {
        squares += (v - mean) * (v - mean);
    }
    const double error = std::sqrt(squares / (n * (n - 1.0)));
    // What float arithmetic may be wrong by is no bias of the estimator.
    const double allowed = rounding * std::abs(truth);
    const double difference = std::max(std::abs(mean - truth) - allowed, 0.0);
    if (std::isnan(difference) || std::isnan(error)) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    if (difference == 0.0) {
        return 0.0;
    }
    return error > 0.0 ? normalScore(difference / error, n - 1.0)
                       : std::numeric_limits<double>::infinity();
}

} // namespace mbfeat::stability
