#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "scene/imageWindow.h"

using mbfeat::dataWindowPixels;
using mbfeat::Float2;
using mbfeat::PixelRect;

namespace {

bool contains(const PixelRect& rect, int x, int y) {
    return x >= rect.x && y >= rect.y && x < rect.x + rect.width && y < rect.y + rect.height;
}

void checkRect(const PixelRect& rect, int x, int y, int width, int height) {
    CHECK(rect.x == x);
    CHECK(rect.y == y);
    CHECK(rect.width == width);
    CHECK(rect.height == height);
}

} // namespace

TEST_CASE("the whole window is the whole image") {
    const auto rect = dataWindowPixels(1920, 1080, {0.0F, 0.0F}, {1.0F, 1.0F});
    REQUIRE(rect);
    checkRect(*rect, 0, 0, 1920, 1080);
}

TEST_CASE("rows count down from the top while the window counts up") {
    const auto rect = dataWindowPixels(64, 36, {0.25F, 0.25F}, {0.75F, 1.0F});
    REQUIRE(rect);
    checkRect(*rect, 16, 0, 32, 27);
}

TEST_CASE("overscan lies outside the image, with negative coordinates") {
    const auto rect = dataWindowPixels(100, 50, {-0.1F, -0.2F}, {1.1F, 1.2F});
    REQUIRE(rect);
    checkRect(*rect, -10, -10, 120, 70);
}

TEST_CASE("a pixel belongs to the window exactly when its centre is inside") {
    const Float2 windows[][2] = {{{0.1F, 0.2F}, {0.9F, 0.7F}},
                                 {{-0.05F, 0.33F}, {0.501F, 1.07F}},
                                 {{0.013F, 0.77F}, {0.4999F, 0.9F}}};
    for (const int width : {1, 7, 64, 101, 333}) {
        for (const int height : {3, 36, 97}) {
            for (const auto& [min, max] : windows) {
                const auto rect = dataWindowPixels(width, height, min, max);
                for (int y = -height; y < 2 * height; ++y) {
                    for (int x = -width; x < 2 * width; ++x) {
                        const double u = (x + 0.5) / width;
                        const double v = 1.0 - (y + 0.5) / height;
                        const bool inside = u >= min.x && u < max.x && v >= min.y && v < max.y;
                        REQUIRE((rect && contains(*rect, x, y)) == inside);
                    }
                }
            }
        }
    }
}

TEST_CASE("neighbouring windows share no pixel and miss none") {
    for (int width = 1; width < 200; ++width) {
        const auto left = dataWindowPixels(width, 1, {0.0F, 0.0F}, {0.37F, 1.0F});
        const auto right = dataWindowPixels(width, 1, {0.37F, 0.0F}, {1.0F, 1.0F});
        const int total = (left ? left->width : 0) + (right ? right->width : 0);
        CHECK(total == width);
    }
}

TEST_CASE("windows without a pixel centre or with too many give nothing") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    CHECK(!dataWindowPixels(64, 36, {0.5F, 0.5F}, {0.5F, 0.5F}));
    CHECK(!dataWindowPixels(64, 36, {0.8F, 0.0F}, {0.2F, 1.0F}));
    CHECK(!dataWindowPixels(64, 36, {nan, 0.0F}, {1.0F, 1.0F}));
    CHECK(!dataWindowPixels(64, 36, {0.0F, 0.0F}, {1e30F, 1.0F}));
}
