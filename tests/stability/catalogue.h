// The catalogue of hard cases: what a case is, and what it reports.
//
// A case measures one kind of error at one hard place and compares the worst with a budget. Errors
// are in the unit that `check` names; `reason` says where the budget comes from. A case fails where
// the worst error is above the budget or not a number, where it measured nothing, where it threw,
// and where a floating-point trap fired.
//
// A family is a file in families/ that adds its cases in a function named in families.h.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace mbfeat::stability {

/// An image to look at when the case fails: linear RGB, row 0 at the top.
struct Picture {
    std::string name;
    int width = 0, height = 0;
    std::vector<float> rgb;
};

/// What a case found. Errors are collected by one thread.
class Report {
public:
    /// An error of this size was seen. `where` makes the text that says at what; it is called for
    /// the worst only.
    template <class Where>
    void error(double size, const Where& where) {
        ++count_;
        if (std::isnan(worst_) || size <= worst_) {
            return;
        }
        worst_ = size;
        where_ = where();
    }
    void error(double size) {
        error(size, [] { return std::string(); });
    }
    /// Counts as an error of any size where the claim does not hold.
    template <class Where>
    void require(bool holds, const Where& where) {
        error(holds ? 0.0 : std::numeric_limits<double>::infinity(), where);
    }
    void picture(Picture picture) { pictures_.push_back(std::move(picture)); }

    /// Number of errors looked at, zero ones too.
    long long count() const { return count_; }
    double worst() const { return worst_; }
    const std::string& where() const { return where_; }
    const std::vector<Picture>& pictures() const { return pictures_; }

private:
    long long count_ = 0;
    double worst_ = -1.0;
    std::string where_;
    std::vector<Picture> pictures_;
};

struct Case {
    std::string name;   ///< "family/case"
    std::string check;  ///< what is compared with what, and the unit of the error
    double budget = 0;  ///< the largest error allowed
    std::string reason; ///< where the budget comes from
    std::function<void(Report&)> run;
};

using Catalogue = std::vector<Case>;

/// Text of numbers for `where`: "a 1, b 2".
class Text {
public:
    Text& add(const std::string& name, double value);
    operator std::string() const { return text_; } // NOLINT(google-explicit-constructor)

private:
    std::string text_;
};

/// |value - truth| / |truth|; of a truth of zero, 0 or infinity.
double relativeError(double value, double truth);
/// |value - truth| in units in the last place of the truth as a float.
double ulps(double value, double truth);

/// Two-sided: the largest |z| that chance exceeds once in a million tests of estimates without
/// bias. Of the hundred such tests here, with their fixed seeds, one fails by chance in one of ten
/// thousand versions of the code.
inline constexpr double kLargestZ = 4.89;
inline const char* const kReasonZ = "false alarm 1e-6 a case, two-sided, fixed seeds";

/// Standard score of the mean of independent, equally distributed values against the truth; of
/// Student's t for few values, taken to the normal score of the same probability. Values without
/// spread score 0 where they are within `rounding` of the truth, relatively, else infinity.
double standardScore(const std::vector<double>& values, double truth, double rounding = 2e-6);

} // namespace mbfeat::stability
