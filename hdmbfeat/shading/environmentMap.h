// Latitude-longitude images as distributions over directions, for dome lights.
//
// Orientation (UsdLuxDomeLight_1 and the OpenEXR convention it refers to): the top of the image is
// +y, its centre column +z, and the left half shows +x: latitude = pi (t - 1/2) and longitude =
// pi (1 - 2 s) for texture coordinates (s, t) from the bottom left, and
// direction = (sin lon cos lat, sin lat, cos lon cos lat).
#pragma once

#include <memory>
#include <vector>

#include "core/distribution.h"
#include "core/vec.h"
#include "scene/texture.h"

namespace mbfeat {

/// Texture coordinates of a unit direction, in [0, 1].
Float2 latLongFromDirection(const Float3& d);

/// An image around the origin. Directions are sampled with a density that is constant on the
/// cells of a grid (the texels, or blocks of them in large images) and proportional there to the
/// mean of the bilinearly filtered image.
class EnvironmentMap {
public:
    /// Without an image: 1 in every direction, sampled uniformly.
    EnvironmentMap() = default;
    explicit EnvironmentMap(std::shared_ptr<const Image> image);

    bool isUniform() const { return image_ == nullptr; }

    /// Radiance from the unit direction d; never negative.
    Rgb value(const Float3& d) const;

    struct Sample {
        Float3 direction{0.0F, 0.0F, 1.0F};
        float pdf = 0.0F; ///< per solid angle
    };
    Sample sample(Float2 u) const;
    float pdf(const Float3& d) const;

    /// Mean of (r + g + b) / 3 over the sphere.
    double mean() const { return mean_; }

private:
    bool isUpper(int row) const { return 2 * row >= grid_.height(); }
    float cellSolidAngle(int row) const { return solidAngles_[static_cast<std::size_t>(row)]; }

    std::shared_ptr<const Image> image_;
    PiecewiseConstant2D grid_;
    std::vector<float> solidAngles_; ///< of a cell, by row
    /// 1 - sin(lat) in the upper half and 1 + sin(lat) in the lower, at the lower and the upper
    /// edge of each row: unlike sin(lat) they keep their precision at the poles.
    std::vector<Float2> edges_;
    double mean_ = 1.0;
};

} // namespace mbfeat
