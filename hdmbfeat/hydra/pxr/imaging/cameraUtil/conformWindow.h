#pragma once

#include "pxr/base/gf/matrix4d.h"
#include "pxr/base/gf/range2d.h"
#include "pxr/base/gf/vec2d.h"
#include "pxr/base/gf/vec4d.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// How a filmback is fitted to an image of another aspect ratio.
enum CameraUtilConformWindowPolicy {
    CameraUtilMatchVertically,
    CameraUtilMatchHorizontally,
    CameraUtilFit,
    CameraUtilCrop,
    CameraUtilDontConform
};

/// The window (left, bottom to right, top), size, edges or projection with width over height made
/// equal to targetAspect by the policy.
GfRange2d CameraUtilConformedWindow(const GfRange2d& window, CameraUtilConformWindowPolicy policy,
                                    double targetAspect);
GfVec2d CameraUtilConformedWindow(const GfVec2d& window, CameraUtilConformWindowPolicy policy,
                                  double targetAspect);
GfVec4d CameraUtilConformedWindow(const GfVec4d& window, CameraUtilConformWindowPolicy policy,
                                  double targetAspect);
GfMatrix4d CameraUtilConformedWindow(const GfMatrix4d& projection,
                                     CameraUtilConformWindowPolicy policy, double targetAspect);

HYDRA_INTERFACE_CLOSE_SCOPE
