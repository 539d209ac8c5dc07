// Affine transforms. A point p maps to x*p.x + y*p.y + z*p.z + t, so the members are the rows of
// a USD (row-vector) matrix: x = row 0, y = row 1, z = row 2, t = row 3.
#pragma once

#include "core/vec.h"

namespace mbfeat {

template <class T>
struct Affine {
    Vec3<T> x{T(1), T(0), T(0)};
    Vec3<T> y{T(0), T(1), T(0)};
    Vec3<T> z{T(0), T(0), T(1)};
    Vec3<T> t{T(0), T(0), T(0)};

    Vec3<T> point(const Vec3<T>& p) const { return x * p.x + y * p.y + z * p.z + t; }
    Vec3<T> vector(const Vec3<T>& v) const { return x * v.x + y * v.y + z * v.z; }

    /// Determinant of the linear part; negative when the transform mirrors.
    T determinant() const { return dot(cross(x, y), z); }

    /// n transformed by the cofactor matrix, which keeps it perpendicular to transformed tangents.
    /// Not normalised; the direction is flipped by mirroring exactly as the geometric normal is.
    Vec3<T> normal(const Vec3<T>& n) const {
        return cross(y, z) * n.x + cross(z, x) * n.y + cross(x, y) * n.z;
    }

    /// The inverse. The caller has checked that determinant() is not zero.
    Affine inverse() const {
        const T invDet = T(1) / determinant();
        const Vec3<T> a = cross(y, z) * invDet;
        const Vec3<T> b = cross(z, x) * invDet;
        const Vec3<T> c = cross(x, y) * invDet;
        Affine r;
        r.x = {a.x, b.x, c.x};
        r.y = {a.y, b.y, c.y};
        r.z = {a.z, b.z, c.z};
        r.t = -r.vector(t);
        return r;
    }

    template <class U>
    Affine<U> as() const {
        Affine<U> r;
        r.x = Vec3<U>(x);
        r.y = Vec3<U>(y);
        r.z = Vec3<U>(z);
        r.t = Vec3<U>(t);
        return r;
    }
};

/// The transform that applies `first`, then `second`.
template <class T>
Affine<T> concatenate(const Affine<T>& first, const Affine<T>& second) {
    Affine<T> r;
    r.x = second.vector(first.x);
    r.y = second.vector(first.y);
    r.z = second.vector(first.z);
    r.t = second.point(first.t);
    return r;
}

using AffineF = Affine<float>;
using AffineD = Affine<double>;

} // namespace mbfeat
