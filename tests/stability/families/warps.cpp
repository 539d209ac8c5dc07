// Warps of random numbers and frames at the ends of their ranges.
#include "families.h"

#include <algorithm>

#include "core/distribution.h"
#include "core/frame.h"
#include "core/sampler.h"
#include "core/warp.h"
#include "oracle.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;

constexpr float kLast = 1.0F - 0x1p-24F;

/// Pairs of numbers in [0, 1), with the ends and the middle in all combinations.
template <class Use>
void pairs(const Use& use) {
    const float ends[] = {0.0F, 0x1p-24F,        0.25F, 0.5F - 0x1p-24F,
                          0.5F, 0.5F + 0x1p-24F, 0.75F, kLast};
    for (const float x : ends) {
        for (const float y : ends) {
            use(Float2(x, y));
        }
    }
    TestRandom random(51);
    for (int i = 0; i < 20000; ++i) {
        use(random.nextFloat2());
    }
}

std::string place(Float2 u) {
    return Text().add("u", u.x).add("v", u.y);
}

void checkTurns(Report& report) {
    TestRandom random(52);
    for (int i = 0; i < 200000; ++i) {
        const int exponent = static_cast<int>(random.bits() % 40) - 24;
        const float sign = i % 2 == 0 ? 1.0F : -1.0F;
        // Multiples of an eighth of a turn, where the reduction switches, and their neighbours.
        float u = sign * std::ldexp(random.nextFloat(), exponent);
        if (i % 4 == 0) {
            u = std::nextafter(0.125F * static_cast<float>(random.bits() % 4096),
                               i % 8 == 0 ? 1e9F : -1e9F);
        }
        float s = 0.0F, c = 0.0F;
        sinCosTurns(u, s, c);
        // The library's functions of a reduced angle, in double.
        const double turn = static_cast<double>(u) - std::round(static_cast<double>(u));
        const double angle = 2.0 * 3.14159265358979323846 * turn;
        const double unit = std::max(std::abs(std::sin(angle)), std::abs(std::cos(angle)));
        const double ulp = std::ldexp(1.0, std::ilogb(static_cast<float>(unit)) - 23);
        report.error(std::abs(static_cast<double>(s) - std::sin(angle)) / ulp,
                     [&] { return Text().add("turns", u).add("sine", s); });
        report.error(std::abs(static_cast<double>(c) - std::cos(angle)) / ulp,
                     [&] { return Text().add("turns", u).add("cosine", c); });
    }
}

void checkHemisphere(Report& report) {
    pairs([&](Float2 u) {
        const Float3 w = cosineHemisphere(u);
        report.error(std::abs(length(Double3(w)) - 1.0), [&] { return place(u); });
        report.require(w.z >= 0.0F, [&] { return place(u); });
    });
}

void checkSphere(Report& report) {
    pairs([&](Float2 u) {
        report.error(std::abs(length(Double3(uniformSphere(u))) - 1.0), [&] { return place(u); });
    });
}

/// Directions in a narrow cone: none outside it, seen by the distance from the axis.
void checkCone(Report& report, float oneMinusCos) {
    const double most = std::min(static_cast<double>(oneMinusCos), 1.0);
    const double edge = std::sqrt(most * (2.0 - most));
    pairs([&](Float2 u) {
        const Float3 w = uniformCone(u, oneMinusCos);
        const double h = static_cast<double>(u.x) * static_cast<double>(oneMinusCos);
        const double truth = std::sqrt(h * (2.0 - h));
        const double radius = std::hypot(static_cast<double>(w.x), static_cast<double>(w.y));
        report.error(std::abs(radius - truth) / edge, [&] { return place(u); });
    });
}

void checkTriangle(Report& report) {
    pairs([&](Float2 u) {
        const Float2 b = uniformTriangle(u);
        const double outside =
            std::max({-static_cast<double>(b.x), -static_cast<double>(b.y),
                      static_cast<double>(b.x) + static_cast<double>(b.y) - 1.0});
        report.error(std::max(outside, 0.0), [&] { return place(u); });
    });
}

/// Frames about normals that are next to an axis, above all -z, where the sign flips.
void checkFrames(Report& report) {
    TestRandom random(53);
    for (int i = 0; i < 40000; ++i) {
        Float3 n = uniformSphere(random.nextFloat2());
        if (i % 2 == 0) {
            const float tiny = std::ldexp(random.nextFloat() - 0.5F, -static_cast<int>(i % 120));
            const Float3 axes[] = {{tiny, tiny, -1.0F},
                                   {tiny, -tiny, 1.0F},
                                   {1.0F, tiny, -tiny},
                                   {tiny, 1.0F, -0.0F},
                                   {-1.0F, tiny, 0.0F}};
            n = normalize(axes[i / 2 % 5]);
        }
        const Frame<float> f = Frame<float>::fromNormal(n);
        const Double3 s(f.s), t(f.t), nn(f.n);
        for (const double e :
             {length(s) - 1.0, length(t) - 1.0, dot(s, t), dot(s, nn), dot(t, nn)}) {
            report.error(std::abs(e),
                         [&] { return Text().add("x", n.x).add("y", n.y).add("z", n.z); });
        }
    }
}

