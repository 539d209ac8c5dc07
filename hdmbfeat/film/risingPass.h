// The first pass over an image that somebody watches: it comes at rising resolution, so that the
// whole image is there after a small part of the pass.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "film/film.h"

namespace mbfeat {

/// Every `stride`-th pixel of every `stride`-th row, from the corner of the data window, but for
/// those of the grid of the stride `coarser`; 0: none. Both are powers of two.
struct PixelGrid {
    int stride = 1;
    int coarser = 0;

    /// Whether the pixel at that offset from the corner is one of them.
    bool has(int x, int y) const {
        const int both = x | y;
        return (both & (stride - 1)) == 0 && (coarser == 0 || (both & (coarser - 1)) != 0);
    }
};

/// The grids of the pass, in order: together they have every pixel once.
constexpr std::array<PixelGrid, 4> kRisingGrids = {{{8, 0}, {4, 8}, {2, 4}, {1, 2}}};

/// How many of the grids of an image are whole when its first pass has so many samples.
int wholeGrids(const PixelRect& data, std::uint64_t samples);

/// Of each pixel of the data window, whether it has samples. Read before the film is resolved: then
/// whatever is said to be there is in what is resolved.
std::vector<std::uint8_t> sampledPixels(const Film& film);

/// Gives each pixel that has no samples the value of the one that stands for it in the finest grid
/// where that has some; pixels without any stay. `values` are rows, `channels` a pixel.
template <class T>
void fillFromCoarser(const std::vector<std::uint8_t>& sampled, int width, int channels, T* values) {
    const auto row = static_cast<std::size_t>(width);
    const auto size = static_cast<std::size_t>(channels);
    for (std::size_t pixel = 0; pixel < sampled.size(); ++pixel) {
        if (sampled[pixel] != 0) {
            continue;
        }
        const std::size_t x = pixel % row, y = pixel / row;
        for (auto grid = kRisingGrids.rbegin(); grid != kRisingGrids.rend(); ++grid) {
            const auto stride = static_cast<std::size_t>(grid->stride);
            const std::size_t from = y / stride * stride * row + x / stride * stride;
            if (sampled[from] != 0) {
                for (std::size_t c = 0; c < size; ++c) {
                    values[pixel * size + c] = values[from * size + c];
                }
                break;
            }
        }
    }
}

} // namespace mbfeat
