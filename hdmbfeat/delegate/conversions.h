// OpenUSD's vectors and matrices as the core's.
#pragma once

#include <cmath>

#include "pxr/pxr.h"

#include "core/affine.h"
#include "core/vec.h"
#include "pxr/base/gf/matrix4d.h"
#include "pxr/base/gf/vec2f.h"
#include "pxr/base/gf/vec3d.h"
#include "pxr/base/gf/vec3f.h"
#include "pxr/base/gf/vec4f.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

inline Float2 toFloat2(const GfVec2f& v) {
    return {v[0], v[1]};
}

inline Float3 toFloat3(const GfVec3f& v) {
    return {v[0], v[1], v[2]};
}

inline Float4 toFloat4(const GfVec4f& v) {
    return {v[0], v[1], v[2], v[3]};
}

/// Drops the projective column, which transforms of prims do not use.
inline AffineD toAffine(const GfMatrix4d& m) {
    AffineD a;
    a.x = {m[0][0], m[0][1], m[0][2]};
    a.y = {m[1][0], m[1][1], m[1][2]};
    a.z = {m[2][0], m[2][1], m[2][2]};
    a.t = {m[3][0], m[3][1], m[3][2]};
    return a;
}

inline bool isFinite(const Double3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

inline bool isFinite(const AffineD& a) {
    return isFinite(a.x) && isFinite(a.y) && isFinite(a.z) && isFinite(a.t);
}

} // namespace mbfeat
