// The error that two halves of the samples tell, against noise that is known.
#include <cmath>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "film/errorEstimate.h"

using namespace mbfeat;

namespace {

constexpr PixelRect kData{3, -2, 64, 48};

void serialLoop(int rows, const std::function<void(int)>& body) {
    for (int row = 0; row < rows; ++row) {
        body(row);
    }
}

void backwardLoop(int rows, const std::function<void(int)>& body) {
    for (int row = rows; row-- > 0;) {
        body(row);
    }
}

PathRecord grey(float value) {
    PathRecord record;
    record.radiance = Rgb(value);
    return record;
}

/// `samples` samples a pixel of normal noise about `mean`.
HalfSums noise(float mean, float deviation, int samples) {
    HalfSums sums(kData);
    std::mt19937 random(7);
    std::normal_distribution<float> normal(mean, deviation);
    std::vector<PathRecord> records(static_cast<std::size_t>(samples));
    for (int y = kData.y; y < kData.y + kData.height; ++y) {
        for (int x = kData.x; x < kData.x + kData.width; ++x) {
            for (PathRecord& record : records) {
                record = grey(normal(random));
            }
            sums.add(x, y, 0, records.data(), samples);
        }
    }
    return sums;
}

ErrorEstimate estimateOf(const HalfSums& sums) {
    ErrorMap map;
    map.update(sums, serialLoop);
    return map.estimate();
}

} // namespace

TEST_CASE("the error of normal noise is its deviation over the root of the samples") {
    // 3072 pixels: the estimate's own deviation is sqrt(1 / (2 * 3072)) = 1.3 %; 5 % is 3.9 sigma.
    const double expected = 0.4 / std::sqrt(32.0) / std::sqrt(2.0 * 2.0 + 0.01);
    const ErrorEstimate error = estimateOf(noise(2.0F, 0.4F, 32));
    CHECK(error.whole == doctest::Approx(expected).epsilon(0.05));
    CHECK(error.percentile95 > error.whole);
    CHECK(error.percentile95 < 2.0 * error.whole);
}

TEST_CASE("no noise is no error, and black is divided by the regulariser") {
    CHECK(estimateOf(noise(1.0F, 0.0F, 16)).whole == 0.0);
    CHECK(estimateOf(HalfSums(kData)).whole == 0.0); // no samples at all
    const double expected = 0.1 / std::sqrt(16.0) / 0.1;
    CHECK(estimateOf(noise(0.0F, 0.1F, 16)).whole == doctest::Approx(expected).epsilon(0.07));
}

TEST_CASE("an outlier does not hide itself in its own denominator") {
    HalfSums sums = noise(1.0F, 0.0F, 16);
    const PathRecord bright = grey(17000.0F); // 17 samples: this half's mean is 1889.8
    sums.add(kData.x + 20, kData.y + 20, 0, &bright, 1);
    const double difference = ((17000.0 + 8.0) / 9.0 - 1.0) / 2.0;
    const double expected =
        std::sqrt(difference * difference / (1.5 * 1.5 + 0.01) / (kData.width * kData.height));
    CHECK(estimateOf(sums).whole == doctest::Approx(expected).epsilon(1e-3));
}

TEST_CASE("the map is the same bits whatever the order of rows") {
    const HalfSums sums = noise(0.5F, 3.0F, 16);
    ErrorMap forward, backward;
    forward.update(sums, serialLoop);
    backward.update(sums, backwardLoop);
    CHECK(forward.estimate().whole == backward.estimate().whole);
    CHECK(forward.estimate().percentile95 == backward.estimate().percentile95);
}

TEST_CASE("values near the largest float give a finite error") {
    const double error = estimateOf(noise(0.0F, 1e38F, 4)).whole;
    CHECK(std::isfinite(error));
    CHECK(error > 1e6);
}

TEST_CASE("a single pixel and a single row have errors") {
    for (const PixelRect data : {PixelRect{0, 0, 1, 1}, PixelRect{0, 0, 7, 1}}) {
        HalfSums sums(data);
        for (int x = 0; x < data.width; ++x) {
            const PathRecord records[] = {grey(1.0F), grey(3.0F)};
            sums.add(x, 0, 0, records, 2);
        }
        CHECK(estimateOf(sums).whole == doctest::Approx(std::sqrt(1.0 / 4.01)));
        CHECK(estimateOf(sums).percentile95 == doctest::Approx(std::sqrt(1.0 / 4.01)));
    }
}
