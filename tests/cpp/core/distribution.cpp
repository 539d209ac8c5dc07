#include "core/distribution.h"

#include <algorithm>
#include <limits>

#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

void checkAlias(const std::vector<double>& weights, const std::vector<double>& truth) {
    const AliasTable table(weights);
    REQUIRE(table.size() == weights.size());
    std::vector<double> observed(weights.size(), 0.0), expected(weights.size());
    TestRandom random(2);
    constexpr int kSamples = 400000;
    for (int i = 0; i < kSamples; ++i) {
        const AliasTable::Pick pick = table.sample(random.nextFloat());
        REQUIRE(pick.probability == table.probability(pick.index));
        REQUIRE(truth[pick.index] > 0.0);
        REQUIRE((pick.u >= 0.0F && pick.u < 1.0F));
        observed[pick.index] += 1.0;
    }
    for (std::size_t i = 0; i < truth.size(); ++i) {
        CHECK(isNear(table.probability(static_cast<std::uint32_t>(i)), truth[i], 1e-6, 1e-12));
        expected[i] = truth[i] * kSamples;
    }
    checkPassed(chiSquaredTest(observed, expected));
}

} // namespace

TEST_CASE("alias table picks in proportion to the weights, and never weight zero") {
    checkAlias({1.0, 2.0, 0.0, 5.0, 2.0}, {0.1, 0.2, 0.0, 0.5, 0.2});
    checkAlias({0.0, 0.0, 1e-300, 3e-300}, {0.0, 0.0, 0.25, 0.75});
    checkAlias({1e300, 1e300, 0.0, 2e300}, {0.25, 0.25, 0.0, 0.5});
}

TEST_CASE("alias table ignores weights that are not finite or negative") {
    checkAlias({kNan, 1.0, kInf, -4.0, 3.0}, {0.0, 0.25, 0.0, 0.0, 0.75});
}

TEST_CASE("alias table of nothing but zeros is uniform and says so") {
    const AliasTable table({0.0, kNan, 0.0, 0.0});
    CHECK(table.isDegenerate());
    CHECK(table.probability(1) == 0.25F);
    CHECK(table.sample(kOneMinusEpsilon).index == 3);
    CHECK_FALSE(AliasTable({0.0, 1.0}).isDegenerate());
}

TEST_CASE("the number left over by the alias table is uniform") {
    const AliasTable table({1.0, 2.0, 0.0, 5.0, 2.0});
    checkPassed(chiSquaredPlane(
        {0.0, 5.0, 0.0, 1.0, 5, 50},
        [&](TestRandom& random) -> std::optional<Vec2<double>> {
            const AliasTable::Pick pick = table.sample(static_cast<float>(random.nextDouble()));
            return Vec2<double>(pick.index + 0.5, pick.u);
        },
        [&](double x, double) { return table.probability(static_cast<std::uint32_t>(x)); }));
}

TEST_CASE("one-dimensional distribution follows its pdf, skipping empty intervals") {
    const PiecewiseConstant1D distribution({0.0, 3.0, 0.0, 1.0, 4.0, 0.0});
    checkPassed(chiSquaredPlane(
        {0.0, 1.0, 0.0, 1.0, 60, 1},
        [&](TestRandom& random) -> std::optional<Vec2<double>> {
            const PiecewiseConstant1D::Sample s = distribution.sample(random.nextFloat());
            REQUIRE(s.pdf == distribution.pdf(s.x));
            REQUIRE(s.pdf > 0.0F);
            return Vec2<double>(s.x, 0.5);
        },
        [&](double x, double) { return distribution.pdf(static_cast<float>(x)); }));
    CHECK(isNear(distribution.probability(4), 0.5, 1e-6));
    CHECK(distribution.probability(0) == 0.0F);
    CHECK(distribution.probability(5) == 0.0F);
    CHECK(distribution.sample(0.0F).index == 1);
    CHECK(distribution.sample(kOneMinusEpsilon).index == 4);
    CHECK(distribution.pdf(-0.1F) == 0.0F);
    CHECK(distribution.pdf(1.0F) == 0.0F);
    CHECK(distribution.pdf(std::nanf("")) == 0.0F);
}

TEST_CASE("one-dimensional distribution without usable weights is uniform") {
    const PiecewiseConstant1D distribution({kNan, -1.0, 0.0, kInf});
    CHECK(distribution.isDegenerate());
    for (int i = 0; i < 4; ++i) {
        CHECK(distribution.probability(i) == 0.25F);
    }
}

