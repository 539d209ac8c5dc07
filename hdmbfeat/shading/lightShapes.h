// The shapes of analytic lights: sampling from a receiving point, the density of that per solid
// angle, and intersection. Templates on the lane type.
//
// A shape is the image of a local one under any affine map with non-zero scale, so it is given by
// a centre and the images ex, ey, ez of the local unit vectors, radius and size multiplied in.
// Normals are unit and point to the side that emits. Only that side exists: rays that arrive from
// behind pass, and sampling gives density zero where the receiver sees none of it.
#pragma once

#include <limits>

#include "core/affine.h"
#include "core/frame.h"
#include "core/warp.h"

namespace mbfeat {

template <class T>
struct ShapeSample {
    Vec3<T> point{T(0)};
    Vec3<T> normal{T(0)};
    Vec2<T> uv{T(0), T(0)};       ///< local coordinates, in [-1, 1]^2 for rect and disk
    Vec3<T> wi{T(0), T(0), T(1)}; ///< unit, from the receiver
    T distance{T(0)};
    T pdf{T(0)}; ///< per solid angle at the receiver; 0: nothing to be seen
};

/// Density per solid angle at p of a density per area at `point`; 0 from behind.
template <class T>
T areaToSolidAngle(T pdfArea, const Vec3<T>& p, const Vec3<T>& point, const Vec3<T>& normal) {
    const Vec3<T> d = p - point;
    const T squared = lengthSquared(d);
    // cos = d.n / |d|, so squared / cos = |d|^3 / d.n.
    const T projected = dot(d, normal);
    const Mask<T> front = projected > T(0);
    return select(front, pdfArea * squared * sqrt(squared) / select(front, projected, T(1)), T(0));
}

/// Completes a sample whose point and normal are set, from its density per area.
template <class T>
void finishAreaSample(ShapeSample<T>& s, const Vec3<T>& p, T pdfArea) {
    const Vec3<T> d = s.point - p;
    s.distance = length(d);
    const Mask<T> apart = s.distance > T(0);
    s.wi = select(apart, d / select(apart, s.distance, T(1)), s.wi);
    s.pdf = areaToSolidAngle(pdfArea, p, s.point, s.normal);
}

/// Flat shapes: points center + ex a + ey b.
template <class T>
struct PlanarShape {
    Vec3<T> center, ex, ey;
    Vec3<T> normal;
    Vec3<T> dualX, dualY; ///< a = dot(dualX, q - center), b likewise
    T jacobian;           ///< |ex x ey|: area per unit of (a, b)

    /// `towards` says which side emits.
    PlanarShape(const Vec3<T>& c, const Vec3<T>& x, const Vec3<T>& y, const Vec3<T>& towards)
        : center(c),
          ex(x),
          ey(y) {
        const Vec3<T> n = cross(ex, ey);
        const T squared = lengthSquared(n);
        jacobian = sqrt(squared);
        dualX = cross(ey, n) / squared;
        dualY = cross(n, ex) / squared;
        normal = n * (copysign(T(1), dot(n, towards)) / jacobian);
    }

    /// From another precision: small lights are prepared in double, where squares do not underflow.
    template <class U>
    explicit PlanarShape(const PlanarShape<U>& o)
        : center(o.center),
          ex(o.ex),
          ey(o.ey),
          normal(o.normal),
          dualX(o.dualX),
          dualY(o.dualY),
          jacobian(static_cast<T>(o.jacobian)) {}

    Vec2<T> local(const Vec3<T>& q) const {
        const Vec3<T> d = q - center;
        return {dot(dualX, d), dot(dualY, d)};
    }

    /// Distance to the plane along the ray, met from the emitting side; -1 elsewhere.
    T intersectPlane(const Vec3<T>& origin, const Vec3<T>& direction) const {
        const T approach = dot(direction, normal);
        const Mask<T> facing = approach < T(0);
        const T t = dot(center - origin, normal) / select(facing, approach, T(1));
        return select(facing, t, T(-1));
    }
};

/// Rectangle (parallelogram after the map) with |a| <= 1, |b| <= 1.
template <class T>
struct RectShape : PlanarShape<T> {
    using PlanarShape<T>::PlanarShape;

