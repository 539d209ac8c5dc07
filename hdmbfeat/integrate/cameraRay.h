// Camera rays: from a pixel position to a ray in render space (world minus the scene's origin).
#pragma once

#include "core/vec.h"
#include "scene/camera.h"

namespace mbfeat {

struct CameraRay {
    Float3 origin{0.0F};
    Float3 direction{0.0F, 0.0F, -1.0F}; ///< unit
    float tNear = 0.0F;
    float tFar = 0.0F;
};

/// A camera prepared for one image. Immutable, any thread.
class CameraRays {
public:
    CameraRays() = default;
    CameraRays(const Camera& camera, const ImageWindow& window, const Double3& sceneOrigin);

    /// `position` in display-window pixels (y down), `lens` uniform in [0,1)^2.
    CameraRay generate(Float2 position, Float2 lens) const;

    /// Distance of a render-space point along the view axis, scene units.
    float viewDepth(const Float3& p) const;
    /// Hydra's depth: 0 at the near plane, 1 at the far plane, projected.
    float projectedDepth(float viewDepth) const;
    Float3 toCamera(const Float3& v) const; ///< direction, to camera space
    float exposureScale() const { return camera_.exposureScale; }

private:
    Float3 toWorld(const Float3& v) const;

    Camera camera_;
    Float3 position_{0.0F};
    Float3 right_{1.0F, 0.0F, 0.0F}, up_{0.0F, 1.0F, 0.0F}, forward_{0.0F, 0.0F, -1.0F};
    Float2 pixelToWindowScale_{0.0F}, pixelToWindowOffset_{0.0F};
};

} // namespace mbfeat
