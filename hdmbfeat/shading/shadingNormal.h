// Shading normals that agree with the surface they are on.
#pragma once

#include "core/vec.h"

namespace mbfeat {

/// ns, bent towards ng no further than needed for two things: wo lies above the shading surface,
/// and wo mirrored about the result lies above the geometric one. Normal maps and interpolated
/// normals break both at grazing views, which shows as black spots.
///
/// Unit vectors; dot(wo, ng) >= 0, in any space. With n ~ ns + s ng, a = wo.ns, b = wo.ng and
/// c = ns.ng, the mirrored direction r has r.ng = 2 (a + s b)(c + s) / |n|^2 - b, and r.ng >= t is
/// a quadratic inequality in s. Its larger root is the least bend; from there on both factors are
/// positive, so that wo.n > 0 follows. The margin t is a tenth of b, which ng itself always meets.
///
/// Where ns points away from ng the sum cancels: its error of about 2e-7 turns the direction by
/// 2e-7 / |ns + s ng|, which has to stay well below the margin of the angle b. Else it is ng.
template <class T>
Vec3<T> visibleShadingNormal(const Vec3<T>& ns, const Vec3<T>& ng, const Vec3<T>& wo) {
    const T b = dot(wo, ng);
    const T margin = T(0.1F) * b;
    const T a = dot(wo, ns);
    const T c = dot(ns, ng);
    const T q2 = b - margin;
    const T q1 = a - c * margin;
    const T q0 = fma(T(2) * a, c, -(b + margin));
    const T root = safeSqrt(q1 * q1 - q2 * q0);
    const T tiny(1e-30F);
    // The larger root, from whichever form does not cancel.
    const T s = select(q1 > T(0), -q0 / max(q1 + root, tiny), (root - q1) / max(q2, tiny));
    const Vec3<T> bent = ns + ng * max(s, T(0));
    const T norm = lengthSquared(bent);
    constexpr float kLeastTurn = 5e-6F;
    const Mask<T> usable =
        b > T(0) && norm * (b * b) > T(kLeastTurn * kLeastTurn) && norm < T(1e12F);
    const Vec3<T> unit = select<T>(s > T(0), bent / sqrt(max(norm, T(1e-12F))), ns);
    return select<T>(usable, unit, ng);
}

} // namespace mbfeat