    T area() const { return T(4) * this->jacobian; }

    ShapeSample<T> sample(const Vec3<T>& p, Vec2<T> u) const {
        ShapeSample<T> s;
        s.uv = {fma(T(2), u.x, T(-1)), fma(T(2), u.y, T(-1))};
        s.point = this->center + this->ex * s.uv.x + this->ey * s.uv.y;
        s.normal = this->normal;
        finishAreaSample(s, p, T(1) / area());
        return s;
    }

    T pdf(const Vec3<T>& p, const Vec3<T>& point) const {
        return areaToSolidAngle(T(1) / area(), p, point, this->normal);
    }

    T intersect(const Vec3<T>& origin, const Vec3<T>& direction, T tNear, T tFar) const {
        const T t = this->intersectPlane(origin, direction);
        const Vec2<T> q = this->local(origin + direction * t);
        const Mask<T> hit = (t >= tNear) & (t <= tFar) & (abs(q.x) <= T(1)) & (abs(q.y) <= T(1));
        return select(hit, t, T(-1));
    }
};

/// Disc (ellipse after the map) with a^2 + b^2 <= 1.
template <class T>
struct DiskShape : PlanarShape<T> {
    using PlanarShape<T>::PlanarShape;

    T area() const { return T(kPi) * this->jacobian; }

    ShapeSample<T> sample(const Vec3<T>& p, Vec2<T> u) const {
        ShapeSample<T> s;
        s.uv = concentricDisk(u);
        s.point = this->center + this->ex * s.uv.x + this->ey * s.uv.y;
        s.normal = this->normal;
        finishAreaSample(s, p, T(1) / area());
        return s;
    }

    T pdf(const Vec3<T>& p, const Vec3<T>& point) const {
        return areaToSolidAngle(T(1) / area(), p, point, this->normal);
    }

    T intersect(const Vec3<T>& origin, const Vec3<T>& direction, T tNear, T tFar) const {
        const T t = this->intersectPlane(origin, direction);
        const Vec2<T> q = this->local(origin + direction * t);
        const Mask<T> hit = (t >= tNear) & (t <= tFar) & (fma(q.x, q.x, q.y * q.y) <= T(1));
        return select(hit, t, T(-1));
    }
};

/// A linear map with its inverse and the map of normals, for the round shapes.
template <class T>
struct ShapeMap {
    Vec3<T> center, ex, ey, ez;
    Vec3<T> inverseX, inverseY, inverseZ; ///< rows of the inverse
    T determinant;                        ///< absolute value
    T sign;                               ///< -1 when the map mirrors

    ShapeMap(const Vec3<T>& c, const Vec3<T>& x, const Vec3<T>& y, const Vec3<T>& z)
        : center(c),
          ex(x),
          ey(y),
          ez(z) {
        const T det = dot(cross(ex, ey), ez);
        determinant = abs(det);
        sign = copysign(T(1), det);
        inverseX = cross(ey, ez) / det;
        inverseY = cross(ez, ex) / det;
        inverseZ = cross(ex, ey) / det;
    }

    template <class U>
    explicit ShapeMap(const ShapeMap<U>& o)
        : center(o.center),
          ex(o.ex),
          ey(o.ey),
          ez(o.ez),
          inverseX(o.inverseX),
          inverseY(o.inverseY),
          inverseZ(o.inverseZ),
          determinant(static_cast<T>(o.determinant)),
          sign(static_cast<T>(o.sign)) {}

    Vec3<T> vector(const Vec3<T>& v) const { return ex * v.x + ey * v.y + ez * v.z; }
    Vec3<T> point(const Vec3<T>& q) const { return center + vector(q); }
    Vec3<T> inverseVector(const Vec3<T>& v) const {
        return {dot(inverseX, v), dot(inverseY, v), dot(inverseZ, v)};
    }
    Vec3<T> inversePoint(const Vec3<T>& q) const { return inverseVector(q - center); }
    /// Cofactor matrix times n, on the outside whether or not the map mirrors. Its length is the
    /// ratio of surface areas at a place whose unit normal is n.
    Vec3<T> cofactor(const Vec3<T>& n) const {
        return (inverseX * n.x + inverseY * n.y + inverseZ * n.z) * determinant;
    }
};

/// Sphere (ellipsoid after the map): the image of the unit sphere; emits outwards.
///
/// From outside, directions are uniform in the cone that the unit sphere fills in local space. A
/// linear map M takes the direction w to Mw / |Mw| and solid angle by |det M| / |Mw|^3, which
/// gives the density in the world. With a uniform scale this is uniform over the visible cone.
/// From inside, where nothing is seen of the emitting side, points are uniform over the sphere and
/// the density is that of the inner side, for callers that want one.
template <class T>
struct EllipsoidShape : ShapeMap<T> {
    using ShapeMap<T>::ShapeMap;

