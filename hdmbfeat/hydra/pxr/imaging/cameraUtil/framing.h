#pragma once

#include "pxr/base/gf/range2f.h"
#include "pxr/base/gf/rect2i.h"
#include "pxr/imaging/cameraUtil/conformWindow.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// Where the camera's filmback lands in a render buffer, in pixels, y down.
class CameraUtilFraming {
public:
    CameraUtilFraming();
    CameraUtilFraming(const GfRange2f& displayWindow, const GfRect2i& dataWindow,
                      float pixelAspectRatio = 1.0f);
    explicit CameraUtilFraming(const GfRect2i& dataWindow);

    /// False after default construction: then the viewport says what to draw.
    bool IsValid() const;

    bool operator==(const CameraUtilFraming& other) const;
    bool operator!=(const CameraUtilFraming& other) const;

    /// The window on the filmback plane that the data window shows.
    GfRange2f ComputeFilmbackWindow(float cameraAspectRatio,
                                    CameraUtilConformWindowPolicy windowPolicy) const;
    GfMatrix4d ApplyToProjectionMatrix(const GfMatrix4d& projection,
                                       CameraUtilConformWindowPolicy windowPolicy) const;

    GfRange2f displayWindow;
    GfRect2i dataWindow;
    float pixelAspectRatio;
};
HYDRA_INTERFACE_SIZE(CameraUtilFraming, 36, 4);

HYDRA_INTERFACE_CLOSE_SCOPE
