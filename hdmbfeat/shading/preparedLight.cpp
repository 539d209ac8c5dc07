#include "shading/preparedLight.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace mbfeat {

namespace {

constexpr double kPiExact = 3.14159265358979323846;
/// Half angles below are indistinguishable from a delta in single precision.
constexpr double kMinDistantHalfAngle = 2e-6;
constexpr double kLineThickness = 1e-3;

bool isFinite(const Double3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool isFinite(const AffineD& a) {
    return isFinite(a.x) && isFinite(a.y) && isFinite(a.z) && isFinite(a.t);
}

double brightness(const Rgb& c) {
    return (static_cast<double>(c.x) + static_cast<double>(c.y) + static_cast<double>(c.z)) / 3.0;
}

/// Mean squared radius of what is a sphere to far below single precision; 0 for other ellipsoids.
double squaredRadius(const EllipsoidShape<double>& shape) {
    constexpr double kTolerance = 1e-10;
    const double xx = lengthSquared(shape.ex), yy = lengthSquared(shape.ey),
                 zz = lengthSquared(shape.ez);
    const double mean = (xx + yy + zz) / 3.0;
    const double error =
        std::max({std::abs(xx - mean), std::abs(yy - mean), std::abs(zz - mean),
                  std::abs(dot(shape.ex, shape.ey)), std::abs(dot(shape.ey, shape.ez)),
                  std::abs(dot(shape.ez, shape.ex))});
    return error <= kTolerance * mean ? mean : 0.0;
}

/// Area of the image of the unit sphere: the integral of |cof(M) q| over the sphere, by two-point
/// Gauss rules in cos(theta) and the trapezoidal rule in phi. That takes a millisecond or two,
/// which a hundred thousand lights would make minutes: spheres, which most of them are, do without.
double ellipsoidArea(const EllipsoidShape<double>& shape) {
    if (const double squared = squaredRadius(shape); squared > 0.0) {
        return 4.0 * kPiExact * squared;
    }
    constexpr int kPanels = 256, kPhi = 128;
    double sum = 0.0;
    for (int i = 0; i < 2 * kPanels; ++i) {
        const int panel = i / 2;
        const double node = (i % 2 == 0 ? -1.0 : 1.0) / std::sqrt(3.0);
        const double z = (2.0 * panel + 1.0 + node) / kPanels - 1.0;
        const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
        for (int j = 0; j < kPhi; ++j) {
            const double phi = 2.0 * kPiExact * (j + 0.5) / kPhi;
            sum += length(shape.cofactor({r * std::cos(phi), r * std::sin(phi), z}));
        }
    }
    return 4.0 * kPiExact * sum / (2.0 * kPanels * kPhi);
}

/// Lateral area of the image of the cylinder; the trapezoidal rule is spectrally accurate here.
double cylinderArea(const CylinderShape<double>& shape) {
    constexpr int kPhi = 1024;
    double sum = 0.0;
    for (int j = 0; j < kPhi; ++j) {
        const double phi = 2.0 * kPiExact * (j + 0.5) / kPhi;
        sum += length(shape.cofactor({0.0, std::cos(phi), std::sin(phi)}));
    }
    return 2.0 * 2.0 * kPiExact * sum / kPhi;
}

/// Mean of the shaping factor's brightness, for the choice of light only: over the cosine-weighted
/// hemisphere for flat lights, over the sphere for round ones.
double shapingMean(const ShapingFunction<float>& shaping, bool flat) {
    if (!shaping.isOn()) {
        return 1.0;
    }
    // Uniform in t = cos^2 or t = (1 + cos) / 2, from the axis at t = 1 to the cone: narrow beams
    // must not fall between the steps.
    double range = 1.0;
    if (shaping.hasCone) {
        const double cutoff = static_cast<double>(shaping.cutoff);
        const double sine = flat ? std::sin(std::min(cutoff, 0.5 * kPiExact))
                                 : std::sin(0.5 * std::min(cutoff, kPiExact));
        range = sine * sine;
    }
    // A focus is the same in front and behind, and steps that shrink towards the axis see one of
    // up to 1e9: half of a round light's sphere stands for all of it.
    const bool mirrored = shaping.hasFocus && !shaping.hasCone && !flat;
    range *= mirrored ? 0.5 : 1.0;
    constexpr int kSteps = 128;
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        const double step = (i + 0.5) / kSteps;
        const double cube = shaping.hasFocus ? step * step * step : 1.0;
        const double t = 1.0 - range * step * cube;
        const double cosine = flat ? std::sqrt(t) : 2.0 * t - 1.0;
        sum += brightness(shaping.evaluate(static_cast<float>(cosine))) *
               (shaping.hasFocus ? 4.0 * cube : 1.0);
    }
    return (mirrored ? 2.0 : 1.0) * range * sum / kSteps;
}

double textureMean(const std::shared_ptr<const Image>& image) {
    if (!image) {
        return 1.0;
    }
    double sum = 0.0;
    for (int y = 0; y < image->height(); ++y) {
        for (int x = 0; x < image->width(); ++x) {
            const Float4 c = image->texel(x, y);
            sum += brightness({max(c.x, 0.0F), max(c.y, 0.0F), max(c.z, 0.0F)});
        }
    }
    return sum / (static_cast<double>(image->width()) * image->height());
}

/// The axes of a light's space, radius and size multiplied in, in render space.
struct Axes {
    Double3 center, x, y, z;
    Double3 minusZ; ///< unit; image of local -z
};

/// Works on one light; every refusal is one message.
class Preparation {
public:
    Preparation(const Light& light, const Double3& origin, Diagnostics& diagnostics)
        : light_(light),
          diagnostics_(diagnostics) {
        axes_.center = light.toWorld.t - origin;
        const double zLength = length(light.toWorld.z);
        if (zLength > 0.0) {
            axes_.minusZ = light.toWorld.z / -zLength;
        } else {
            // Flattened along z: flat lights still face somewhere.
            const Double3 n = cross(light.toWorld.x, light.toWorld.y);
            axes_.minusZ = lengthSquared(n) > 0.0 ? normalize(n) * -1.0 : Double3(0.0, 0.0, -1.0);
        }
    }