/// Numbers of the sampler: below 1 at any index, dimension and pixel, and evenly spread.
void checkSampler(Report& report) {
    const std::uint32_t starts[] = {0, 1U << 20U, 1U << 31U, 0xFFFFFFFFU - 4095U};
    for (const std::uint32_t start : starts) {
        for (const std::uint32_t dimension : {0U, 7U, 4000U, 0x7FFFFFFEU}) {
            std::vector<int> bins(256, 0);
            for (std::uint32_t i = 0; i < 4096; ++i) {
                const Sampler sampler(-2147483647, 2147483647, start + i, ~0ULL, -1);
                const float u = sampler.get1D(dimension);
                report.require(u >= 0.0F && u < 1.0F, [&] { return Text().add("number", u); });
                ++bins[static_cast<std::size_t>(std::clamp(u, 0.0F, kLast) * 256.0F)];
            }
            // An aligned block of 2^12 points of a (0,1)-sequence has 2^4 in each of 2^8 parts.
            for (const int count : bins) {
                report.error(std::abs(count - 16),
                             [&] { return Text().add("start", start).add("count", count); });
            }
        }
    }
}

/// Piecewise constant densities over weights of any contrast: probabilities add to 1, samples have
/// the density that is told of them, and nothing without weight is drawn.
void checkDistribution(Report& report, double largest) {
    constexpr int kSize = 512;
    std::vector<float> weights(static_cast<std::size_t>(kSize) * kSize, 0.0F);
    TestRandom random(54);
    for (float& w : weights) {
        w = random.nextFloat() < 0.5F ? 0.0F : random.nextFloat();
    }
    weights[12345] = static_cast<float>(largest);
    const PiecewiseConstant2D table(kSize, kSize, weights);
    double sum = 0.0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            sum += static_cast<double>(table.probability(x, y));
        }
    }
    report.error(std::abs(sum - 1.0), [&] { return Text().add("sum", sum); });
    pairs([&](Float2 u) {
        const PiecewiseConstant2D::Sample s = table.sample(u);
        const float weight =
            weights[static_cast<std::size_t>(s.y) * kSize + static_cast<std::size_t>(s.x)];
        report.require(weight > 0.0F && s.probability > 0.0F &&
                           s.probability == table.probability(s.x, s.y) && s.fraction.x < 1.0F &&
                           s.fraction.y < 1.0F,
                       [&] { return place(u); });
    });
}

void checkAlias(Report& report) {
    // A million weights over thirty orders of magnitude.
    std::vector<double> weights(1000000);
    TestRandom random(55);
    double sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i] = i % 3 == 0 ? 0.0 : std::pow(10.0, 30.0 * random.nextDouble());
        sum += weights[i];
    }
    const AliasTable table(weights);
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const auto p = static_cast<double>(table.probability(static_cast<std::uint32_t>(i)));
        const double truth = weights[i] / sum;
        report.error(std::abs(p - truth) / (truth + 1e-37),
                     [&] { return Text().add("weight", truth); });
    }
    for (int i = 0; i < 200000; ++i) {
        const AliasTable::Pick pick = table.sample(i == 0 ? kLast : random.nextFloat());
        report.require(weights[pick.index] > 0.0 && pick.u >= 0.0F && pick.u < 1.0F,
                       [&] { return Text().add("index", pick.index).add("rest", pick.u); });
    }
}

} // namespace

void addWarps(Catalogue& catalogue) {
    catalogue.push_back({"warp/turns", "sine and cosine of up to 1e5 turns, in ulps of the larger",
                         1.7, "what core/lane.h promises", checkTurns});
    catalogue.push_back({"warp/cosine-hemisphere",
                         "length of directions against 1; none below the horizon", 4e-7,
                         "radius and height are within three roundings", checkHemisphere});
    catalogue.push_back({"warp/sphere", "length of directions against 1", 4e-7,
                         "radius and height are within three roundings", checkSphere});
    for (const auto& [name, height] :
         {std::pair("1e-12", 1e-12F), std::pair("1e-30", 1e-30F), std::pair("whole", 2.0F)}) {
        catalogue.push_back({std::string("warp/cone-") + name,
                             "distance from the axis against double, relative to the cone's edge",
                             6e-7, "five roundings",
                             [height = height](Report& report) { checkCone(report, height); }});
    }
    catalogue.push_back({"warp/triangle", "barycentric weights outside the triangle", 0.0,
                         "halving is exact, and so is the difference", checkTriangle});
    catalogue.push_back({"warp/frames", "length and angles of frames about any normal", 8e-7,
                         "about six roundings of a component", checkFrames});
    catalogue.push_back({"warp/sampler", "points of a block of 4096 too many or too few in 1/256",
                         0.0, "every aligned block of a scrambled (0,1)-sequence is a net",
                         checkSampler});
    for (const auto& [name, largest] :
         {std::pair("even", 1.0), std::pair("1e6", 1e6), std::pair("1e30", 1e30)}) {
        catalogue.push_back(
            {std::string("warp/distribution-contrast-") + name,
             "sum of the probabilities of a quarter of a million cells against 1; "
             "no empty cell is drawn",
             4e-7,
             "the differences of a row telescope: some roundings of its distribution function "
             "and of that of the rows",
             [largest = largest](Report& report) { checkDistribution(report, largest); }});
    }
    catalogue.push_back({"warp/alias-table",
                         "probabilities of a million weights over 30 orders of magnitude, relative",
                         2e-7, "computed in double, stored in float", checkAlias});
}

} // namespace mbfeat::stability
