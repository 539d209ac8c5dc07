// Axis-aligned boxes.
#pragma once

#include <limits>

#include "core/vec.h"

namespace mbfeat {

/// Empty until something is added: lower is above upper then.
struct Bounds {
    Float3 lower{std::numeric_limits<float>::max()};
    Float3 upper{-std::numeric_limits<float>::max()};

    bool empty() const { return lower.x > upper.x || lower.y > upper.y || lower.z > upper.z; }
    void add(const Float3& p) {
        lower = {min(lower.x, p.x), min(lower.y, p.y), min(lower.z, p.z)};
        upper = {max(upper.x, p.x), max(upper.y, p.y), max(upper.z, p.z)};
    }
    void add(const Bounds& b) {
        if (!b.empty()) {
            add(b.lower);
            add(b.upper);
        }
    }
    Float3 center() const { return (lower + upper) * 0.5F; }
    /// Radius of the sphere around center() that holds the box; 0 when empty.
    float radius() const { return empty() ? 0.0F : length(upper - lower) * 0.5F; }
};

} // namespace mbfeat
