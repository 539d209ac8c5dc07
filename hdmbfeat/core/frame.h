// Orthonormal shading frame: local z is the normal, so cos(theta) of a local direction is its z.
#pragma once

#include "core/vec.h"

namespace mbfeat {

template <class T>
struct Frame {
    Vec3<T> s, t, n;

    /// A frame around the unit vector n without branches (Duff et al. 2017, "Building an
    /// Orthonormal Basis, Revisited").
    static Frame fromNormal(const Vec3<T>& n) {
        const T sign = copysign(T(1), n.z);
        const T a = T(-1) / (sign + n.z);
        const T b = n.x * n.y * a;
        return {{T(1) + sign * n.x * n.x * a, sign * b, -sign * n.x},
                {b, sign + n.y * n.y * a, -n.y},
                n};
    }

    Vec3<T> toLocal(const Vec3<T>& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
    Vec3<T> toWorld(const Vec3<T>& v) const { return s * v.x + t * v.y + n * v.z; }
};

} // namespace mbfeat
