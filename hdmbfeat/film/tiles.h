// How a pass over an image is cut into pieces of work.
#pragma once

#include <vector>

#include "scene/camera.h"

namespace mbfeat {

/// What one thread renders at a time: its samples share batches.
using TileGroup = std::vector<PixelRect>;

/// In double, which holds the count of any rectangle.
inline double pixelCount(const PixelRect& rect) {
    return static_cast<double>(rect.width) * rect.height;
}

/// Square tiles, cut off at the right and at the bottom; from left to right, then down.
std::vector<PixelRect> makeTiles(const PixelRect& rect, int side);

/// Side of square tiles that fill a batch with their samples, but leave each thread several tiles.
int fittedTile(const PixelRect& rect, int samples, int capacity, int threads);

/// A group of its own for every tile, in an order that is spread over the image from the start.
std::vector<TileGroup> singleTiles(const PixelRect& rect, int side);

/// As many neighbours of the given tiles together as fill a batch, but several groups a thread; the
/// groups in an order that is spread over the image from the start.
std::vector<TileGroup> groupTiles(const std::vector<PixelRect>& tiles, int samples, int capacity,
                                  int threads);

} // namespace mbfeat
