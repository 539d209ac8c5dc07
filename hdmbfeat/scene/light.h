// Lights as plain data, in the quantities of UsdLux: no brightness factors of our own.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/affine.h"
#include "scene/texture.h"

namespace mbfeat {

enum class LightType : std::uint8_t { kRect, kDisk, kSphere, kCylinder, kDistant, kDome };

/// UsdLux ShapingAPI, applied to rect, disk, sphere and cylinder lights about their -z axis.
struct LightShaping {
    float focus = 0.0F;
    Rgb focusTint{0.0F, 0.0F, 0.0F};
    float coneAngle = 90.0F;   ///< degrees
    float coneSoftness = 0.0F; ///< 0..1
    bool isOn() const { return focus > 0.0F || coneAngle < 90.0F; }
};

/// A light prim as authored. `radiance` already combines color, intensity, exposure and colour
/// temperature; `normalize` (divide by world-space area, or for distant lights by the
/// projected solid angle term of UsdLux) is applied by the light sampler, which knows the shape.
struct Light {
    std::string path;
    LightType type = LightType::kSphere;
    AffineD toWorld; ///< local space of UsdLux: emits along -z; dome: see shading/environmentMap.h
    Rgb radiance{1.0F, 1.0F, 1.0F};
    float diffuse = 1.0F;  ///< multiplier on light that arrives at diffuse lobes
    float specular = 1.0F; ///< multiplier on light that arrives at specular lobes
    bool normalize = false;
    /// UsdLux ShadowAPI. Without shadows it lights every surface as if nothing stood between.
    bool castsShadows = true;
    float width = 1.0F, height = 1.0F; ///< rect
    float radius = 0.5F;               ///< disk, sphere, cylinder
    float length = 1.0F;               ///< cylinder, along local x
    float angle = 0.53F;               ///< distant, degrees; 0 is a delta light
    bool treatAsPoint = false;         ///< sphere: radius ignored, delta position
    bool treatAsLine = false;          ///< cylinder: radius ignored; rendered as a very thin tube
    LightShaping shaping;
    bool visibleToCamera = true; ///< dome: domeLightCameraVisibility
    bool hasTexture = false;     ///< rect, dome
    ImageKey texture;
    std::shared_ptr<const Image> image; ///< filled by Scene::commit(); null: not readable or none
    bool isCameraLight = false; ///< the host's head light; used only when nothing else lights
};

} // namespace mbfeat