    std::optional<PreparedLight> run() {
        if (!checkNumbers() || !checkBlack() || !build()) {
            return std::nullopt;
        }
        result_.shaping = result_.isShape() || std::holds_alternative<PointEmitter>(result_.emitter)
                              ? ShapingFunction<float>(light_.shaping)
                              : ShapingFunction<float>();
        const bool flat = light_.type == LightType::kRect || light_.type == LightType::kDisk;
        result_.shapedShare = shapingMean(result_.shaping, flat);
        result_.power *= result_.shapedShare;
        result_.axis = Float3(axes_.minusZ);
        result_.diffuse = light_.diffuse;
        result_.specular = light_.specular;
        result_.castsShadows = light_.castsShadows;
        result_.visibleToCamera = light_.visibleToCamera;
        if (!isFinite(result_.radiance) || !std::isfinite(result_.power)) {
            return refuse("Its emission overflows after the division by its size, so the light was "
                          "left out. Make the light larger or its intensity smaller.");
        }
        if (!(result_.power > 0.0)) {
            return refuseQuietly("Its texture or shaping lets no light out, so the light was left "
                                 "out. Check the texture and the cone angle.");
        }
        return std::move(result_);
    }

private:
    std::nullopt_t refuse(const std::string& text) {
        diagnostics_.warn(light_.path, text);
        return std::nullopt;
    }
    /// For what is a usual way of switching a light off.
    std::nullopt_t refuseQuietly(const std::string& text) {
        diagnostics_.report(Severity::kInfo, light_.path, text);
        return std::nullopt;
    }

    bool checkNumbers() {
        const bool finite = isFinite(light_.toWorld) && mbfeat::isFinite(light_.radiance) &&
                            std::isfinite(light_.diffuse) && std::isfinite(light_.specular) &&
                            std::isfinite(light_.width) && std::isfinite(light_.height) &&
                            std::isfinite(light_.radius) && std::isfinite(light_.length) &&
                            std::isfinite(light_.angle) && std::isfinite(light_.shaping.focus) &&
                            std::isfinite(light_.shaping.coneAngle) &&
                            std::isfinite(light_.shaping.coneSoftness) &&
                            mbfeat::isFinite(light_.shaping.focusTint);
        if (!finite) {
            refuse("Its transform, color, intensity, exposure, size or shaping is not a finite "
                   "number, so the light was left out. Author finite values.");
        }
        return finite;
    }

    bool checkBlack() {
        const Rgb& c = light_.radiance;
        result_.radiance = {max(c.x, 0.0F), max(c.y, 0.0F), max(c.z, 0.0F)};
        if (isBlack(result_.radiance)) {
            refuseQuietly("Its color or intensity is zero or negative, so it emits nothing and was "
                          "left out. Raise them to light with it.");
            return false;
        }
        return true;
    }

