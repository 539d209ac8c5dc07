// Chi-squared tests of samplers against their densities.
//
// A test draws N samples with a fixed seed, counts them in bins, integrates the density over the
// same bins and compares. The false-alarm rate of the whole executable is kFalseAlarmRate: each
// test runs at the level that the Sidak correction gives for kMaxTests independent tests. The
// seeds are fixed, so a test that passes keeps passing until the code changes.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/vec.h"

namespace mbfeat::test {

/// Probability that some test of a correct executable fails.
inline constexpr double kFalseAlarmRate = 1e-3;
/// An upper bound on the number of chi-squared tests in the executable.
inline constexpr int kMaxTests = 512;

/// Random numbers for tests (SplitMix64, Steele et al. 2014), not those under test.
class TestRandom {
public:
    explicit TestRandom(std::uint64_t seed) : state_(seed) {}
    std::uint64_t bits();
    /// Uniform in [0, 1).
    float nextFloat() { return static_cast<float>(bits() >> 40U) * 0x1p-24F; }
    double nextDouble() { return static_cast<double>(bits() >> 11U) * 0x1p-53; }
    Float2 nextFloat2();

private:
    std::uint64_t state_;
};

struct ChiSquaredResult {
    double statistic = 0.0;
    int degreesOfFreedom = 0;
    double pValue = 1.0;
    bool passed = false;
    std::string message; ///< for INFO() or MESSAGE()
};

/// Probability that a chi-squared variable of k degrees of freedom is at least x.
double chiSquaredTail(double x, int k);

/// Compares counts with expected counts of the same length. Bins with fewer than five expected
/// are merged, rarest first. At least two bins must remain.
ChiSquaredResult chiSquaredTest(const std::vector<double>& observed,
                                const std::vector<double>& expected);

/// A rectangle cut in xBins x yBins bins.
struct BinnedDomain {
    double xMin = 0.0, xMax = 1.0, yMin = 0.0, yMax = 1.0;
    int xBins = 32, yBins = 32;
};

/// Tests a sampler on a rectangle. `sample` returns a point, or nothing where the sampler rejects;
/// what it rejects, and what falls outside, is compared with one minus the integral of `density`
/// (per unit area of the rectangle). The integral is adaptive: densities may jump.
ChiSquaredResult
chiSquaredPlane(const BinnedDomain& domain,
                const std::function<std::optional<Vec2<double>>(TestRandom&)>& sample,
                const std::function<double(double, double)>& density, int samples = 400000,
                std::uint64_t seed = 1);

/// Tests a sampler of unit directions whose density is per solid angle, on cos(theta) x phi bins
/// about the given axis (put it where the density is smooth or aligned with it).
ChiSquaredResult chiSquaredSphere(const std::function<std::optional<Float3>(TestRandom&)>& sample,
                                  const std::function<double(const Float3&)>& density,
                                  const Float3& axis = {0.0F, 0.0F, 1.0F}, int cosThetaBins = 40,
                                  int phiBins = 40, int samples = 400000, std::uint64_t seed = 1);

/// The same on a cap: directions within acos(cosMin) of the axis. For densities so narrow that
/// bins of the whole sphere would not see them.
ChiSquaredResult chiSquaredCap(const std::function<std::optional<Float3>(TestRandom&)>& sample,
                               const std::function<double(const Float3&)>& density,
                               const Float3& axis, double cosMin, int cosThetaBins = 40,
                               int phiBins = 40, int samples = 400000, std::uint64_t seed = 1);

/// Adaptive integral of f over the rectangle, for "the pdf integrates to 1".
double integrate2D(const std::function<double(double, double)>& f, double xMin, double xMax,
                   double yMin, double yMax, double tolerance = 1e-5, int startCells = 16);

/// Integral over the sphere of f, per solid angle.
double integrateSphere(const std::function<double(const Float3&)>& f,
                       const Float3& axis = {0.0F, 0.0F, 1.0F}, double tolerance = 1e-4,
                       int startCells = 32);

} // namespace mbfeat::test