    /// Cone of the unit sphere seen from local point pl outside it: 1 - cos of its half angle.
    static T coneOneMinusCos(T distanceSquared) {
        const T sin2 = T(1) / max(distanceSquared, T(1));
        return sin2 / (T(1) + safeSqrt(T(1) - sin2));
    }

    ShapeSample<T> sample(const Vec3<T>& p, Vec2<T> u) const {
        const Vec3<T> pl = this->inversePoint(p);
        const T d2 = lengthSquared(pl);
        const Mask<T> outside = d2 > T(1);
        const T d = sqrt(select(outside, d2, T(1)));

        const T oneMinusCosMax = coneOneMinusCos(d2);
        const Vec3<T> cone = uniformCone(u, oneMinusCosMax);
        const Vec3<T> axis = select(outside, pl / (-d), Vec3<T>(T(0), T(0), T(1)));
        // Where the direction first meets the sphere, in the frame of the axis: with b the line's
        // distance from the centre, the angles at the centre are asin(b) minus that at the
        // receiver. The receiver plus the way along the line would cancel from afar.
        const T sin2 = fma(cone.x, cone.x, cone.y * cone.y);
        const T half = safeSqrt(T(1) - d2 * sin2);
        const T t = d * cone.z - half;
        const Frame<T> frame = Frame<T>::fromNormal(axis);
        const Vec3<T> wl = frame.toWorld(cone);
        const Vec3<T> onSphere =
            normalize(frame.toWorld({cone.x * t, cone.y * t, -fma(d, sin2, cone.z * half)}));

        const Vec3<T> q = select(outside, onSphere, uniformSphere(u));
        const Vec3<T> cofactor = this->cofactor(q);
        const T stretch = length(cofactor);
        ShapeSample<T> s;
        s.point = this->point(q);
        s.normal = cofactor / stretch;
        s.uv = u;
        finishAreaSample(s, p, T(1));
        const Vec3<T> w = this->vector(wl);
        const T lw = length(w);
        const T fromOutside = uniformConePdf(oneMinusCosMax) * lw * lw * lw / this->determinant;
        const T innerArea = T(1) / (T(4 * kPi) * stretch);
        const T fromInside = areaToSolidAngle(innerArea, p, s.point, -s.normal);
        s.pdf = select(outside, fromOutside, fromInside);
        // The direction is that of the cone: from afar, the difference of points is less exact.
        s.wi = select(outside, w / lw, s.wi);
        return s;
    }

    /// Density of the point on the shape that the unit direction wi meets from p.
    T pdf(const Vec3<T>& p, const Vec3<T>& wi, const Vec3<T>& point) const {
        const T d2 = lengthSquared(this->inversePoint(p));
        const T lw = length(this->inverseVector(wi));
        const T fromOutside =
            uniformConePdf(coneOneMinusCos(d2)) / (lw * lw * lw * this->determinant);
        const Vec3<T> ql = this->inversePoint(point);
        const Vec3<T> cofactor = this->cofactor(normalize(ql));
        const T stretch = length(cofactor);
        const T fromInside =
            areaToSolidAngle(T(1) / (T(4 * kPi) * stretch), p, point, cofactor / (-stretch));
        return select(d2 > T(1), fromOutside, fromInside);
    }

    Vec3<T> normalAt(const Vec3<T>& point) const {
        return normalize(this->cofactor(this->inversePoint(point)));
    }

