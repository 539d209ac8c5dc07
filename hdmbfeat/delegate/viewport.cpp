#include "delegate/viewport.h"

#include <algorithm>
#include <cmath>

#include "delegate/camera.h"

namespace mbfeat {

namespace {

/// Display window (float, as hosts may have it) and data window, y down, in buffer pixels.
struct Frame {
    GfVec2f displayMin, displaySize;
    PixelRect data;
    float pixelAspectRatio = 1.0F;
};

Frame frameOf(const HdRenderPassState& state) {
    const CameraUtilFraming& framing = state.GetFraming();
    Frame frame;
    if (framing.IsValid()) {
        frame.displayMin = framing.displayWindow.GetMin();
        frame.displaySize = framing.displayWindow.GetSize();
        frame.data = {framing.dataWindow.GetMinX(), framing.dataWindow.GetMinY(),
                      framing.dataWindow.GetWidth(), framing.dataWindow.GetHeight()};
        frame.pixelAspectRatio = framing.pixelAspectRatio;
    } else {
        const GfVec4f& viewport = state.GetViewport();
        frame.displayMin = {0.0F, 0.0F};
        frame.displaySize = {std::max(viewport[2], 1.0F), std::max(viewport[3], 1.0F)};
        frame.data = {0, 0, static_cast<int>(frame.displaySize[0]),
                      static_cast<int>(frame.displaySize[1])};
    }
    return frame;
}

bool isWhole(const GfVec2f& v) {
    return std::floor(v[0]) == v[0] && std::floor(v[1]) == v[1];
}

/// Makes the data window the image: for display windows that do not lie on pixel borders.
void cropCamera(const Frame& frame, Camera& camera) {
    const Float2 min = camera.windowMin;
    const Float2 size = camera.windowMax - camera.windowMin;
    const auto x = [&](float pixel) {
        return min.x + size.x * (pixel - frame.displayMin[0]) / frame.displaySize[0];
    };
    const auto y = [&](float pixel) { // pixels count down, the film plane up
        return min.y + size.y * (1.0F - (pixel - frame.displayMin[1]) / frame.displaySize[1]);
    };
    const PixelRect& data = frame.data;
    camera.windowMin = {x(static_cast<float>(data.x)), y(static_cast<float>(data.y + data.height))};
    camera.windowMax = {x(static_cast<float>(data.x + data.width)), y(static_cast<float>(data.y))};
}

} // namespace

Viewport resolveViewport(const HdRenderPassState& state, bool depthOfField,
                         Diagnostics& diagnostics) {
    const Frame frame = frameOf(state);
    const HdCamera& camera = *state.GetCamera();
    CameraRequest request;
    request.imageAspect =
        static_cast<double>(frame.displaySize[0]) * frame.pixelAspectRatio / frame.displaySize[1];
    request.conform = state.GetWindowPolicy();
    request.depthOfField = depthOfField;
    request.exposure = state.GetEnableExposureCompensation();

    Viewport viewport;
    viewport.cameraPath = camera.GetId().GetString();
    viewport.camera = translateCamera(camera, request, diagnostics);
    viewport.window.pixelAspectRatio = frame.pixelAspectRatio;
    const PixelRect& data = frame.data;
    if (isWhole(frame.displayMin) && isWhole(frame.displaySize)) {
        viewport.bufferX = static_cast<int>(frame.displayMin[0]);
        viewport.bufferY = static_cast<int>(frame.displayMin[1]);
        viewport.window.width = static_cast<int>(frame.displaySize[0]);
        viewport.window.height = static_cast<int>(frame.displaySize[1]);
        viewport.window.data = {data.x - viewport.bufferX, data.y - viewport.bufferY, data.width,
                                data.height};
    } else {
        cropCamera(frame, viewport.camera);
        viewport.bufferX = data.x;
        viewport.bufferY = data.y;
        viewport.window.width = data.width;
        viewport.window.height = data.height;
        viewport.window.data = {0, 0, data.width, data.height};
    }
    return viewport;
}

void addViewport(Fingerprint& fingerprint, const HdRenderPassState& state) {
    const Frame frame = frameOf(state);
    for (const GfVec2f& v : {frame.displayMin, frame.displaySize}) {
        fingerprint.add(v[0]);
        fingerprint.add(v[1]);
    }
    for (const int edge : {frame.data.x, frame.data.y, frame.data.width, frame.data.height}) {
        fingerprint.add(edge);
    }
    fingerprint.add(frame.pixelAspectRatio);
    fingerprint.add(state.GetWindowPolicy());
    fingerprint.add(state.GetEnableExposureCompensation());
    addCamera(fingerprint, *state.GetCamera());
}

void addCamera(Fingerprint& fingerprint, const HdCamera& camera) {
    fingerprint.add(camera.GetId().GetString());
    const GfMatrix4d& transform = camera.GetTransform();
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            fingerprint.add(transform[row][column]);
        }
    }
    fingerprint.add(camera.GetProjection());
    for (const float number :
         {camera.GetHorizontalAperture(), camera.GetVerticalAperture(),
          camera.GetHorizontalApertureOffset(), camera.GetVerticalApertureOffset(),
          camera.GetFocalLength(), camera.GetClippingRange().GetMin(),
          camera.GetClippingRange().GetMax(), camera.GetFStop(), camera.GetFocusDistance(),
          camera.GetLinearExposureScale()}) {
        fingerprint.add(number);
    }
}

} // namespace mbfeat
