#include "core/sampler.h"

#include <set>

#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

/// True if 2^m points from `first` on put exactly one into every elementary interval of volume
/// 2^-m, which is the definition of a (0, m, 2)-net in base 2.
bool isNet(int pixel, std::uint32_t dimension, std::uint32_t first, int m) {
    const std::uint32_t n = 1U << static_cast<unsigned>(m);
    for (int a = 0; a <= m; ++a) {
        std::vector<int> count(n, 0);
        const auto columns = static_cast<float>(1U << static_cast<unsigned>(a));
        const auto rows = static_cast<float>(1U << static_cast<unsigned>(m - a));
        for (std::uint32_t i = 0; i < n; ++i) {
            const Float2 p = Sampler(pixel, 3, first + i, 11, 0).get2D(dimension);
            const auto x = static_cast<std::uint32_t>(p.x * columns);
            const auto y = static_cast<std::uint32_t>(p.y * rows);
            if (++count[x * static_cast<std::uint32_t>(rows) + y] > 1) {
                return false;
            }
        }
    }
    return true;
}

bool same(Float2 a, Float2 b) {
    return a.x == b.x && a.y == b.y;
}

} // namespace

TEST_CASE("aligned blocks of sample indices are (0, m, 2)-nets in every dimension pair") {
    for (int m = 0; m <= 10; ++m) {
        const std::uint32_t block = 1U << static_cast<unsigned>(m);
        for (const std::uint32_t dimension : {0U, 2U, 7U, 46U}) {
            CHECK(isNet(5, dimension, 0, m));
            CHECK(isNet(-17, dimension, 3 * block, m));
        }
    }
}

TEST_CASE("one-dimensional samples are stratified") {
    for (int m = 0; m <= 12; ++m) {
        const std::uint32_t n = 1U << static_cast<unsigned>(m);
        std::vector<int> count(n, 0);
        for (std::uint32_t i = 0; i < n; ++i) {
            const float x = Sampler(1, 2, 5 * n + i, 3, 4).get1D(6);
            ++count[static_cast<std::uint32_t>(x * static_cast<float>(n))];
        }
        CHECK(*std::max_element(count.begin(), count.end()) == 1);
    }
}

TEST_CASE("samples lie in [0, 1)") {
    for (std::uint32_t i = 0; i < 20000; ++i) {
        const Sampler sampler(static_cast<int>(i), -7, i * 2654435761U, 0, -1);
        const Float2 p = sampler.get2D(i % 50);
        const float x = sampler.get1D(i % 50);
        REQUIRE((p.x >= 0.0F && p.x < 1.0F && p.y >= 0.0F && p.y < 1.0F && x >= 0.0F && x < 1.0F));
    }
}

TEST_CASE("a number depends on its key alone, and on every part of it") {
    const auto at = [](int x, int y, std::uint32_t sample, std::uint64_t seed, std::int64_t frame) {
        return Sampler(x, y, sample, seed, frame).get2D(8);
    };
    const Float2 base = at(3, 9, 17, 5, 2);
    Sampler again(3, 9, 17, 5, 2);
    static_cast<void>(again.get1D(0));
    static_cast<void>(again.get2D(1));
    CHECK(same(again.get2D(8), base));
    CHECK_FALSE(same(at(4, 9, 17, 5, 2), base));
    CHECK_FALSE(same(at(9, 3, 17, 5, 2), base));
    CHECK_FALSE(same(at(-3, 9, 17, 5, 2), base));
    CHECK_FALSE(same(at(3, 9, 18, 5, 2), base));
    CHECK_FALSE(same(at(3, 9, 17, 5 + (1ULL << 63U), 2), base));
    CHECK_FALSE(same(at(3, 9, 17, 2, 5), base));
    CHECK_FALSE(same(at(3, 9, 17, 5, -2), base));
    CHECK_FALSE(same(again.get2D(9), base));
    CHECK(again.get1D(8) != base.x);
}

TEST_CASE("pixels, dimensions, seeds and frames are independent of each other") {
    // The same sample index in two neighbours: a shared or shifted sequence would show as lines.
    const BinnedDomain square{0.0, 1.0, 0.0, 1.0, 24, 24};
    const auto one = [](double, double) { return 1.0; };
    int n = 0;
    const auto pairs = [&](auto&& first, auto&& second) {
        n = 0;
        return chiSquaredPlane(
            square,
            [&](TestRandom&) -> std::optional<Vec2<double>> {
                const int i = n++;
                return Vec2<double>(first(i), second(i));
            },
            one, 200000);
    };
    const auto value = [](int x, int y, std::uint32_t dimension, std::uint64_t seed,
                          std::int64_t frame) {
        return static_cast<double>(Sampler(x, y, 5, seed, frame).get1D(dimension));
    };
    checkPassed(pairs([&](int i) { return value(i, 0, 0, 0, 0); },
                      [&](int i) { return value(i + 1, 0, 0, 0, 0); }));
    checkPassed(pairs([&](int i) { return value(i % 500, i / 500, 0, 0, 0); },
                      [&](int i) { return value(i % 500, i / 500 + 1, 0, 0, 0); }));
    checkPassed(pairs([&](int i) { return value(i, 0, 4, 0, 0); },
                      [&](int i) { return value(i, 0, 5, 0, 0); }));
    checkPassed(pairs([&](int i) { return value(0, i, 0, 0, 0); },
                      [&](int i) { return value(0, i, 0, 1, 0); }));
    checkPassed(pairs([&](int i) { return value(0, i, 0, 0, 6); },
                      [&](int i) { return value(0, i, 0, 0, 7); }));
}

TEST_CASE("both coordinates of a pair are uniform together over pixels") {
    int n = 0;
    checkPassed(chiSquaredPlane(
        {0.0, 1.0, 0.0, 1.0, 32, 32},
        [&](TestRandom&) -> std::optional<Vec2<double>> {
            const int i = n++;
            const Float2 p = Sampler(i % 640, i / 640, 3, 0, 0).get2D(2);
            return Vec2<double>(p.x, p.y);
        },
        [](double, double) { return 1.0; }));
}

TEST_CASE("the points integrate a smooth function far better than random ones") {
    constexpr int kPixels = 300;
    constexpr std::uint32_t kPoints = 256;
    const auto rootMeanSquare = [&](auto&& point) {
        double sum = 0.0;
        for (int pixel = 0; pixel < kPixels; ++pixel) {
            double mean = 0.0;
            for (std::uint32_t i = 0; i < kPoints; ++i) {
                const Float2 p = point(pixel, i);
                mean += std::sin(3.0 * p.x) * p.y * p.y / kPoints;
            }
            const double exact = (1.0 - std::cos(3.0)) / 3.0 / 3.0;
            sum += (mean - exact) * (mean - exact);
        }
        return std::sqrt(sum / kPixels);
    };
    TestRandom random(3);
    const double sobol = rootMeanSquare(
        [](int pixel, std::uint32_t i) { return Sampler(pixel, 0, i, 0, 0).get2D(0); });
    const double independent =
        rootMeanSquare([&](int, std::uint32_t) { return random.nextFloat2(); });
    CHECK(sobol < independent / 20.0);
}
