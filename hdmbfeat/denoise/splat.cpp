#include "denoise/splat.h"

#include <algorithm>
#include <vector>

#include "core/floatTraps.h"
#include "core/library.h"
#include "core/parallel.h"
#include "denoise/splatTile.h"

extern "C" void splatTileOnLanes(const mbfeat::SplatInput* input, const mbfeat::SplatTile* tile,
                                 float* out);

namespace mbfeat {

namespace {

using TileFunction = void (*)(const SplatInput*, const SplatTile*, float*);

void splatTileScalar(const SplatInput* input, const SplatTile* tile, float* out) {
    TileSplatter<float>(*input, *tile).run(out);
}

TileFunction wideFunction() {
    static const auto found =
        reinterpret_cast<TileFunction>(WideModule::instance().symbol("splatTileOnWideLanes"));
    return found;
}

TileFunction functionOf(SplatLanes lanes) {
    switch (lanes) {
    case SplatLanes::kScalar:
        return &splatTileScalar;
    case SplatLanes::kWide:
        if (wideFunction() != nullptr) {
            return wideFunction();
        }
        break;
    case SplatLanes::kNarrow:
        break;
    }
    return &splatTileOnLanes;
}

// With a margin for the kernel, a unit's hidden channels of a tile stay in a core's own cache.
constexpr int kTileWidth = 128, kTileHeight = 16;

} // namespace

SplatLanes widestSplatLanes() {
    return wideFunction() != nullptr ? SplatLanes::kWide : SplatLanes::kNarrow;
}

bool splat(const SplatInput& input, const SplatTile& area, float* out, ThreadPool& pool,
           const std::atomic<bool>* stop, SplatLanes lanes) {
    std::vector<SplatTile> tiles;
    for (int y = area.y0; y < area.y1; y += kTileHeight) {
        for (int x = area.x0; x < area.x1; x += kTileWidth) {
            tiles.push_back(
                {x, y, std::min(x + kTileWidth, area.x1), std::min(y + kTileHeight, area.y1)});
        }
    }
    const TileFunction function = functionOf(lanes);
    return pool.run(0, static_cast<std::int64_t>(tiles.size()), 1, stop,
                    [&](std::int64_t index, int /*thread*/) {
                        const FloatTrapsMasked masked;
                        function(&input, &tiles[static_cast<std::size_t>(index)], out);
                    });
}

} // namespace mbfeat
