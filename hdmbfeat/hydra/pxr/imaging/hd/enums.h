#pragma once

#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

enum HdCullStyle {
    HdCullStyleDontCare,
    HdCullStyleNothing,
    HdCullStyleBack,
    HdCullStyleFront,
    HdCullStyleBackUnlessDoubleSided,
    HdCullStyleFrontUnlessDoubleSided
};

enum HdMeshGeomStyle {
    HdMeshGeomStyleInvalid,
    HdMeshGeomStyleSurf,
    HdMeshGeomStyleEdgeOnly,
    HdMeshGeomStyleEdgeOnSurf,
    HdMeshGeomStyleHull,
    HdMeshGeomStyleHullEdgeOnly,
    HdMeshGeomStyleHullEdgeOnSurf,
    HdMeshGeomStylePoints
};

/// How often a primvar changes over a prim.
enum HdInterpolation {
    HdInterpolationConstant,
    HdInterpolationUniform,
    HdInterpolationVarying,
    HdInterpolationVertex,
    HdInterpolationFaceVarying,
    HdInterpolationInstance,
    HdInterpolationCount
};

HdCullStyle HdInvertCullStyle(HdCullStyle cullStyle);

HYDRA_INTERFACE_CLOSE_SCOPE
