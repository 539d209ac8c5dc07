// Float against double: how wrong a value may be whose formula was given rounded numbers.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

namespace mbfeat::stability {

inline constexpr double kRoundoff = 0x1p-24; ///< unit roundoff of float

/// The error of a float value in roundings: |value - f(x)| in units of the error that one rounding
/// of each input and one of the result would make. An algorithm of a few steady operations stays
/// within some tens whatever the condition of f: this is the mixed forward and backward error of
/// Higham 2002, "Accuracy and Stability of Numerical Algorithms", section 1.5. `f` takes the
/// inputs as doubles; `absolute` is an error that is allowed in any case, against underflow.
template <class F>
double roundings(double value, const F& f, const std::vector<double>& inputs,
                 double absolute = 1e-37) {
    const double truth = f(inputs);
    double allowed = kRoundoff * std::abs(truth) + absolute;
    std::vector<double> moved = inputs;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        double most = 0.0;
        for (const double sign : {-1.0, 1.0}) {
            moved[i] = inputs[i] * (1.0 + sign * kRoundoff);
            const double change = std::abs(f(moved) - truth);
            most = change > most ? change : most;
        }
        moved[i] = inputs[i];
        allowed += most;
    }
    return std::abs(value - truth) / allowed;
}

} // namespace mbfeat::stability
