// What a render pass draws into: the image that its camera and framing ask for.
#pragma once

#include "pxr/pxr.h"

#include "core/diagnostics.h"
#include "delegate/fingerprint.h"
#include "pxr/imaging/hd/camera.h"
#include "pxr/imaging/hd/renderPassState.h"
#include "scene/camera.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

struct Viewport {
    ImageWindow window;
    Camera camera;
    std::string cameraPath;
    /// Buffer position, from the top left, of the display window's pixel (0, 0).
    int bufferX = 0, bufferY = 0;
};

/// The camera and framing (or viewport, for hosts that give no framing) of a pass. Problems that
/// were worked around are reported. The state must have a camera.
Viewport resolveViewport(const HdRenderPassState& state, bool depthOfField,
                         Diagnostics& diagnostics);

/// Everything that resolveViewport() depends on.
void addViewport(Fingerprint& fingerprint, const HdRenderPassState& state);
void addCamera(Fingerprint& fingerprint, const HdCamera& camera);

} // namespace mbfeat
