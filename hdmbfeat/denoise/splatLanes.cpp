// The splat on SIMD lanes; compiled once for the library and once for AVX-512 (see CMakeLists.txt).
#if defined(__GNUC__) && !defined(__clang__)
// GCC 12's own AVX-512 intrinsics start from variables that they leave undefined.
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include <xsimd/xsimd.hpp>

#include "denoise/splatTile.h"

#ifndef MBFEAT_SPLAT
#define MBFEAT_SPLAT splatTileOnLanes
#endif

extern "C" __attribute__((visibility("default"))) void
MBFEAT_SPLAT(const mbfeat::SplatInput* input, const mbfeat::SplatTile* tile, float* out) {
    mbfeat::TileSplatter<xsimd::batch<float>>(*input, *tile).run(out);
}
