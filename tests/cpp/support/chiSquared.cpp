#include "support/chiSquared.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <sstream>

#include "core/frame.h"

namespace mbfeat::test {

namespace {

constexpr double kTwoPiExact = 6.283185307179586476925;

/// Level of one test so that kMaxTests of them raise kFalseAlarmRate together (Sidak 1967).
double testLevel() {
    return 1.0 - std::pow(1.0 - kFalseAlarmRate, 1.0 / kMaxTests);
}

/// Two-point Gauss-Legendre product rule on a rectangle.
double gaussCell(const std::function<double(double, double)>& f, double x0, double x1, double y0,
                 double y1) {
    constexpr double kNode = 0.577350269189625764509; // 1 / sqrt(3)
    const double cx = 0.5 * (x0 + x1), hx = 0.5 * (x1 - x0) * kNode;
    const double cy = 0.5 * (y0 + y1), hy = 0.5 * (y1 - y0) * kNode;
    const double sum =
        f(cx - hx, cy - hy) + f(cx + hx, cy - hy) + f(cx - hx, cy + hy) + f(cx + hx, cy + hy);
    return 0.25 * sum * (x1 - x0) * (y1 - y0);
}

double refine(const std::function<double(double, double)>& f, double x0, double x1, double y0,
              double y1, double whole, double tolerance, int depth) {
    const double xm = 0.5 * (x0 + x1), ym = 0.5 * (y0 + y1);
    const double parts[4] = {gaussCell(f, x0, xm, y0, ym), gaussCell(f, xm, x1, y0, ym),
                             gaussCell(f, x0, xm, ym, y1), gaussCell(f, xm, x1, ym, y1)};
    const double sum = parts[0] + parts[1] + parts[2] + parts[3];
    if (depth <= 0 || std::abs(sum - whole) <= tolerance) {
        return sum;
    }
    // Halved, not quartered: at jumps the error lies along a line of cells.
    const double next = 0.5 * tolerance;
    return refine(f, x0, xm, y0, ym, parts[0], next, depth - 1) +
           refine(f, xm, x1, y0, ym, parts[1], next, depth - 1) +
           refine(f, x0, xm, ym, y1, parts[2], next, depth - 1) +
           refine(f, xm, x1, ym, y1, parts[3], next, depth - 1);
}

/// Integral over one bin. Starts from a grid, so that small features are not missed.
double integrateBin(const std::function<double(double, double)>& f, double x0, double x1, double y0,
                    double y1, double tolerance, int grid, int depth) {
    double sum = 0.0;
    for (int j = 0; j < grid; ++j) {
        for (int i = 0; i < grid; ++i) {
            const double a = x0 + (x1 - x0) * i / grid, b = x0 + (x1 - x0) * (i + 1) / grid;
            const double c = y0 + (y1 - y0) * j / grid, d = y0 + (y1 - y0) * (j + 1) / grid;
            const double whole = gaussCell(f, a, b, c, d);
            sum += refine(f, a, b, c, d, whole, tolerance / (grid * grid), depth);
        }
    }
    return sum;
}

/// Lower regularised gamma function by its power series, for x < a + 1.
double gammaSeries(double a, double x) {
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < 10000; ++n) {
        term *= x / (a + n);
        sum += term;
        if (term < sum * 1e-16) {
            break;
        }
    }
    return sum * std::exp(-x + a * std::log(x) - std::lgamma(a));
}

/// Upper regularised gamma function by its continued fraction (modified Lentz method).
double gammaFraction(double a, double x) {
    constexpr double kTiny = 1e-300;
    double b = x + 1.0 - a, c = 1.0 / kTiny, d = 1.0 / b, h = d;
    for (int n = 1; n < 10000; ++n) {
        const double an = -n * (n - a);
        b += 2.0;
        d = an * d + b;
        d = std::abs(d) < kTiny ? kTiny : d;
        c = b + an / c;
        c = std::abs(c) < kTiny ? kTiny : c;
        d = 1.0 / d;
        const double delta = d * c;
        h *= delta;
        if (std::abs(delta - 1.0) < 1e-15) {
            break;
        }
    }
    return h * std::exp(-x + a * std::log(x) - std::lgamma(a));
}

Float3 sphereDirection(const Frame<double>& frame, double z, double phi) {
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    return Float3(frame.toWorld({r * std::cos(phi), r * std::sin(phi), z}));
}

} // namespace

std::uint64_t TestRandom::bits() {
    state_ += 0x9E3779B97F4A7C15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
}

Float2 TestRandom::nextFloat2() {
    const float x = nextFloat();
    return {x, nextFloat()};
}

double chiSquaredTail(double x, int k) {
    if (!(x > 0.0)) {
        return 1.0;
    }
    const double a = 0.5 * k, h = 0.5 * x;
    return h < a + 1.0 ? 1.0 - gammaSeries(a, h) : gammaFraction(a, h);
}

