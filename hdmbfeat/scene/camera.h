// Pinhole, thin-lens and orthographic cameras as plain data.
#pragma once

#include "core/affine.h"
#include "core/vec.h"

namespace mbfeat {

/// A rectangle of pixels. Pixel x covers [x, x + 1). y grows downwards, as in EXR.
struct PixelRect {
    int x = 0, y = 0, width = 0, height = 0;
};

/// Camera looks along -z of its local space, +y up. Lengths are scene units.
///
/// Image position: pixel coordinates (px, py) in the display window of resolution (w, h), which
/// the film plane window [windowMin, windowMax] covers. For perspective cameras the window is on
/// the plane z = -1; for orthographic ones it is in scene units on any plane.
struct Camera {
    AffineD toWorld;
    bool orthographic = false;
    Float2 windowMin{-1.0F, -1.0F}; ///< left, bottom of the display window
    Float2 windowMax{1.0F, 1.0F};   ///< right, top
    float nearClip = 0.0F;          ///< distance along -z; nearer surfaces are not seen
    float farClip = 1e30F;
    float lensRadius = 0.0F;    ///< focal length / (2 fStop); 0 is a pinhole
    float focusDistance = 0.0F; ///< along -z; used when lensRadius > 0
    float exposureScale = 1.0F; ///< linear factor on radiance (HdCamera linear exposure scale)
};

/// What of a camera's image is rendered: display resolution, and the data window inside (or,
/// with overscan, outside) it.
struct ImageWindow {
    int width = 0, height = 0; ///< display window, pixels
    PixelRect data;            ///< data window in display pixel coordinates
    float pixelAspectRatio = 1.0F;
};

} // namespace mbfeat
