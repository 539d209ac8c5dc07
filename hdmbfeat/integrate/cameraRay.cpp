#include "integrate/cameraRay.h"

#include "core/warp.h"

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

CameraRay CameraRays::generate(Float2 position, Float2 lens) const {
    const float x = fma(position.x, pixelToWindowScale_.x, pixelToWindowOffset_.x);
    const float y = fma(position.y, pixelToWindowScale_.y, pixelToWindowOffset_.y);

    Float3 origin = camera_.orthographic ? Float3(x, y, 0.0F) : Float3(0.0F);
    Float3 direction = camera_.orthographic ? Float3(0.0F, 0.0F, -1.0F) : Float3(x, y, -1.0F);
    if (camera_.lensRadius > 0.0F && camera_.focusDistance > 0.0F) {
        // direction.z is -1, so direction * focusDistance lies on the plane of focus.
        const Float3 focus = origin + direction * camera_.focusDistance;
        const Float2 disk = concentricDisk(lens);
        origin = origin + Float3(disk.x, disk.y, 0.0F) * camera_.lensRadius;
        direction = focus - origin;
    }
    // The clipping planes are perpendicular to the view axis: distances along the ray are longer.
    const float perDepth = length(direction) / -direction.z;

    CameraRay ray;
    ray.origin = position_ + toWorld(origin);
    ray.direction = normalize(toWorld(direction));
    ray.tNear = max(camera_.nearClip, 0.0F) * perDepth;
    ray.tFar = camera_.farClip * perDepth;
    return ray;
}

Float3 CameraRays::toWorld(const Float3& v) const {
    return right_ * v.x + up_ * v.y - forward_ * v.z;
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
