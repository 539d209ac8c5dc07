#include "integrate/cameraRay.h"

#include <algorithm>

namespace mbfeat {

CameraRays::CameraRays(const Camera& camera, const ImageWindow& window, const Double3& sceneOrigin)
    : camera_(camera) {
    position_ = Float3(camera.toWorld.t - sceneOrigin);
    // Axes are normalised one by one: lengths of a camera are scene units, whatever scale its
    // transform inherited.
    right_ = Float3(normalize(camera.toWorld.x));
    up_ = Float3(normalize(camera.toWorld.y));
    forward_ = Float3(normalize(-camera.toWorld.z));

    const float width = camera.windowMax.x - camera.windowMin.x;
    const float height = camera.windowMax.y - camera.windowMin.y;
    pixelToWindowScale_ = {width / static_cast<float>(window.width),
                           -height / static_cast<float>(window.height)};
    pixelToWindowOffset_ = {camera.windowMin.x, camera.windowMax.y};
}

float CameraRays::viewDepth(const Float3& p) const {
    return dot(p - position_, forward_);
}

float CameraRays::projectedDepth(float viewDepth) const {
    const double n = camera_.nearClip;
    const double f = camera_.farClip;
    const double z = viewDepth;
    if (!(f > n) || !(z > 0.0)) {
        return 0.0F;
    }
    const double depth =
        camera_.orthographic || n <= 0.0 ? (z - n) / (f - n) : f * (z - n) / (z * (f - n));
    return static_cast<float>(std::min(std::max(depth, 0.0), 1.0));
}

Float3 CameraRays::toCamera(const Float3& v) const {
    return {dot(v, right_), dot(v, up_), -dot(v, forward_)};
}

} // namespace mbfeat