    T intersect(const Vec3<T>& origin, const Vec3<T>& direction, T tNear, T tFar) const {
        const Vec3<T> o = this->inversePoint(origin);
        const Vec3<T> v = this->inverseVector(direction);
        const T a = lengthSquared(v);
        const T middle = -dot(o, v) / a;
        // Squared distance of the line from the centre, without cancellation (Haines et al. 2019,
        // "Precision Improvements for Ray/Sphere Intersection").
        const T miss = lengthSquared(o + v * middle);
        const T half = safeSqrt((T(1) - miss) / a);
        // The nearer root as product over the farther one where the difference would cancel.
        const T c = lengthSquared(o) - T(1);
        const T farther = middle + half;
        const T t = c / (a * select(farther > T(0), farther, T(1)));
        const Mask<T> hit =
            (miss <= T(1)) & (c > T(0)) & (middle > T(0)) & (t >= tNear) & (t <= tFar);
        return select(hit, t, T(-1));
    }
};

/// Cylinder along local x in [-1, 1] with unit radius, without caps; emits outwards.
///
/// In the local cross-section, directions are uniform in the angle 2 a that the circle fills as
/// seen from outside, and along the axis the point is equiangular (Kulla and Fajardo 2012, section
/// 4.1) with the axis stretched by k to the proportions of the world. The factor of the
/// cross-section's foreshortening is in the area density and in the cosine alike, so it cancels
/// and nothing is singular at the silhouette:
///     pdf = d^3 / (2 a r^2 |det M|) p(x),   p(x) = k r / (D (r^2 + k^2 (x - x_p)^2)),
/// with d the distance in the world, r the local distance in the cross-section and D the angle of
/// the whole length. From inside nothing is seen of the emitting side and the density is zero.
template <class T>
struct CylinderShape : ShapeMap<T> {
    using ShapeMap<T>::ShapeMap;

    /// Stretch of the axis against the mean radius.
    T proportion() const { return T(2) * length(this->ex) / (length(this->ey) + length(this->ez)); }

    /// Angle that the stretched axis fills, seen from cross-section distance r at axis position x.
    static T axisAngle(T r, T x, T k) {
        return atan2(T(2) * k * r, fma(r, r, k * k * (T(1) - x) * (T(-1) - x)));
    }

    /// Density at local point q on the surface, for a receiver at local pl outside and a world
    /// distance d.
    T density(const Vec3<T>& pl, const Vec3<T>& q, T d) const {
        const T d2 = fma(pl.y, pl.y, pl.z * pl.z);
        const T halfAngle = asin(T(1) / sqrt(max(d2, T(1))));
        const T dy = pl.y - q.y, dz = pl.z - q.z;
        const T r2 = fma(dy, dy, dz * dz);
        const T r = sqrt(r2);
        const T k = proportion();
        const T dx = k * (q.x - pl.x);
        const T along = k * r / (axisAngle(r, pl.x, k) * fma(dx, dx, r2));
        const T pdf = d * d * d * along / (T(2) * halfAngle * r2 * this->determinant);
        return select((d2 > T(1)) & (r2 > T(0)), pdf, T(0));
    }

    ShapeSample<T> sample(const Vec3<T>& p, Vec2<T> u) const {
        const Vec3<T> pl = this->inversePoint(p);
        const T d2 = max(fma(pl.y, pl.y, pl.z * pl.z), T(1));
        const T d = sqrt(d2);
        // A ray of the fan in the cross-section, and where it first meets the circle.
        const T angle = fma(T(2), u.x, T(-1)) * asin(T(1) / d);
        const T c = cos(angle), s = sin(angle);
        const T ay = pl.y / (-d), az = pl.z / (-d);
        // As for the sphere: along the axis to the centre and across it, without the receiver.
        const T half = safeSqrt(T(1) - d2 * s * s);
        const T t = d * c - half;
        const T along = -fma(d, s * s, c * half), across = s * t;
        const T y = ay * along - az * across, z = fma(ay, across, az * along);
        const T radius = sqrt(fma(y, y, z * z));
        // Equiangular along the axis.
        const T k = proportion();
        const T r = max(t, T(std::numeric_limits<Scalar<T>>::min()));
        const T theta = fma(u.y, axisAngle(r, pl.x, k), atan2(k * (T(-1) - pl.x), r));
        const T x = clamp(fma(r / k, tan(theta), pl.x), T(-1), T(1));

        ShapeSample<T> result;
        const Vec3<T> q{x, y / radius, z / radius};
        result.point = this->point(q);
        result.normal = normalize(this->cofactor({T(0), q.y, q.z}));
        result.uv = {x, angle};
        finishAreaSample(result, p, T(1));
        const T pdf = density(pl, q, result.distance);
        // A point that is not seen after rounding is none, and has no direction either.
        result.pdf = select(dot(result.normal, result.wi) < T(0), pdf, T(0));
        return result;
    }

