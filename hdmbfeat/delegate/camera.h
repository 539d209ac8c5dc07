// Cameras and image windows: from Hydra's camera and framing to the renderer's.
#pragma once

#include "pxr/pxr.h"

#include <string>

#include "core/diagnostics.h"
#include "pxr/imaging/cameraUtil/conformWindow.h"
#include "pxr/imaging/hd/camera.h"
#include "scene/camera.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

struct CameraRequest {
    double imageAspect = 1.0; ///< of the display window: width * pixel aspect / height
    CameraUtilConformWindowPolicy conform = CameraUtilFit;
    bool depthOfField = true;
    bool exposure = true; ///< apply the camera's exposure
};

/// The camera with its filmback fitted to the image. A camera that cannot see (no focal length or
/// aperture, a singular or non-finite transform) gets the nearest that can, which is reported.
Camera translateCamera(const HdCamera& prim, const CameraRequest& request,
                       Diagnostics& diagnostics);

} // namespace mbfeat
