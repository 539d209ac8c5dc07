// Pixel reconstruction filters, sampled by importance: a sample belongs to one pixel only and its
// offset from the pixel centre is distributed as |filter|.
#pragma once

#include <cstdint>
#include <vector>

#include "core/settings.h"
#include "core/vec.h"

namespace mbfeat {

struct FilterSample {
    Float2 offset{0.0F, 0.0F}; ///< from the pixel centre, pixels
    float weight = 1.0F;       ///< 1, or the sign times a constant where the filter is negative
};

class FilterSampler {
public:
    FilterSampler(PixelFilter filter, float width);
    FilterSample sample(Float2 u) const;
    /// Density of sample().offset, 1/pixel^2; 0 outside the support.
    float pdf(Float2 offset) const;
    /// The filter's value, normalised so that it integrates to 1.
    float evaluate(Float2 offset) const;
    float radius() const { return radius_; }

private:
    PixelFilter filter_;
    float radius_;
    /// Position in [-1, 1] at which the distribution function is u.
    float invert(float u) const;

    std::vector<float> cdf_, density_; ///< one-dimensional; the filters are separable
    /// Where the search in cdf_ starts: the first entry above k / size, for each k.
    std::vector<std::uint16_t> guide_;
    float normalisation_ = 1.0F;
    bool hasNegative_ = false; ///< the filter has negative lobes
};

} // namespace mbfeat
