// One light for many receivers or rays: the light's own numbers are the same in all lanes. Float
// and SIMD lanes give the same bits but where samplesOnLanes() says otherwise.
#pragma once

#include <limits>
#include <variant>

#include "core/overloaded.h"
#include "shading/lightSampler.h"
#include "shading/preparedLight.h"

namespace mbfeat {

/// Distance along each ray to the light's shape within [tNear, tFar]; -1 for a miss.
template <class T>
T intersectLight(const PreparedLight& light, const Vec3<T>& origin, const Vec3<T>& direction,
                 const T& tNear, const T& tFar) {
    const auto meet = [&](const auto& shape) {
        return shape.intersect(origin, direction, tNear, tFar);
    };
    return std::visit(
        Overloaded{
            [&](const RectShape<float>& s) { return meet(RectShape<T>(s)); },
            [&](const DiskShape<float>& s) { return meet(DiskShape<T>(s)); },
            [&](const EllipsoidShape<float>& s) { return meet(EllipsoidShape<T>(s)); },
            [&](const CylinderShape<float>& s) { return meet(CylinderShape<T>(s)); },
            [](const auto&) { return T(-1); },
        },
        light.emitter);
}

/// A light sampled from each lane's receiver; the density without the choice of light.
template <class T>
struct LightLanes : ShapeSample<T> {
    Vec3<T> radiance{T(0)};
};

/// Whether sampleOnLanes() is all of this light, and the same to the bit in all lane types: not so
/// cylinders, nor what shaping and textures make of the radiance of shapes.
inline bool samplesOnLanes(const PreparedLight& light) {
    return !light.shaping.isOn() && !light.texture &&
           !std::holds_alternative<CylinderShape<float>>(light.emitter);
}

/// What each lane's unit direction meets of an environment: its radiance, and the density of its
/// sampling for the surface, without the choice of light.
template <class T>
EnvironmentMap::Seen<T> lookAtEnvironment(const PreparedLight& light, const Vec3<T>& wi,
                                          const Facing<T>& to = {}) {
    const Vec3<T> radiance(light.radiance);
    if (const auto* const dome = std::get_if<DomeEmitter>(&light.emitter)) {
        EnvironmentMap::Seen<T> seen = dome->look<T>(wi, to);
        seen.value = radiance * seen.value;
        return seen;
    }
    const auto& cone = std::get<ConeShape<float>>(light.emitter);
    const T pdf = ConeShape<T>{Vec3<T>(cone.axis), T(cone.oneMinusCosMax)}.pdf(wi);
    return {select<T>(pdf > T(0), radiance, Vec3<T>(T(0))), pdf};
}

/// A sample of an ellipsoid, inwards of which nothing is emitted.
template <class T>
ShapeSample<T> sampleOutside(const EllipsoidShape<T>& shape, const Vec3<T>& p, const Vec2<T>& u) {
    ShapeSample<T> s = shape.sample(p, u);
    s.pdf = select(dot(s.normal, s.wi) < T(0), s.pdf, T(0));
    return s;
}

/// What each lane's unit direction meets of all environments, of those that the camera sees where
/// it is its ray.
template <class T>
Vec3<T> radianceOfEnvironments(const LightSampler& lights, const Vec3<T>& wi, bool cameraRay) {
    Vec3<T> sum(T(0));
    for (std::uint32_t e = 0; e < lights.environmentCount(); ++e) {
        const std::uint32_t light = lights.lightOfEnvironment(e);
        if (!cameraRay || lights.visibleToCamera(light)) {
            sum += lookAtEnvironment<T>(lights.prepared(light), wi).value;
        }
    }
    return sum;
}

/// A sample of the light from each p, of a surface that faces some way; its radiance as it is
/// without shaping and texture.
template <class T>
LightLanes<T> sampleOnLanes(const PreparedLight& light, const Vec3<T>& p, const Facing<T>& to,
                            const Vec2<T>& u) {
    LightLanes<T> out;
    out.radiance = Vec3<T>(light.radiance);
    const auto take = [&](const ShapeSample<T>& s) { static_cast<ShapeSample<T>&>(out) = s; };
    std::visit(Overloaded{
                   [&](const PointEmitter& point) {
                       out.point = Vec3<T>(point.position);
                       const Vec3<T> d = out.point - p;
                       const T squared = lengthSquared(d);
                       const Mask<T> apart = squared > T(0);
                       const T safe = select(apart, squared, T(1));
                       out.distance = sqrt(safe);
                       out.wi = d / out.distance;
                       out.radiance = out.radiance / safe;
                       out.pdf = select(apart, T(1), T(0));
                   },
                   [&](const DirectionEmitter& direction) {
                       out.wi = Vec3<T>(direction.axis);
                       out.distance = T(std::numeric_limits<float>::infinity());
                       out.pdf = T(1);
                   },
                   [&](const ConeShape<float>& cone) {
                       const ConeShape<T> lanes{Vec3<T>(cone.axis), T(cone.oneMinusCosMax)};
                       out.wi = lanes.sample(u);
                       out.distance = T(std::numeric_limits<float>::infinity());
                       out.pdf = uniformConePdf(lanes.oneMinusCosMax);
                   },
                   [&](const RectShape<float>& s) { take(RectShape<T>(s).sample(p, u)); },
                   [&](const DiskShape<float>& s) { take(DiskShape<T>(s).sample(p, u)); },
                   [&](const CylinderShape<float>& s) { take(CylinderShape<T>(s).sample(p, u)); },
                   [&](const EllipsoidShape<float>& s) {
                       take(sampleOutside(EllipsoidShape<T>(s), p, u));
                   },
                   [&](const DomeEmitter& dome) {
                       const EnvironmentMap::LaneSample<T> s = dome.sample<T>(u, to);
                       out.wi = s.direction;
                       out.distance = T(std::numeric_limits<float>::infinity());
                       out.pdf = s.pdf;
                       out.radiance = out.radiance * s.value;
                   },
               },
               light.emitter);
    return out;
}

/// The density, or zero where the sample is of no use: it comes from below a receiver that is lit
/// from one side only, has no light, or is not finite.
template <class T>
T usablePdf(const T& pdf, const Vec3<T>& wi, const Vec3<T>& radiance, const Vec3<T>& n,
            const Mask<T>& twoSided) {
    // Zero times anything finite is zero.
    const Vec3<T> zeros = (wi + radiance) * T(0);
    const Mask<T> finite = zeros.x + zeros.y + zeros.z + pdf * T(0) == T(0);
    const Mask<T> above = twoSided || dot(wi, n) > T(0);
    const Mask<T> lit = radiance.x != T(0) || radiance.y != T(0) || radiance.z != T(0);
    return select(finite && above && lit, pdf, T(0));
}

} // namespace mbfeat
