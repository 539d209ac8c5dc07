// What is expected of a render while it runs: samples until an error, and seconds.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "film/errorForecast.h"
#include "film/refinement.h"
#include "film/samplingOutcome.h"
#include "film/samplingRate.h"
#include "film/tiles.h"

using namespace mbfeat;

namespace {

void inOrder(int rows, const std::function<void(int)>& body) {
    for (int row = 0; row < rows; ++row) {
        body(row);
    }
}

/// An even grey in which one sample of `1 / rate` finds something bright.
class RareLight {
public:
    RareLight(int side, double rate, std::uint32_t seed)
        : side_(side),
          rate_(rate),
          random_(seed) {}

    /// Adds so many samples to every pixel.
    void add(HalfSums& sums, int samples) {
        constexpr float kBright = 20.0F;
        const double each = 0.5 * samples;
        std::poisson_distribution<int> found(each * rate_);
        for (int y = 0; y < side_; ++y) {
            for (int x = 0; x < side_; ++x) {
                for (const int half : {0, 1}) {
                    PathRecord record; // stands for all of them
                    record.filterWeight = static_cast<float>(each);
                    record.radiance =
                        Rgb(0.5F + kBright * static_cast<float>(found(random_) / each));
                    sums.add(x, y, half, &record, 1);
                }
            }
        }
    }

private:
    int side_;
    double rate_;
    std::mt19937 random_;
};

} // namespace

TEST_CASE("the exponent is that of the looks where they are exact, and the guess where not") {
    ErrorExponent exact, noisy;
    double before = 0.0;
    for (int samples = 8; samples <= 512; samples *= 2) {
        const double now = std::pow(samples, -1.5);
        exact.add(samples, before, now, 0.0);
        noisy.add(samples, before, now, 10.0);
        before = now;
    }
    CHECK(exact.value() == doctest::Approx(1.5).epsilon(0.05));
    CHECK(exact.correction() == doctest::Approx(1.0).epsilon(0.02));
    CHECK(noisy.value() == doctest::Approx(1.1).epsilon(0.01));
}

TEST_CASE("a look that is off the line by a leap of the points is put back on it") {
    ErrorExponent exact, noisy;
    double before = 0.0;
    for (int samples = 16; samples <= 128; samples += 16) {
        const double now = (samples == 128 ? 0.7 : 1.0) / samples;
        exact.add(samples, before, now, 0.0);
        noisy.add(samples, before, now, 1.0);
        before = now;
    }
    CHECK(exact.correction() > 1.15);
    CHECK(exact.correction() < 1.0 / 0.7);
    CHECK(noisy.correction() < 1.02); // chance stays in the sums, and goes on to count
}

TEST_CASE("light that few windows have met yet is expected in the others") {
    // After 48 samples some 31 pixels of 65536 have met it, so that the expected number has a
    // deviation of 18 %, and less than 5 % of the windows: their percentile alone expects the end
    // at once. Seeds are fixed.
    constexpr int kSide = 256;
    constexpr std::uint64_t kPixels = std::uint64_t{kSide} * kSide;
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
        RareLight light(kSide, 1e-5, seed);
        Refinement refinement({0, 0, kSide, kSide}, {0.0075, false, 1 << 16});
        int done = 0, expected = 0;
        while (!refinement.reached() && done < (1 << 14)) {
            light.add(refinement.sums(), refinement.nextCheck() - done);
            done = refinement.nextCheck();
            refinement.check(done, inOrder);
            if (expected == 0 && done == 48) {
                expected = done + static_cast<int>(refinement.samplesLeft() / kPixels);
            }
        }
        MESSAGE("seed " << seed << ": expected " << expected << " at 48, took " << done);
        CHECK(refinement.reached());
        CHECK(done > 600);
        CHECK(expected == doctest::Approx(done).epsilon(0.25));
    }
}

TEST_CASE("the last look comes when the target is expected") {
    RareLight light(64, 0.2, 7);
    Refinement refinement({0, 0, 64, 64}, {0.1, false, 1 << 16});
    int done = 0, before = 0;
    while (!refinement.reached() && done < (1 << 14)) {
        before = done;
        light.add(refinement.sums(), refinement.nextCheck() - done);
        done = refinement.nextCheck();
        refinement.check(done, inOrder);
        CHECK(done - before <= std::max(16, before / 4 + 16));
    }
    CHECK(refinement.reached());
    CHECK(done > 128);
    CHECK(done - before <= before / 8); // by a quarter otherwise
}

TEST_CASE("seconds that are left are told from the later half of the time") {
    SamplingRate rate;
    CHECK(rate.secondsFor(100, 0, 1.0) == 0.0);
    rate.start(2.0);
    CHECK(rate.secondsFor(100, 50, 3.0) == doctest::Approx(2.0));
    rate.mark(1000, 4.0); // 500 a second, and from here on 100
    CHECK(rate.secondsFor(100, 1100, 5.0) == doctest::Approx(100.0 * 3.0 / 1100.0));
    rate.mark(1200, 6.0);
    CHECK(rate.secondsFor(100, 1200, 6.0) == doctest::Approx(1.0));
    CHECK(rate.secondsFor(100, 1300, 7.0) == doctest::Approx(1.0));
    rate.start(0.0);
    CHECK(rate.secondsFor(100, 0, 1.0) == 0.0);
}

TEST_CASE("any part of a pass is spread over the image") {
    const PixelRect rect{3, 5, 96, 64};
    const auto check = [&](const std::vector<TileGroup>& groups) {
        std::set<std::pair<int, int>> seen;
        double middle = 0.0;
        std::size_t tenth = 0;
        for (std::size_t i = 0; i < groups.size(); ++i) {
            for (const PixelRect& tile : groups[i]) {
                seen.emplace(tile.x, tile.y);
                if (i < groups.size() / 10) {
                    middle += tile.y + 0.5 * tile.height - rect.y;
                    ++tenth;
                }
            }
        }
        CHECK(seen.size() == 96);
        CHECK(middle / static_cast<double>(tenth) == doctest::Approx(32.0).epsilon(0.2));
    };
    check(singleTiles(rect, 8));
    check(groupTiles(makeTiles(rect, 8), 16, 1024, 1));
    CHECK(singleTiles({0, 0, 8, 8}, 8).size() == 1);
    CHECK(groupTiles({}, 16, 1024, 1).empty());
}

TEST_CASE("a missed target is told in three digits, with what to do") {
    SamplingOutcome outcome;
    outcome.error = ErrorEstimate{0.010284127012418143, 0.022769041870176716};
    const std::string text = missedTargetText(outcome, 1e-9, 64);
    CHECK(text.find("0.0103,") != std::string::npos);
    CHECK(text.find("0.0228.") != std::string::npos);
    CHECK(text.find("mbfeat:samplesPerPixel, now 64") != std::string::npos);
    outcome.error.reset();
    CHECK(missedTargetText(outcome, 0.1, 8).find("not known") != std::string::npos);
}
