// The denoiser's operators on SIMD lanes; compiled once for the library and once for AVX-512 (see
// CMakeLists.txt), where their names differ.
#if defined(__GNUC__) && !defined(__clang__)
// GCC 12's own AVX-512 intrinsics start from variables that they leave undefined.
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include <xsimd/xsimd.hpp>

#include "denoise/atrousRow.h"
#include "denoise/channelLanes.h"
#include "denoise/pathEncoderLanes.h"
#include "denoise/splatTile.h"

#ifdef MBFEAT_WIDE_LANES
#define splatTileOnLanes splatTileOnWideLanes
#define atrousRowOnLanes atrousRowOnWideLanes
#define encodeOnLanes encodeOnWideLanes
#define writeChannelsOnLanes writeChannelsOnWideLanes
#endif

extern "C" __attribute__((visibility("default"))) void
splatTileOnLanes(const mbfeat::SplatInput* input, const mbfeat::SplatTile* tile, float* out) {
    mbfeat::TileSplatter<xsimd::batch<float>>(*input, *tile).run(out);
}

extern "C" __attribute__((visibility("default"))) void
atrousRowOnLanes(const mbfeat::ATrousPass* pass, int y, int x0, int x1) {
    mbfeat::ATrousRow<xsimd::batch<float>>(*pass, y).run(x0, x1);
}

extern "C" __attribute__((visibility("default"))) void
encodeOnLanes(const mbfeat::PathEncoder* encoder, const float* channels, int count,
              float* embeddings, float* divisors) {
    mbfeat::encodePathsOnLanes<xsimd::batch<float>>(*encoder, channels, count, embeddings,
                                                    divisors);
}

extern "C" __attribute__((visibility("default"))) std::uint32_t
writeChannelsOnLanes(const mbfeat::ChannelPlan* plan, const float* const* paths, int count,
                     float* out) {
    return mbfeat::writeChannels<xsimd::batch<float>>(*plan, paths, count, out);
}
