// A light prim turned into what the sampler works with: shape in render space, radiance in final
// units, shaping. All decisions about UsdLux quantities are taken here.
//
//   normalize      area lights: radiance / world-space surface area (of the emitting surface).
//                  Distant lights, with t half their angle: / 1 for t = 0, pi sin^2 t up to 90
//                  degrees, pi (2 - sin^2 t) beyond. Domes ignore it.
//   distant light  direction towards it is the image of local +z. Angle 0: the radiance is the
//                  irradiance on a surface that faces it.
//   treatAsPoint   a sphere of radiance L and area A has intensity L A / 4 in every direction
//                  (the mean projected area of a convex body is A / 4, Cauchy). With normalize
//                  that is L / 4 whatever the radius.
//   treatAsLine    a tube of a thousandth of its length as diameter, of the same power.
//   rect texture   upright for somebody lit by the light who looks at it: the image's left is
//                  local +x, its top +y.
//   shaping        see lightShaping.h.
#pragma once

#include <memory>
#include <optional>
#include <variant>

#include "core/bounds.h"
#include "core/diagnostics.h"
#include "scene/light.h"
#include "shading/environmentMap.h"
#include "shading/lightShapes.h"
#include "shading/lightShaping.h"

namespace mbfeat {

/// A delta position. Its intensity is PreparedLight::radiance.
struct PointEmitter {
    Float3 position{0.0F};
};

/// A delta direction. Its irradiance is PreparedLight::radiance.
struct DirectionEmitter {
    Float3 axis{0.0F, 0.0F, 1.0F}; ///< towards the light
};

/// A dome: an environment map under a rotation (any linear map that is not singular).
struct DomeEmitter {
    EnvironmentMap map;
    AffineF toLocal, toRender; ///< linear parts, scaled to determinant +-1

    // A linear map M of determinant 1 takes solid angle at w to that at Mw / |Mw| times 1 / |Mw|^3.
    /// For a surface that faces some way in render space, as the next.
    template <class T>
    EnvironmentMap::LaneSample<T> sample(const Vec2<T>& u, const Facing<T>& to) const {
        EnvironmentMap::LaneSample<T> s = map.sample<T>(u, local(to));
        const Vec3<T> w = toRender.as<T>().vector(s.direction);
        const T l = length(w);
        s.direction = w / l;
        s.pdf = s.pdf * l * l * l;
        return s;
    }
    /// Along the unit direction wi.
    template <class T>
    EnvironmentMap::Seen<T> look(const Vec3<T>& wi, const Facing<T>& to) const {
        const Vec3<T> w = toLocal.as<T>().vector(wi);
        const T l = length(w);
        EnvironmentMap::Seen<T> seen = map.look<T>(w / l, local(to));
        seen.pdf = seen.pdf / (l * l * l);
        return seen;
    }

private:
    /// The side of a plane goes over to that of its image: normals are mapped by the transpose of
    /// the map back.
    template <class T>
    Facing<T> local(const Facing<T>& to) const {
        const AffineF& m = toRender;
        const Vec3<T> n{dot(Vec3<T>(m.x), to.n), dot(Vec3<T>(m.y), to.n), dot(Vec3<T>(m.z), to.n)};
        return {n / length(n), to.twoSided};
    }
};

struct PreparedLight {
    std::variant<PointEmitter, DirectionEmitter, ConeShape<float>, DomeEmitter, RectShape<float>,
                 DiskShape<float>, EllipsoidShape<float>, CylinderShape<float>>
        emitter;
    Rgb radiance{0.0F};
    ShapingFunction<float> shaping;
    Float3 axis{0.0F, 0.0F, -1.0F};       ///< unit, the image of local -z
    Float3 pointError{0.0F};              ///< of points on the shape
    Bounds bounds;                        ///< of the shape
    std::shared_ptr<const Image> texture; ///< rect only
    float diffuse = 1.0F, specular = 1.0F;
    bool castsShadows = true;
    bool visibleToCamera = true;
    /// Flux of a local light; for an environment its flux through a unit disc, times pi.
    double power = 0.0;
    double shapedShare = 1.0; ///< of the power, what shaping lets out; included in it

    bool isDelta() const {
        return std::holds_alternative<PointEmitter>(emitter) ||
               std::holds_alternative<DirectionEmitter>(emitter);
    }
    bool isEnvironment() const {
        return std::holds_alternative<ConeShape<float>>(emitter) ||
               std::holds_alternative<DomeEmitter>(emitter);
    }
    bool isShape() const { return !isDelta() && !isEnvironment(); }

    /// Radiance of a shape from the point with local coordinates uv (rect) towards -wi.
    Rgb emitted(Float2 uv, const Float3& wi) const;
};

/// The light in render space (world minus origin). Nothing where it cannot light; `diagnostics`
/// then says why, once, naming the prim.
std::optional<PreparedLight> prepareLight(const Light& light, const Double3& origin,
                                          Diagnostics& diagnostics);

} // namespace mbfeat
