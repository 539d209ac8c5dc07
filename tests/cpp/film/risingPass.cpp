// The grids of a viewer's first pass, what stands for pixels that have not come yet, and when it is
// shown.
#include <algorithm>
#include <numeric>

#include <doctest/doctest.h>

#include "film/risingPass.h"
#include "film/showSchedule.h"

using namespace mbfeat;

TEST_CASE("the rising grids have every pixel once") {
    for (int y = 0; y < 19; ++y) {
        for (int x = 0; x < 21; ++x) {
            const auto count = std::count_if(kRisingGrids.begin(), kRisingGrids.end(),
                                             [&](const PixelGrid& grid) { return grid.has(x, y); });
            CHECK(count == 1);
        }
    }
    CHECK(PixelGrid().has(7, 3)); // without a coarser one it has all
}

TEST_CASE("a pixel without samples shows the finest grid's pixel that stands for it") {
    constexpr int kWidth = 11, kHeight = 10;
    std::vector<std::uint8_t> sampled(std::size_t{kWidth} * kHeight, 0);
    const auto at = [](int x, int y) { return static_cast<std::size_t>(y * kWidth + x); };
    for (const auto pixel : {at(0, 0), at(8, 0), at(4, 4), at(1, 0)}) {
        sampled[pixel] = 1;
    }
    std::vector<int> values(sampled.size() * 2);
    std::iota(values.begin(), values.end(), 0);
    const std::vector<int> before = values;
    fillFromCoarser(sampled, kWidth, 2, values.data());
    const auto source = [&](int x, int y) {
        CHECK(values[2 * at(x, y) + 1] == values[2 * at(x, y)] + 1);
        return static_cast<std::size_t>(values[2 * at(x, y)] / 2);
    };
    CHECK(source(1, 0) == at(1, 0)); // has samples
    CHECK(source(3, 2) == at(0, 0)); // of the coarsest grid
    CHECK(source(9, 1) == at(8, 0));
    CHECK(source(5, 7) == at(4, 4)); // of a finer one
    CHECK(source(0, 9) == at(0, 9)); // nothing stands for it
}

TEST_CASE("a grid is whole when all pixels up to it have come") {
    const PixelRect data{3, 5, 17, 9}; // 3 x 2, 5 x 3, 9 x 5 and 17 x 9
    CHECK(wholeGrids(data, 5) == 0);
    CHECK(wholeGrids(data, 6) == 1);
    CHECK(wholeGrids(data, 15) == 2);
    CHECK(wholeGrids(data, 45) == 3);
    CHECK(wholeGrids(data, 152) == 3);
    CHECK(wholeGrids(data, 153) == 4);
}

TEST_CASE("a viewer's image is shown grid by grid, and else for a tenth of the time") {
    using std::chrono::milliseconds;
    const Clock::time_point begin = Clock::now();
    ShowSchedule schedule;
    schedule.start({0, 0, 16, 16}, begin); // grids of 4, 16, 64 and 256 pixels
    CHECK_FALSE(schedule.isDue(0, begin + milliseconds(1000)));
    CHECK_FALSE(schedule.isDue(3, begin + milliseconds(10)));
    CHECK(schedule.isDue(3, begin + milliseconds(60)));
    CHECK(schedule.isDue(4, begin + milliseconds(10)));
    schedule.shown(4, begin + milliseconds(10), begin + milliseconds(20));
    CHECK_FALSE(schedule.isDue(15, begin + milliseconds(21)));
    CHECK(schedule.isDue(16, begin + milliseconds(21)));
    CHECK_FALSE(schedule.isDue(15, begin + milliseconds(109)));
    CHECK(schedule.isDue(15, begin + milliseconds(110)));
    schedule.shown(256, begin + milliseconds(30), begin + milliseconds(40));
    CHECK_FALSE(schedule.isDue(512, begin + milliseconds(100)));
    CHECK(schedule.isDue(512, begin + milliseconds(140)));
}
