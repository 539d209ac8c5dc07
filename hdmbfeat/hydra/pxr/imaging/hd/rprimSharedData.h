#pragma once

#include "pxr/base/gf/bbox3d.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <cstddef>

HYDRA_INTERFACE_OPEN_SCOPE

/// What an rprim shares with its draw items. Made and destroyed by HdRprim, that is by the library.
struct HdRprimSharedData {
    alignas(8) std::byte _opaqueBuffers[24];
    GfBBox3d bounds;
    int instancerLevels;
    bool visible;
    SdfPath rprimID;
    alignas(8) std::byte _opaqueFaceVarying[24];

    HdRprimSharedData() = delete;
};
HYDRA_INTERFACE_SIZE(HdRprimSharedData, 376, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
