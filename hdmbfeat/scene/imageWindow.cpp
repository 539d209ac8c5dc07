#include "scene/imageWindow.h"

#include <cmath>

namespace mbfeat {

namespace {

constexpr double kMostPixels = 268435456.0;

} // namespace

std::optional<PixelRect> dataWindowPixels(int width, int height, Float2 min, Float2 max) {
    // Pixel column i is in when left <= i + 0.5 < right.
    const double w = width;
    const double h = height;
    const double x0 = std::ceil(static_cast<double>(min.x) * w - 0.5);
    const double x1 = std::ceil(static_cast<double>(max.x) * w - 0.5);
    // Row j from the top has its centre at h - (j + 0.5) from the bottom.
    const double y0 = std::floor(h - static_cast<double>(max.y) * h - 0.5) + 1.0;
    const double y1 = std::floor(h - static_cast<double>(min.y) * h - 0.5) + 1.0;
    const bool valid = x1 > x0 && y1 > y0 && (x1 - x0) * (y1 - y0) <= kMostPixels &&
                       std::abs(x0) <= kMostPixels && std::abs(y0) <= kMostPixels;
    if (!valid) { // comparisons with NaN are false
        return std::nullopt;
    }
    PixelRect rect;
    rect.x = static_cast<int>(x0);
    rect.y = static_cast<int>(y0);
    rect.width = static_cast<int>(x1 - x0);
    rect.height = static_cast<int>(y1 - y0);
    return rect;
}

} // namespace mbfeat
