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

float modulatedLight(const SplatInput& input, float plain, float divided, int unit, int colour,
                     std::size_t pixel) {
    const std::size_t plane =
        static_cast<std::size_t>(input.width) * static_cast<std::size_t>(input.height);
    const auto row = static_cast<std::size_t>(unit);
    const float albedo =
        input.divisor[(3 * row + static_cast<std::size_t>(colour)) * plane + pixel];
    const float gate = albedo > 0.0F ? input.gate[row * plane + pixel] : 0.0F;
    return (1.0F - gate) * plain + gate * albedo * divided;
}

void joinUnits(const SplatInput& input, const SplatTile& area, const float* separate, float* out) {
    const std::size_t plane =
        static_cast<std::size_t>(input.width) * static_cast<std::size_t>(input.height);
    const int lights = input.gate == nullptr ? input.lights : input.lights / 2;
    for (int unit = 0; unit < input.units;
         ++unit, separate += plane * static_cast<std::size_t>(input.lights)) {
        for (int c = 0; c < lights; ++c) {
            const float* const plain = separate + static_cast<std::size_t>(c) * plane;
            const float* const divided = plain + static_cast<std::size_t>(lights) * plane;
            float* const to = out + static_cast<std::size_t>(c) * plane;
            for (int y = area.y0; y < area.y1; ++y) {
                const std::size_t row =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(input.width);
                for (std::size_t i = row + static_cast<std::size_t>(area.x0);
                     i < row + static_cast<std::size_t>(area.x1); ++i) {
                    const float value =
                        input.gate == nullptr
                            ? plain[i]
                            : modulatedLight(input, plain[i], divided[i], unit, c % 3, i);
                    to[i] = unit > 0 ? to[i] + value : value;
                }
            }
        }
    }
}

} // namespace mbfeat
