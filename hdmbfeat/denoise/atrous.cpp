#include "denoise/atrous.h"

#include <cstdint>

#include "core/floatTraps.h"
#include "core/library.h"
#include "core/parallel.h"
#include "denoise/atrousRow.h"

extern "C" void atrousRowOnLanes(const mbfeat::ATrousPass* pass, int y, int x0, int x1);

namespace mbfeat {

namespace {

using RowFunction = void (*)(const ATrousPass*, int, int, int);

void rowScalar(const ATrousPass* pass, int y, int x0, int x1) {
    ATrousRow<float>(*pass, y).run(x0, x1);
}

RowFunction functionOf(SplatLanes lanes) {
    static const auto wide = widest("atrousRowOnWideLanes", &atrousRowOnLanes);
    switch (lanes) {
    case SplatLanes::kScalar:
        return &rowScalar;
    case SplatLanes::kWide:
        return wide;
    case SplatLanes::kNarrow:
        break;
    }
    return &atrousRowOnLanes;
}

} // namespace

bool filter(const ATrousPass& pass, const SplatTile& area, ThreadPool& pool,
            const std::atomic<bool>* stop, SplatLanes lanes) {
    const RowFunction function = functionOf(lanes);
    constexpr std::int64_t kRows = 4;
    return pool.run(area.y0, area.y1, kRows, stop, [&](std::int64_t y, int /*thread*/) {
        const FloatTrapsMasked masked;
        function(&pass, static_cast<int>(y), area.x0, area.x1);
    });
}

} // namespace mbfeat
