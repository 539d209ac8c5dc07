// Which random dimension is used for what. Dimensions are reserved per vertex whether or not the
// vertex uses them, so that dropping an effect shifts no other number.
#pragma once

#include <cstdint>

namespace mbfeat {

enum CameraDimension : std::uint32_t {
    kDimPixel = 0, // 2: position in the pixel filter
    kDimLens = 2,  // 2
    kDimTime = 4,  // 1
};

/// Offsets within the block of a vertex; pairs start at even offsets.
enum VertexDimension : std::uint32_t {
    kDimBsdf = 0,        // 2
    kDimLight = 2,       // 2: point on the light
    kDimBsdfLobe = 4,    // 1
    kDimLightChoice = 5, // 1
    kDimRoulette = 6,    // 1
    kDimCutout = 7,      // 1: presence of the surfaces passed on the way to the vertex
    kVertexDimensions = 8,
};

inline constexpr std::uint32_t kCameraDimensions = 8;

inline std::uint32_t vertexDimension(int vertex) {
    return kCameraDimensions + kVertexDimensions * static_cast<std::uint32_t>(vertex);
}

} // namespace mbfeat