TEST_CASE("two-dimensional distribution follows the probabilities of its cells") {
    constexpr int kWidth = 7, kHeight = 5;
    std::vector<float> weights(kWidth * kHeight);
    TestRandom random(4);
    for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i] = i % 4 == 0 ? 0.0F : random.nextFloat();
    }
    weights[8] = std::nanf("");
    const PiecewiseConstant2D distribution(kWidth, kHeight, weights);
    CHECK(distribution.width() == kWidth);
    CHECK(distribution.height() == kHeight);
    double sum = 0.0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            sum += distribution.probability(x, y);
        }
    }
    CHECK(isNear(sum, 1.0, 1e-6));
    CHECK(distribution.probability(1, 1) == 0.0F);
    checkPassed(chiSquaredPlane(
        {0.0, kWidth, 0.0, kHeight, 4 * kWidth, 4 * kHeight},
        [&](TestRandom& r) -> std::optional<Vec2<double>> {
            const PiecewiseConstant2D::Sample s = distribution.sample(r.nextFloat2());
            REQUIRE(s.probability == distribution.probability(s.x, s.y));
            return Vec2<double>(s.x + static_cast<double>(s.fraction.x),
                                s.y + static_cast<double>(s.fraction.y));
        },
        [&](double x, double y) {
            return distribution.probability(static_cast<int>(x), static_cast<int>(y));
        }));
}

TEST_CASE("layers of a two-dimensional distribution are distributions of their own") {
    constexpr int kWidth = 5, kHeight = 3, kLayers = 4;
    constexpr int kCells = kWidth * kHeight;
    TestRandom random(14);
    std::vector<float> weights;
    for (int i = 0; i < kCells * kLayers; ++i) {
        // One layer is black, and the others differ by orders of magnitude.
        const int layer = i / kCells;
        weights.push_back(layer == 2 ? 0.0F : random.nextFloat() * (layer == 1 ? 1e20F : 1e-20F));
    }
    const PiecewiseConstant2D all(kWidth, kHeight, weights, kLayers);
    CHECK(all.width() == kWidth);
    CHECK(all.height() == kHeight);
    CHECK(!all.isDegenerate());
    for (int layer = 0; layer < kLayers; ++layer) {
        CAPTURE(layer);
        const auto first = weights.begin() + std::ptrdiff_t{layer} * kCells;
        const PiecewiseConstant2D one(kWidth, kHeight, std::vector<float>(first, first + kCells));
        CHECK(one.isDegenerate() == (layer == 2));
        for (int i = 0; i < 1000; ++i) {
            const Float2 u = random.nextFloat2();
            const PiecewiseConstant2D::Sample a = all.sample<float>(u, layer), b = one.sample(u);
            REQUIRE(a.x == b.x);
            REQUIRE(a.y == b.y);
            REQUIRE(a.fraction.x == b.fraction.x);
            REQUIRE(a.fraction.y == b.fraction.y);
            REQUIRE(a.probability == b.probability);
            REQUIRE(all.probability<float>(a.x, a.y, layer) == one.probability(a.x, a.y));
        }
    }
}

TEST_CASE("two-dimensional distribution of a black image is uniform") {
    const PiecewiseConstant2D distribution(4, 2, std::vector<float>(8, 0.0F));
    CHECK(distribution.isDegenerate());
    CHECK(distribution.probability(3, 1) == 0.125F);
}

TEST_CASE("the guide of a distribution function finds what a search of all of it does") {
    TestRandom random(6);
    for (const int intervals : {1, 2, 7, 64, 300, 2048}) {
        CAPTURE(intervals);
        constexpr int kRows = 3;
        const std::size_t stride = static_cast<std::size_t>(intervals) + 1;
        std::vector<float> cdf;
        for (int row = 0; row < kRows; ++row) {
            // Rows of equal steps, of few large ones among empty ones, and of one.
            std::vector<double> weights;
            double sum = 0.0;
            for (int i = 0; i < intervals; ++i) {
                const double x = random.nextDouble();
                weights.push_back(row == 0 ? 1.0 : row == 1 ? (x < 0.9 ? 0.0 : x) : 0.0);
            }
            weights[static_cast<std::size_t>(intervals / 2)] += row == 2 ? 1.0 : 0.01;
            for (const double w : weights) {
                sum += w;
            }
            double at = 0.0;
            cdf.push_back(0.0F);
            for (const double w : weights) {
                at += w;
                cdf.push_back(static_cast<float>(at / sum));
            }
            cdf.back() = 1.0F;
        }
        const IntervalGuide guide(cdf, intervals);
        using Batch = xsimd::batch<float>;
        constexpr int kLanes = LaneTraits<Batch>::kWidth;
        for (int i = 0; i < 2000; ++i) {
            LaneBuffer<Batch> u;
            alignas(64) std::int32_t row[kLanes], found[kLanes];
            for (int k = 0; k < kLanes; ++k) {
                row[k] = (i + k) % kRows;
                // Values of the function itself, too: they begin an interval.
                const float value = cdf[static_cast<std::size_t>(random.nextDouble() * cdf.size())];
                u[k] = k % 3 == 0 ? std::min(value, kOneMinusEpsilon) : random.nextFloat();
            }
            storeIntLanes<Batch>(found,
                                 guide.find<Batch>(cdf, loadIntLanes<Batch>(row), u.lanes()));
            for (int k = 0; k < kLanes; ++k) {
                const float* const own = cdf.data() + stride * static_cast<std::size_t>(row[k]);
                const float* const above = std::upper_bound(own + 1, own + intervals, u[k]);
                REQUIRE(found[k] == above - own - 1);
                REQUIRE(guide.find<float>(cdf, row[k], u[k]) == found[k]);
            }
        }
    }
}
