// What is known of where a light, or a set of lights, is and shines: enough to say how much it can
// light a receiver at most, and whether it can at all. After Conty Estevez and Kulla 2018,
// "Importance Sampling of Many Lights With Adaptive Tree Splitting".
//
// Orientation: the normals of the surface lie within the angle `spread` of `axis`, and light leaves
// within `falloff` of a normal, by the cosine to it. With `bothSides` the same holds for the
// opposite of every direction: a two-sided flat light has a line rather than a direction.
#pragma once

#include "core/bounds.h"
#include "shading/lightSampler.h"

namespace mbfeat {

struct PreparedLight;

struct LightBounds {
    /// Environments and distant lights: `axis` points towards the light, `spread` is the half angle
    /// of the directions it comes from, `strength` an irradiance, of domes that shine evenly down
    /// to a tenth of it, since scattering finds them too; the rest is not used.
    bool atInfinity = false;
    Bounds box;
    float radius = 0.0F; ///< of a sphere around the box's centre that holds the light
    Float3 axis{0.0F, 0.0F, 1.0F};
    float spread = 0.0F, falloff = 0.0F; ///< radians
    bool bothSides = false;
    /// Radiant intensity along a normal, so that strength x cosines / squared distance estimates
    /// the irradiance at a receiver. The mean over the colour channels; above zero.
    double strength = 0.0;
};

LightBounds boundsOf(const PreparedLight& light);
LightBounds boundsOf(const EmissiveTriangle& triangle);

/// The measure of an orientation in the cost of a cluster: the integral over the sphere of the
/// cosine by which emission may fall off (Conty Estevez and Kulla 2018, section 4.2).
float orientationMeasure(float spread, float falloff, bool bothSides);

} // namespace mbfeat
