#pragma once

#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

/// Faces of a mesh with a material of their own.
struct HdGeomSubset {
    enum Type { TypeFaceSet };

    Type type;
    SdfPath id;
    SdfPath materialId;
    VtIntArray indices;
};
HYDRA_INTERFACE_SIZE(HdGeomSubset, 64, 8);

using HdGeomSubsets = std::vector<HdGeomSubset>;

HYDRA_INTERFACE_CLOSE_SCOPE
