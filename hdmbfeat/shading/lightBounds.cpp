#include "shading/lightBounds.h"

#include <algorithm>
#include <cmath>

#include "shading/preparedLight.h"

namespace mbfeat {

namespace {

constexpr double kPiExact = 3.14159265358979323846;
constexpr float kHalfPi = 0.5F * kPi;

/// At least the longest semi-axis of the ellipsoid with these axes, and that for orthogonal ones:
/// a bound of the largest eigenvalue of their Gram matrix (Gershgorin).
float reach(const Float3& x, const Float3& y, const Float3& z) {
    const float xy = std::abs(dot(x, y)), yz = std::abs(dot(y, z)), zx = std::abs(dot(z, x));
    return std::sqrt(std::max({dot(x, x) + xy + zx, dot(y, y) + xy + yz, dot(z, z) + yz + zx}));
}

/// Emission of a flat light. Shaping is about the light's own axis, which a shear turns away from
/// the normal; then either cone is a bound.
void orientFlat(LightBounds& out, const Float3& normal, const PreparedLight& light) {
    out.axis = normal;
    out.falloff = kHalfPi;
    if (!light.shaping.hasCone || light.shaping.cutoff >= kHalfPi) {
        return;
    }
    constexpr float kAligned = 1e-3F;
    if (dot(normal, light.axis) > 1.0F - 0.4F * kAligned * kAligned) {
        out.falloff = std::min(light.shaping.cutoff + kAligned, kHalfPi);
    } else {
        out.axis = light.axis;
        out.spread = light.shaping.cutoff;
        out.falloff = 0.0F;
    }
}

/// Emission of a light that shines everywhere, but for its shaping.
void orientRound(LightBounds& out, const PreparedLight& light) {
    out.axis = light.axis;
    out.spread = light.shaping.hasCone ? std::min(light.shaping.cutoff, kPi) : kPi;
    out.falloff = out.spread < kPi ? 0.0F : kHalfPi;
}

/// Intensity within the bounds of a light whose unshaped intensity along a normal is given. A focus
/// gives a beam much stronger than its mean: half way between the two, in proportions, neither
/// receivers in the beam nor those beside it are far off.
double shapedStrength(double unshaped, const LightBounds& bounds, const PreparedLight& light) {
    if (!light.shaping.isOn()) {
        return unshaped;
    }
    const bool flat = bounds.spread == 0.0F && bounds.falloff > 0.0F;
    const double whole = flat ? kPiExact : 4.0 * kPiExact;
    const double within = std::max(
        static_cast<double>(orientationMeasure(bounds.spread, bounds.falloff, false)), 1e-6);
    return unshaped * std::sqrt(std::min(light.shapedShare * whole / within, 1.0));
}

/// Measured on the benchmark's stages with an even dome and a lamp (benchmarks.md): less gains no
/// more.
constexpr double kLeastConcentration = 0.1;

void boundInfinite(LightBounds& out, const PreparedLight& light) {
    out.atInfinity = true;
    out.strength = light.power / kPiExact;
    if (const auto* direction = std::get_if<DirectionEmitter>(&light.emitter)) {
        out.axis = direction->axis;
    } else if (const auto* cone = std::get_if<ConeShape<float>>(&light.emitter)) {
        out.axis = cone->axis;
        out.spread = 2.0F * std::asin(std::sqrt(0.5F * std::min(cone->oneMinusCosMax, 2.0F)));
    } else {
        // What a dome sends through a sphere reaches a surface with a quarter of the density.
        out.spread = kPi;
        out.strength *= 0.25;
        // An even one is found by scattering, too, and takes samples from lights that are not;
        // one without shadows is found by its samples alone.
        if (light.castsShadows) {
            const EnvironmentMap& map = std::get<DomeEmitter>(light.emitter).map;
            out.strength *= std::max(map.concentration(), kLeastConcentration);
        }
    }
}

struct LocalBounds {
    LightBounds& out;
    const PreparedLight& light;

    void operator()(const DirectionEmitter& /*unused*/) const { boundInfinite(out, light); }
    void operator()(const ConeShape<float>& /*unused*/) const { boundInfinite(out, light); }
    void operator()(const DomeEmitter& /*unused*/) const { boundInfinite(out, light); }
    void operator()(const PointEmitter& point) const {
        out.box.add(point.position);
        orientRound(out, light);
        out.strength = 0.25 / kPiExact;
    }
    void operator()(const RectShape<float>& rect) const {
        finishFlat(rect.normal, std::max(length(rect.ex + rect.ey), length(rect.ex - rect.ey)));
    }
    void operator()(const DiskShape<float>& disk) const {
        finishFlat(disk.normal, reach(disk.ex, disk.ey, Float3(0.0F)));
    }
    void operator()(const EllipsoidShape<float>& shape) const {
        finishRound(reach(shape.ex, shape.ey, shape.ez));
    }
    void operator()(const CylinderShape<float>& shape) const {
        finishRound(length(shape.ex) + reach(shape.ey, shape.ez, Float3(0.0F)));
    }

    void finish(float radius) const {
        out.box = light.bounds;
        out.radius = std::min(radius + length(light.pointError), light.bounds.radius());
    }
    void finishFlat(const Float3& normal, float radius) const {
        finish(radius);
        orientFlat(out, normal, light);
        out.strength = 1.0 / kPiExact;
    }
    void finishRound(float radius) const {
        finish(radius);
        orientRound(out, light);
        out.strength = 0.25 / kPiExact;
    }
};

} // namespace

LightBounds boundsOf(const PreparedLight& light) {
    LightBounds out;
    std::visit(LocalBounds{out, light}, light.emitter);
    if (!out.atInfinity) {
        // Up to here the strength is intensity per flux of the unshaped light.
        out.strength = shapedStrength(out.strength * light.power / light.shapedShare, out, light);
    }
    return out;
}

LightBounds boundsOf(const EmissiveTriangle& triangle) {
    LightBounds out;
    out.box.add(triangle.p0);
    out.box.add(triangle.p1);
    out.box.add(triangle.p2);
    const Float3 center = out.box.center();
    out.radius = std::max(
        {length(triangle.p0 - center), length(triangle.p1 - center), length(triangle.p2 - center)});
    const Double3 normal = cross(Double3(triangle.p1) - Double3(triangle.p0),
                                 Double3(triangle.p2) - Double3(triangle.p0));
    const double twiceArea = length(normal);
    out.axis = Float3(normal / twiceArea);
    out.falloff = kHalfPi;
    out.bothSides = triangle.doubleSided;
    const Rgb& c = triangle.radiance;
    const double brightness =
        (static_cast<double>(max(c.x, 0.0F)) + max(c.y, 0.0F) + max(c.z, 0.0F)) / 3.0;
    out.strength = 0.5 * twiceArea * brightness;
    return out;
}

float orientationMeasure(float spread, float falloff, bool bothSides) {
    const float end = std::min(spread + falloff, kPi);
    const float s = std::sin(spread), c = std::cos(spread);
    const float cap = kTwoPi * (1.0F - c);
    const float rim = kHalfPi * (2.0F * (end - spread) * s - std::cos(spread - 2.0F * end) + c);
    return bothSides ? std::min(2.0F * (cap + rim), 4.0F * kPi) : cap + rim;
}

} // namespace mbfeat
