// Triangulation of one polygon. Private to the mesh builder.
#pragma once

#include <array>

#include "core/vec.h"

namespace mbfeat {

/// Twice the area of the triangle as a vector along its normal, in double: no float triangle of
/// any size overflows or vanishes.
inline Double3 areaVector(const Float3& a, const Float3& b, const Float3& c) {
    const Double3 o(a);
    return cross(Double3(b) - o, Double3(c) - o);
}

/// The two triangles of a quadrilateral as indices into it: cut along the diagonal from corner 0,
/// unless the quadrilateral is concave there.
inline std::array<std::array<int, 3>, 2> splitQuad(const Float3& a, const Float3& b,
                                                   const Float3& c, const Float3& d) {
    const double first = dot(areaVector(a, b, c), areaVector(a, c, d));
    if (first < 0.0 && dot(areaVector(b, c, d), areaVector(b, d, a)) > first) {
        return {{{1, 2, 3}, {1, 3, 0}}};
    }
    return {{{0, 1, 2}, {0, 2, 3}}};
}

} // namespace mbfeat