    bool build() {
        switch (light_.type) {
        case LightType::kRect:
            return buildRect();
        case LightType::kDisk:
            return buildDisk();
        case LightType::kSphere:
            return buildSphere();
        case LightType::kCylinder:
            return buildCylinder();
        case LightType::kDistant:
            return buildDistant();
        case LightType::kDome:
            return buildDome();
        }
        return false;
    }

    void scaleAxes(double x, double y, double z) {
        axes_.x = light_.toWorld.x * x;
        axes_.y = light_.toWorld.y * y;
        axes_.z = light_.toWorld.z * z;
        // A point is the centre plus at most one of each axis; eight roundings cover the map, the
        // local point and the conversion of the parameters to float.
        const Float3 extent =
            Float3(abs(axes_.center) + abs(axes_.x) + abs(axes_.y) + abs(axes_.z));
        result_.pointError = extent * (8.0F * laneEps());
    }

    static float laneEps() { return std::numeric_limits<float>::epsilon(); }

    /// Box around center +- the given extents, grown by the error of points.
    void setBounds(const Double3& extent) {
        const Float3 grown = Float3(extent) + result_.pointError;
        result_.bounds.add(Float3(axes_.center) - grown);
        result_.bounds.add(Float3(axes_.center) + grown);
    }

    void normalizeBy(double size) {
        if (light_.normalize) {
            result_.radiance *= static_cast<float>(1.0 / size);
        }
    }

    bool refuseSize(const std::string& what) {
        refuse("It has no surface to emit from (" + what +
               "), so the light was left out. Give it "
               "a size and a scale above zero.");
        return false;
    }

    /// Unusable also where the area underflows in single precision.
    static bool isArea(double area) {
        return std::isfinite(area) && area > std::numeric_limits<float>::min();
    }

    template <template <class> class Shape>
    bool buildPlanar(double halfX, double halfY, const std::string& what) {
        scaleAxes(halfX, halfY, 0.0);
        if (!isArea(length(cross(axes_.x, axes_.y)))) {
            return refuseSize(what);
        }
        const Shape<double> shape(axes_.center, axes_.x, axes_.y, axes_.minusZ);
        result_.emitter = Shape<float>(shape);
        normalizeBy(shape.area());
        result_.power = kPiExact * shape.area() * brightness(result_.radiance);
        return true;
    }

    bool buildRect() {
        if (!buildPlanar<RectShape>(0.5 * std::abs(light_.width), 0.5 * std::abs(light_.height),
                                    "width, height or scale is zero")) {
            return false;
        }
        setBounds(abs(axes_.x) + abs(axes_.y));
        if (light_.hasTexture) {
            result_.texture = light_.image;
            result_.power *= textureMean(light_.image);
        }
        return true;
    }

    bool buildDisk() {
        const double radius = std::abs(light_.radius);
        if (!buildPlanar<DiskShape>(radius, radius, "radius or scale is zero")) {
            return false;
        }
        setBounds(rootSumSquares(axes_.x, axes_.y, Double3(0.0)));
        return true;
    }

    static Double3 rootSumSquares(const Double3& a, const Double3& b, const Double3& c) {
        const Double3 s = a * a + b * b + c * c;
        return {std::sqrt(s.x), std::sqrt(s.y), std::sqrt(s.z)};
    }

    bool buildSphere() {
        const double radius = std::abs(light_.radius);
        if (light_.treatAsPoint) {
            return buildPoint(radius);
        }
        scaleAxes(radius, radius, radius);
        const EllipsoidShape<double> shape(axes_.center, axes_.x, axes_.y, axes_.z);
        if (!isArea(shape.determinant)) {
            return refuseSize("radius is zero or the transform is singular");
        }
        const double area = ellipsoidArea(shape);
        result_.emitter = EllipsoidShape<float>(shape);
        normalizeBy(area);
        result_.power = kPiExact * area * brightness(result_.radiance);
        setBounds(rootSumSquares(axes_.x, axes_.y, axes_.z));
        return true;
    }

    bool buildPoint(double radius) {
        scaleAxes(radius, radius, radius);
        double quarterArea = 0.25; // normalize: the area cancels
        if (!light_.normalize) {
            const EllipsoidShape<double> shape(axes_.center, axes_.x, axes_.y, axes_.z);
            if (!isArea(shape.determinant)) {
                refuse("It is treated as a point without normalize and its radius or scale is "
                       "zero, so it has no intensity and was left out. Turn on normalize or give "
                       "it a radius.");
                return false;
            }
            quarterArea = 0.25 * ellipsoidArea(shape);
        }
        result_.emitter = PointEmitter{Float3(axes_.center)};
        result_.radiance *= static_cast<float>(quarterArea);
        result_.power = 4.0 * kPiExact * brightness(result_.radiance);
        return true;
    }

