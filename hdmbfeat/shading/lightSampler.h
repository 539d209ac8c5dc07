// Everything that lights: analytic lights, emissive triangles and environments, sampled and
// evaluated with the same densities.
//
// Space: render space (world minus the scene's origin), float. Quantities are those of UsdLux:
// `Light::radiance` is emitted radiance; `normalize` divides it by the world-space surface area,
// or for a distant light by the projected solid angle of its disc; shaping multiplies it.
//
// A light is named by its index in the list given to commit(), whether or not it was dropped. A
// shape is a light that rays can hit; shapes are numbered on their own, without gaps, for the
// acceleration structure. Environments are what a ray that escapes sees: domes, and distant lights
// of an angle above zero.
//
// Multiple importance sampling is done per light: the density of the light sampling strategy for
// light i in direction wi is (probability of choosing i) x (density of i), which is what
// LightSample::pdf and the pdf functions return.
//
// Threads: commit() by one thread while nothing samples; the const members by any number.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/bounds.h"
#include "core/diagnostics.h"
#include "core/vec.h"
#include "scene/light.h"

namespace mbfeat {

/// A triangle that emits. `radiance` is a mean used to choose between lights; where the emission
/// varies, the caller evaluates it at the sampled point.
struct EmissiveTriangle {
    Float3 p0{0.0F}, p1{0.0F}, p2{0.0F};
    Rgb radiance{0.0F};
    bool doubleSided = true; ///< else emits on the side of cross(p1 - p0, p2 - p0) only
    /// The caller's name for it, unique in the list. A table up to the largest is kept, so names
    /// are best small.
    std::uint32_t userId = 0;
};

/// The point to be lit. With twoSided light may arrive from both sides of the surface.
struct LightReceiver {
    Float3 p{0.0F};
    Float3 n{0.0F, 0.0F, 1.0F};
    bool twoSided = true;
};

inline constexpr std::uint32_t kNoLight = 0xFFFFFFFFU;

/// A direction towards a light. pdf == 0 means that there is no light to be had: skip it.
struct LightSample {
    Float3 wi{0.0F, 0.0F, 1.0F}; ///< unit, from the receiver to the light
    float distance = 0.0F;       ///< to `point`; infinity for environments
    /// Radiance that arrives along wi, unoccluded, multipliers left out. For a delta light the
    /// irradiance on a surface facing it, so that radiance x bsdf x cosine / pdf is right for all.
    Rgb radiance{0.0F};
    float pdf = 0.0F;   ///< per solid angle, with the choice of light; delta: of the choice alone
    bool delta = false; ///< no other strategy can sample it: no MIS
    float diffuse = 1.0F, specular = 1.0F; ///< multipliers for light at diffuse, specular lobes
    bool castsShadows = true;              ///< false: what stands between does not matter
    std::uint32_t light = kNoLight;        ///< index of the light; kNoLight for a triangle
    std::uint32_t triangle = kNoLight;     ///< userId of the emissive triangle, if it is one
    float b1 = 0.0F, b2 = 0.0F;            ///< barycentric weights of its corners 1 and 2
    /// The sampled point, for shadow rays that end before the light (core/rayOffset.h). Not set
    /// for environments; normal is zero for a delta position, which needs no offset.
    Float3 point{0.0F}, pointError{0.0F}, normal{0.0F};
};

/// A chosen light, or emissive triangle. Probability 0: none can light.
struct LightPick {
    std::uint32_t light = kNoLight;    ///< index of the light; kNoLight for a triangle
    std::uint32_t triangle = kNoLight; ///< number of the triangle among the usable ones
    float probability = 0.0F;
};

struct LightPair;
struct PreparedLight;

/// What a ray that met a light shape sees.
struct LightHit {
    Rgb radiance{0.0F}; ///< towards the ray's origin; zero on sides that do not emit
    float pdf = 0.0F;   ///< density with which sample() would have found it from the receiver
    Float3 point{0.0F}, normal{0.0F};
};

class LightSampler {
public:
    LightSampler();
    ~LightSampler();
    LightSampler(LightSampler&&) noexcept;
    LightSampler& operator=(LightSampler&&) noexcept;