    T pdf(const Vec3<T>& p, const Vec3<T>& point) const {
        return density(this->inversePoint(p), this->inversePoint(point), length(point - p));
    }

    Vec3<T> normalAt(const Vec3<T>& point) const {
        const Vec3<T> q = this->inversePoint(point);
        return normalize(this->cofactor({T(0), q.y, q.z}));
    }

    T intersect(const Vec3<T>& origin, const Vec3<T>& direction, T tNear, T tFar) const {
        const Vec3<T> o = this->inversePoint(origin);
        const Vec3<T> v = this->inverseVector(direction);
        const T a = fma(v.y, v.y, v.z * v.z);
        const Mask<T> crosses = a > T(0);
        const T safeA = select(crosses, a, T(1));
        const T middle = -fma(o.y, v.y, o.z * v.z) / safeA;
        const T my = fma(v.y, middle, o.y), mz = fma(v.z, middle, o.z);
        const T miss = fma(my, my, mz * mz);
        const T half = safeSqrt((T(1) - miss) / safeA);
        const T c = fma(o.y, o.y, o.z * o.z) - T(1);
        const T farther = middle + half;
        const T t = c / (safeA * select(farther > T(0), farther, T(1)));
        const Mask<T> hit = crosses & (miss <= T(1)) & (c > T(0)) & (middle > T(0)) & (t >= tNear) &
                            (t <= tFar) & (abs(fma(v.x, t, o.x)) <= T(1));
        return select(hit, t, T(-1));
    }
};

/// Triangle, uniform by area. uv holds the weights of corners 1 and 2.
template <class T>
struct TriangleShape {
    Vec3<T> p0, p1, p2;
    Mask<T> doubleSided;

    Vec3<T> areaVector() const { return cross(p1 - p0, p2 - p0) * T(0.5F); }
    T area() const { return length(areaVector()); }

    /// The unit normal on the side of p, or of the front where the triangle has one side.
    Vec3<T> normalTowards(const Vec3<T>& p) const {
        const Vec3<T> n = normalize(areaVector());
        const Mask<T> flip = doubleSided & (dot(p - p0, n) < T(0));
        return select(flip, -n, n);
    }

    ShapeSample<T> sample(const Vec3<T>& p, Vec2<T> u) const {
        ShapeSample<T> s;
        s.uv = uniformTriangle(u);
        s.point = p0 + (p1 - p0) * s.uv.x + (p2 - p0) * s.uv.y;
        s.normal = normalTowards(p);
        finishAreaSample(s, p, T(1) / area());
        return s;
    }

    T pdf(const Vec3<T>& p, const Vec3<T>& point) const {
        return areaToSolidAngle(T(1) / area(), p, point, normalTowards(p));
    }
};

/// Directions within an angle of an axis, for distant lights.
template <class T>
struct ConeShape {
    Vec3<T> axis;     ///< unit, towards the light
    T oneMinusCosMax; ///< 0 < ... <= 2

    Vec3<T> sample(Vec2<T> u) const {
        return Frame<T>::fromNormal(axis).toWorld(uniformCone(u, oneMinusCosMax));
    }
    /// 0 outside the cone. 1 - cos of the angle is |wi - axis|^2 / 2, exact for narrow cones.
    T pdf(const Vec3<T>& wi) const {
        const Mask<T> inside = lengthSquared(wi - axis) * T(0.5F) <= oneMinusCosMax;
        return select(inside, uniformConePdf(oneMinusCosMax), T(0));
    }
};

} // namespace mbfeat