    bool buildCylinder() {
        const double radius = std::abs(light_.radius);
        const double half = 0.5 * std::abs(light_.length);
        const double tube = light_.treatAsLine ? kLineThickness * half : radius;
        scaleAxes(half, tube, tube);
        const CylinderShape<double> shape(axes_.center, axes_.x, axes_.y, axes_.z);
        if (!isArea(shape.determinant)) {
            return refuseSize("radius or length is zero or the transform is singular");
        }
        const double area = cylinderArea(shape);
        if (light_.treatAsLine && !light_.normalize) {
            if (!(radius > 0.0)) {
                refuse("It is treated as a line without normalize and its radius is zero, so it "
                       "has no power and was left out. Turn on normalize or give it a radius.");
                return false;
            }
            result_.radiance *= static_cast<float>(radius / tube);
        }
        result_.emitter = CylinderShape<float>(shape);
        normalizeBy(area);
        result_.power = kPiExact * area * brightness(result_.radiance);
        setBounds(abs(axes_.x) + rootSumSquares(axes_.y, axes_.z, Double3(0.0)));
        return true;
    }

    bool buildDistant() {
        if (!(length(light_.toWorld.z) > 0.0)) {
            refuse("Its transform flattens the z axis, so it has no direction and was left out. "
                   "Remove the scale of zero.");
            return false;
        }
        const double half = std::clamp(light_.angle * kPiExact / 360.0, 0.0, kPiExact);
        const double sin2 = std::sin(half) * std::sin(half);
        const Float3 axis(-axes_.minusZ);
        if (half < kMinDistantHalfAngle) {
            if (half > 0.0 && !light_.normalize) {
                result_.radiance *= static_cast<float>(kPiExact * sin2);
            }
            result_.emitter = DirectionEmitter{axis};
            result_.power = kPiExact * brightness(result_.radiance);
            return true;
        }
        const double size = half <= 0.5 * kPiExact ? kPiExact * sin2 : kPiExact * (2.0 - sin2);
        normalizeBy(size);
        const double s = std::sin(0.5 * half);
        result_.emitter = ConeShape<float>{axis, static_cast<float>(2.0 * s * s)};
        result_.power = kPiExact * 4.0 * kPiExact * s * s * brightness(result_.radiance);
        return true;
    }

    bool buildDome() {
        const double det = light_.toWorld.determinant();
        const double size = std::cbrt(std::abs(det));
        if (!(size > 0.0)) {
            refuse("Its transform is singular, so the dome has no orientation and was left out. "
                   "Remove the scale of zero.");
            return false;
        }
        DomeEmitter dome;
        if (light_.hasTexture && light_.image) {
            dome.map = EnvironmentMap(light_.image);
        }
        AffineD linear = light_.toWorld;
        linear.x = linear.x / size;
        linear.y = linear.y / size;
        linear.z = linear.z / size;
        linear.t = Double3(0.0);
        dome.toRender = linear.as<float>();
        dome.toLocal = linear.inverse().as<float>();
        const double mean = dome.map.mean();
        result_.emitter = std::move(dome);
        result_.power = kPiExact * 4.0 * kPiExact * mean * brightness(result_.radiance);
        return true;
    }

    const Light& light_;
    Diagnostics& diagnostics_;
    Axes axes_;
    PreparedLight result_;
};

} // namespace

Rgb PreparedLight::emitted(Float2 uv, const Float3& wi) const {
    Rgb result = radiance;
    if (shaping.isOn()) {
        result *= shaping.evaluate(-dot(wi, axis));
    }
    if (texture) {
        const Float4 c =
            texture->sample({0.5F - 0.5F * uv.x, 0.5F + 0.5F * uv.y}, Wrap::kClamp, Wrap::kClamp);
        result *= Rgb(max(c.x, 0.0F), max(c.y, 0.0F), max(c.z, 0.0F));
    }
    return result;
}

std::optional<PreparedLight> prepareLight(const Light& light, const Double3& origin,
                                          Diagnostics& diagnostics) {
    return Preparation(light, origin, diagnostics).run();
}

} // namespace mbfeat