    /// Takes over lights and triangles. `origin` is the world point that render space is relative
    /// to. `sceneRadius` bounds the geometry around its centre; it is not used since environments
    /// are weighed against local lights at the receiver. Lights that cannot light (no area, black,
    /// not finite) are dropped with one message each. Camera lights stay only where nothing else
    /// lights.
    void commit(const std::vector<std::shared_ptr<const Light>>& lights, const Double3& origin,
                float sceneRadius, std::vector<EmissiveTriangle> triangles,
                Diagnostics& diagnostics);

    /// True where there is nothing to sample.
    bool empty() const;
    /// Number of lights in use; emissive triangles not counted.
    std::size_t activeLightCount() const;
    /// The light that is all there is to choose from; kNoLight where there are more, or triangles.
    std::uint32_t onlyLight() const;
    /// Lights and emissive triangles to choose from.
    std::size_t choiceCount() const;
    /// False for a light that was dropped.
    bool isActive(std::uint32_t light) const;

    /// Chooses a light with uLight and a point on it with u, all in [0, 1).
    LightSample sample(const LightReceiver& receiver, float uLight, Float2 u) const;
    /// The two steps of it: the choice, and the point on what was chosen.
    LightPick pick(const LightReceiver& receiver, float uLight) const {
        LightPick result;
        pick(&receiver, &uLight, 1, &result);
        return result;
    }
    /// The choice for up to 16 receivers, which takes less time together; each as it is alone.
    void pick(const LightReceiver* receivers, const float* uLight, int count,
              LightPick* picks) const;
    LightSample sample(const LightReceiver& receiver, const LightPick& pick, Float2 u) const;
    /// The probability with which pick() takes an active light: the same float.
    float choiceProbability(std::uint32_t light, const LightReceiver& receiver) const;
    /// The choice for many receivers at a time, where there is one; entries are indices of lights.
    const LightPair* pair() const;
    /// An active light, for many receivers or rays at a time (lightLanes.h).
    const PreparedLight& prepared(std::uint32_t light) const;

    // --- emissive triangles
    /// Density of sampling the point `hit` of that triangle from the receiver.
    float pdfTriangle(std::uint32_t userId, const LightReceiver& receiver, const Float3& hit) const;

    // --- shapes: analytic lights that rays can meet
    std::uint32_t shapeCount() const;
    /// Index of the light behind a shape, for the functions below.
    std::uint32_t lightOfShape(std::uint32_t shape) const;
    Bounds shapeBounds(std::uint32_t shape) const;
    /// Distance along the ray, in units of `direction`, within [tNear, tFar]; -1 for a miss.
    float intersectShape(std::uint32_t shape, const Float3& origin, const Float3& direction,
                         float tNear, float tFar) const;
    /// What the ray from the receiver along the unit vector wi sees of that light at `distance`.
    LightHit evaluateHit(std::uint32_t light, const LightReceiver& receiver, const Float3& wi,
                         float distance) const;

    // --- environments
    std::uint32_t environmentCount() const;
    /// Index of the light behind an environment.
    std::uint32_t lightOfEnvironment(std::uint32_t environment) const;
    /// Radiance of one environment from the unit direction wi (pointing away from the scene).
    Rgb environmentRadiance(std::uint32_t environment, const Float3& wi) const;
    /// Density with which sample() finds wi on that environment from the receiver.
    float environmentPdf(std::uint32_t environment, const LightReceiver& receiver,
                         const Float3& wi) const;
    /// Sum over environments; those hidden from the camera are left out for camera rays.
    Rgb environmentRadiance(const Float3& wi, bool cameraRay) const;

    // --- per light
    bool visibleToCamera(std::uint32_t light) const;
    bool castsShadows(std::uint32_t light) const;
    float diffuseMultiplier(std::uint32_t light) const;
    float specularMultiplier(std::uint32_t light) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
