#include "film/risingPass.h"

#include <algorithm>

namespace mbfeat {

int wholeGrids(const PixelRect& data, std::uint64_t samples) {
    const auto isWhole = [&](const PixelGrid& grid) {
        const auto columns = static_cast<std::uint64_t>((data.width - 1) / grid.stride) + 1;
        const auto rows = static_cast<std::uint64_t>((data.height - 1) / grid.stride) + 1;
        return samples >= columns * rows;
    };
    return static_cast<int>(std::count_if(kRisingGrids.begin(), kRisingGrids.end(), isWhole));
}

std::vector<std::uint8_t> sampledPixels(const Film& film) {
    const PixelRect& data = film.window().data;
    std::vector<std::uint8_t> sampled;
    sampled.reserve(static_cast<std::size_t>(data.width) * static_cast<std::size_t>(data.height));
    for (int y = data.y; y < data.y + data.height; ++y) {
        for (int x = data.x; x < data.x + data.width; ++x) {
            sampled.push_back(film.sampleCount(x, y) > 0 ? 1 : 0);
        }
    }
    return sampled;
}

} // namespace mbfeat