ChiSquaredResult chiSquaredTest(const std::vector<double>& observed,
                                const std::vector<double>& expected) {
    ChiSquaredResult result;
    std::vector<std::size_t> order(expected.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
    double pooledObserved = 0.0, pooledExpected = 0.0;
    int bins = 0;
    for (const std::size_t i : order) {
        pooledObserved += observed[i];
        pooledExpected += expected[i];
        if (pooledExpected >= 5.0) {
            const double difference = pooledObserved - pooledExpected;
            result.statistic += difference * difference / pooledExpected;
            pooledObserved = pooledExpected = 0.0;
            ++bins;
        }
    }
    // What is left holds less than five expected only if every bin does.
    std::ostringstream text;
    if (bins < 2 || observed.size() != expected.size() || !std::isfinite(result.statistic)) {
        text << "chi-squared test with " << bins << " usable bins of " << expected.size();
        result.message = text.str();
        return result;
    }
    result.degreesOfFreedom = bins - 1;
    result.pValue = chiSquaredTail(result.statistic, result.degreesOfFreedom);
    result.passed = result.pValue >= testLevel();
    text << "chi-squared " << result.statistic << " with " << result.degreesOfFreedom
         << " degrees of freedom, p = " << result.pValue << ", level " << testLevel();
    result.message = text.str();
    return result;
}

ChiSquaredResult
chiSquaredPlane(const BinnedDomain& domain,
                const std::function<std::optional<Vec2<double>>(TestRandom&)>& sample,
                const std::function<double(double, double)>& density, int samples,
                std::uint64_t seed) {
    const std::size_t bins = static_cast<std::size_t>(domain.xBins) * domain.yBins;
    std::vector<double> observed(bins + 1, 0.0), expected(bins + 1, 0.0);
    const double width = domain.xMax - domain.xMin, height = domain.yMax - domain.yMin;
    TestRandom random(seed);
    for (int i = 0; i < samples; ++i) {
        const std::optional<Vec2<double>> p = sample(random);
        std::size_t bin = bins;
        if (p) {
            const double x = (p->x - domain.xMin) / width, y = (p->y - domain.yMin) / height;
            if (x >= 0.0 && x <= 1.0 && y >= 0.0 && y <= 1.0) {
                const int bx = std::min(static_cast<int>(x * domain.xBins), domain.xBins - 1);
                const int by = std::min(static_cast<int>(y * domain.yBins), domain.yBins - 1);
                bin = static_cast<std::size_t>(by) * domain.xBins + bx;
            }
        }
        observed[bin] += 1.0;
    }
    double mass = 0.0;
    for (std::size_t b = 0; b < bins; ++b) {
        const int bx = static_cast<int>(b % domain.xBins), by = static_cast<int>(b / domain.xBins);
        const double x0 = domain.xMin + width * bx / domain.xBins;
        const double x1 = domain.xMin + width * (bx + 1) / domain.xBins;
        const double y0 = domain.yMin + height * by / domain.yBins;
        const double y1 = domain.yMin + height * (by + 1) / domain.yBins;
        const double p = integrateBin(density, x0, x1, y0, y1, 1e-7, 12, 4);
        expected[b] = p * samples;
        mass += p;
    }
    // Below one sample in ten thousand the rest is the error of the integral.
    expected[bins] = mass > 1.0 - 1e-4 ? 0.0 : (1.0 - mass) * samples;
    return chiSquaredTest(observed, expected);
}

ChiSquaredResult chiSquaredCap(const std::function<std::optional<Float3>(TestRandom&)>& sample,
                               const std::function<double(const Float3&)>& density,
                               const Float3& axis, double cosMin, int cosThetaBins, int phiBins,
                               int samples, std::uint64_t seed) {
    const auto frame = Frame<double>::fromNormal(normalize(Vec3<double>(axis)));
    // cos(theta) x phi has the area of the sphere (Archimedes), so densities carry over. The polar
    // variable is 1 - cos(theta), which is exact near the axis.
    const BinnedDomain domain{0.0, 1.0 - cosMin, 0.0, kTwoPiExact, cosThetaBins, phiBins};
    const auto toPlane = [&](TestRandom& random) -> std::optional<Vec2<double>> {
        const std::optional<Float3> d = sample(random);
        if (!d) {
            return std::nullopt;
        }
        const Vec3<double> w = frame.toLocal(normalize(Vec3<double>(*d)));
        const double r2 = w.x * w.x + w.y * w.y;
        const double h = w.z > 0.0 ? r2 / (1.0 + std::sqrt(std::max(0.0, 1.0 - r2))) : 1.0 - w.z;
        const double phi = std::atan2(w.y, w.x);
        return Vec2<double>(h, phi < 0.0 ? phi + kTwoPiExact : phi);
    };
    const auto onPlane = [&](double h, double phi) {
        const double r = std::sqrt(std::max(0.0, h * (2.0 - h)));
        return density(Float3(frame.toWorld({r * std::cos(phi), r * std::sin(phi), 1.0 - h})));
    };
    return chiSquaredPlane(domain, toPlane, onPlane, samples, seed);
}

ChiSquaredResult chiSquaredSphere(const std::function<std::optional<Float3>(TestRandom&)>& sample,
                                  const std::function<double(const Float3&)>& density,
                                  const Float3& axis, int cosThetaBins, int phiBins, int samples,
                                  std::uint64_t seed) {
    return chiSquaredCap(sample, density, axis, -1.0, cosThetaBins, phiBins, samples, seed);
}

double integrate2D(const std::function<double(double, double)>& f, double xMin, double xMax,
                   double yMin, double yMax, double tolerance, int startCells) {
    return integrateBin(f, xMin, xMax, yMin, yMax, tolerance, startCells, 8);
}

double integrateSphere(const std::function<double(const Float3&)>& f, const Float3& axis,
                       double tolerance, int startCells) {
    const auto frame = Frame<double>::fromNormal(normalize(Vec3<double>(axis)));
    return integrate2D([&](double z, double phi) { return f(sphereDirection(frame, z, phi)); },
                       -1.0, 1.0, 0.0, kTwoPiExact, tolerance, startCells);
}

} // namespace mbfeat::test
