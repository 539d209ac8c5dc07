#include "core/pixelFilter.h"

#include <array>

#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

constexpr std::array<PixelFilter, 5> kFilters{PixelFilter::kBox, PixelFilter::kTriangle,
                                              PixelFilter::kGaussian, PixelFilter::kBlackmanHarris,
                                              PixelFilter::kMitchell};
constexpr std::array<float, 4> kWidths{0.5F, 1.0F, 3.0F, 4.0F};

template <class F>
void forEachFilter(F&& test) {
    for (const PixelFilter filter : kFilters) {
        for (const float width : kWidths) {
            INFO("filter " << static_cast<int>(filter) << ", width " << width);
            test(FilterSampler(filter, width), width);
        }
    }
}

} // namespace

TEST_CASE("filter samples follow the filter's pdf") {
    forEachFilter([](const FilterSampler& filter, float width) {
        const double r = 0.5 * width;
        checkPassed(chiSquaredPlane(
            {-r, r, -r, r, 40, 40},
            [&](TestRandom& random) -> std::optional<Vec2<double>> {
                const Float2 o = filter.sample(random.nextFloat2()).offset;
                return Vec2<double>(o.x, o.y);
            },
            [&](double x, double y) {
                return filter.pdf({static_cast<float>(x), static_cast<float>(y)});
            }));
    });
}

TEST_CASE("filter pdf and filter integrate to one over the full width and vanish outside") {
    forEachFilter([](const FilterSampler& filter, float width) {
        const double r = 0.5 * width;
        CHECK(filter.radius() == 0.5F * width);
        const auto pdf = [&](double x, double y) {
            return static_cast<double>(filter.pdf({static_cast<float>(x), static_cast<float>(y)}));
        };
        const auto value = [&](double x, double y) {
            return static_cast<double>(
                filter.evaluate({static_cast<float>(x), static_cast<float>(y)}));
        };
        CHECK(isNear(integrate2D(pdf, -r, r, -r, r), 1.0, 1e-4));
        CHECK(isNear(integrate2D(value, -r, r, -r, r), 1.0, 1e-4));
        CHECK(filter.pdf({0.501F * width, 0.0F}) == 0.0F);
        CHECK(filter.evaluate({0.0F, -0.501F * width}) == 0.0F);
    });
}

TEST_CASE("filter weights make the estimate that of the signed filter") {
    forEachFilter([](const FilterSampler& filter, float width) {
        const double r = 0.5 * width;
        const auto image = [&](double x, double y) { return 1.0 + x / r + 2.0 * x * x * y / r; };
        TestRandom random(7);
        Statistics statistics;
        for (int i = 0; i < 300000; ++i) {
            const FilterSample s = filter.sample(random.nextFloat2());
            statistics.add(s.weight * image(s.offset.x, s.offset.y));
        }
        const double truth = integrate2D(
            [&](double x, double y) {
                return image(x, y) *
                       filter.evaluate({static_cast<float>(x), static_cast<float>(y)});
            },
            -r, r, -r, r);
        checkMean(statistics, truth);
    });
}

TEST_CASE("filters that are nowhere negative have weight one") {
    forEachFilter([](const FilterSampler& filter, float) {
        if (filter.evaluate({0.375F * 2.0F * filter.radius(), 0.0F}) < 0.0F) {
            return;
        }
        TestRandom random(9);
        for (int i = 0; i < 1000; ++i) {
            CHECK(filter.sample(random.nextFloat2()).weight == 1.0F);
        }
    });
}

TEST_CASE("Mitchell has the lobes of the original") {
    // Values of Mitchell and Netravali's filter with B = C = 1/3, whose support is four pixels.
    const FilterSampler filter(PixelFilter::kMitchell, 4.0F);
    CHECK(isNear(filter.evaluate({0.0F, 0.0F}), 64.0 / 81.0, 2e-4));
    CHECK(isNear(filter.evaluate({1.0F, 0.0F}), (1.0 / 18.0) * (8.0 / 9.0), 2e-3));
    CHECK(isNear(filter.evaluate({1.5F, 0.0F}), (-5.0 / 144.0) * (8.0 / 9.0), 2e-3));
}

TEST_CASE("extreme numbers and widths give samples inside the support") {
    for (const PixelFilter kind : kFilters) {
        CHECK(FilterSampler(kind, 1e-6F).radius() == 0.005F);
        for (const float width : {0.0F, 1e-6F, -1.0F, 1e30F, std::nanf("")}) {
            const FilterSampler filter(kind, width);
            for (const float u : {0.0F, 0.5F, kOneMinusEpsilon}) {
                const FilterSample s = filter.sample({u, 1.0F - u});
                CHECK(std::abs(s.offset.x) <= filter.radius());
                CHECK(std::abs(s.offset.y) <= filter.radius());
                CHECK(std::isfinite(s.weight));
            }
        }
    }
}
