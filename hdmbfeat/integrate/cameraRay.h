// Camera rays: from a pixel position to a ray in render space (world minus the scene's origin).
#pragma once

#include "core/vec.h"
#include "core/warp.h"
#include "scene/camera.h"

namespace mbfeat {

template <class T>
struct CameraRay {
    Vec3<T> origin{T(0)};
    Vec3<T> direction{T(0), T(0), T(-1)}; ///< unit
    T tNear{T(0)};
    T tFar{T(0)};
};

/// A camera prepared for one image. Immutable, any thread.
class CameraRays {
public:
    CameraRays() = default;
    CameraRays(const Camera& camera, const ImageWindow& window, const Double3& sceneOrigin);

    /// `position` in display-window pixels (y down), `lens` uniform in [0,1)^2.
    template <class T>
    CameraRay<T> generate(const Vec2<T>& position, const Vec2<T>& lens) const {
        const T x = fma(position.x, T(pixelToWindowScale_.x), T(pixelToWindowOffset_.x));
        const T y = fma(position.y, T(pixelToWindowScale_.y), T(pixelToWindowOffset_.y));
        const T zero(0);
        Vec3<T> origin = camera_.orthographic ? Vec3<T>(x, y, zero) : Vec3<T>(zero);
        Vec3<T> direction =
            camera_.orthographic ? Vec3<T>(zero, zero, T(-1)) : Vec3<T>(x, y, T(-1));
        if (hasLens()) {
            // direction.z is -1, so direction * focusDistance lies on the plane of focus.
            const Vec3<T> focus = origin + direction * T(camera_.focusDistance);
            const Vec2<T> disk = concentricDisk(lens);
            origin = origin + Vec3<T>(disk.x, disk.y, zero) * T(camera_.lensRadius);
            direction = focus - origin;
        }
        // The clipping planes are perpendicular to the view axis: distances along the ray are
        // longer.
        const T perDepth = length(direction) / negate(direction.z);
        return {Vec3<T>(position_) + toWorld(origin), normalize(toWorld(direction)),
                T(max(camera_.nearClip, 0.0F)) * perDepth, T(camera_.farClip) * perDepth};
    }
    /// Whether generate() reads `lens`.
    bool hasLens() const { return camera_.lensRadius > 0.0F && camera_.focusDistance > 0.0F; }

    /// Distance of a render-space point along the view axis, scene units.
    float viewDepth(const Float3& p) const;
    /// Hydra's depth: 0 at the near plane, 1 at the far plane, projected.
    float projectedDepth(float viewDepth) const;
    Float3 toCamera(const Float3& v) const; ///< direction, to camera space
    float exposureScale() const { return camera_.exposureScale; }

private:
    template <class T>
    Vec3<T> toWorld(const Vec3<T>& v) const {
        return Vec3<T>(right_) * v.x + Vec3<T>(up_) * v.y - Vec3<T>(forward_) * v.z;
    }

    Camera camera_;
    Float3 position_{0.0F};
    Float3 right_{1.0F, 0.0F, 0.0F}, up_{0.0F, 1.0F, 0.0F}, forward_{0.0F, 0.0F, -1.0F};
    Float2 pixelToWindowScale_{0.0F}, pixelToWindowOffset_{0.0F};
};

} // namespace mbfeat
