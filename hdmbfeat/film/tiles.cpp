#include "film/tiles.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace mbfeat {

namespace {

constexpr double kGroupsPerThread = 8.0;

/// Pixels that one thread is to take at a time.
double wantedPixels(double pixels, int samples, int capacity, int threads) {
    return std::min(static_cast<double>(capacity) / samples, pixels / (kGroupsPerThread * threads));
}

/// In steps of the golden section: any part of the way is spread evenly over the image, and so
/// tells how long the rest will take.
std::vector<TileGroup> scattered(std::vector<TileGroup> groups) {
    const std::size_t count = groups.size();
    auto step = static_cast<std::size_t>(0.618 * static_cast<double>(count));
    while (std::gcd(step, count) > 1) {
        ++step;
    }
    std::vector<TileGroup> order;
    order.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        order.push_back(std::move(groups[i * step % count]));
    }
    return order;
}

} // namespace

std::vector<PixelRect> makeTiles(const PixelRect& rect, int side) {
    std::vector<PixelRect> tiles;
    for (int y = rect.y; y < rect.y + rect.height; y += side) {
        for (int x = rect.x; x < rect.x + rect.width; x += side) {
            tiles.push_back({x, y, std::min(side, rect.x + rect.width - x),
                             std::min(side, rect.y + rect.height - y)});
        }
    }
    return tiles;
}

int fittedTile(const PixelRect& rect, int samples, int capacity, int threads) {
    const double wanted = wantedPixels(pixelCount(rect), samples, capacity, threads);
    return std::clamp(static_cast<int>(std::sqrt(wanted)), 4, 1024);
}

std::vector<TileGroup> singleTiles(const PixelRect& rect, int side) {
    std::vector<TileGroup> groups;
    for (const PixelRect& tile : makeTiles(rect, side)) {
        groups.push_back({tile});
    }
    return scattered(std::move(groups));
}

std::vector<TileGroup> groupTiles(const std::vector<PixelRect>& tiles, int samples, int capacity,
                                  int threads) {
    double pixels = 0.0;
    for (const PixelRect& tile : tiles) {
        pixels += pixelCount(tile);
    }
    const double wanted = wantedPixels(pixels, samples, capacity, threads);
    std::vector<TileGroup> groups;
    double room = 0.0;
    for (const PixelRect& tile : tiles) {
        if (groups.empty() || room < pixelCount(tile)) {
            groups.emplace_back();
            room = wanted;
        }
        groups.back().push_back(tile);
        room -= pixelCount(tile);
    }
    return scattered(std::move(groups));
}

} // namespace mbfeat
