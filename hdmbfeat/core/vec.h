// Small vectors over a lane type (core/lane.h). Colours are linear RGB in the rendering space.
#pragma once

#include "core/lane.h"

namespace mbfeat {

template <class T>
struct Vec2 {
    T x{}, y{};
    Vec2() = default;
    constexpr Vec2(T x_, T y_) : x(x_), y(y_) {}
    explicit constexpr Vec2(T s) : x(s), y(s) {}
};

template <class T>
struct Vec3 {
    T x{}, y{}, z{};
    Vec3() = default;
    constexpr Vec3(T x_, T y_, T z_) : x(x_), y(y_), z(z_) {}
    explicit constexpr Vec3(T s) : x(s), y(s), z(s) {}
    template <class U>
    explicit constexpr Vec3(const Vec3<U>& v)
        : x(static_cast<T>(v.x)),
          y(static_cast<T>(v.y)),
          z(static_cast<T>(v.z)) {}

    // The axis is uniform over lanes, so plain indexing is well defined.
    const T& operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
    T& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
};

template <class T>
struct Vec4 {
    T x{}, y{}, z{}, w{};
    Vec4() = default;
    constexpr Vec4(T x_, T y_, T z_, T w_) : x(x_), y(y_), z(z_), w(w_) {}
};

template <class T>
constexpr Vec2<T> operator+(Vec2<T> a, Vec2<T> b) {
    return {a.x + b.x, a.y + b.y};
}
template <class T>
constexpr Vec2<T> operator-(Vec2<T> a, Vec2<T> b) {
    return {a.x - b.x, a.y - b.y};
}
template <class T>
constexpr Vec2<T> operator*(Vec2<T> a, T s) {
    return {a.x * s, a.y * s};
}

template <class T>
constexpr Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
constexpr Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
Vec3<T> operator-(const Vec3<T>& a) {
    return {negate(a.x), negate(a.y), negate(a.z)};
}
template <class T>
constexpr Vec3<T> operator*(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}
template <class T>
constexpr Vec3<T> operator*(const Vec3<T>& a, std::common_type_t<T> s) {
    return {a.x * s, a.y * s, a.z * s};
}
template <class T>
constexpr Vec3<T> operator*(std::common_type_t<T> s, const Vec3<T>& a) {
    return a * s;
}
template <class T>
constexpr Vec3<T> operator/(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x / b.x, a.y / b.y, a.z / b.z};
}
template <class T>
constexpr Vec3<T> operator/(const Vec3<T>& a, std::common_type_t<T> s) {
    return {a.x / s, a.y / s, a.z / s};
}
template <class T>
Vec3<T>& operator+=(Vec3<T>& a, const Vec3<T>& b) {
    return a = a + b;
}
template <class T>
Vec3<T>& operator*=(Vec3<T>& a, const Vec3<T>& b) {
    return a = a * b;
}
template <class T>
Vec3<T>& operator*=(Vec3<T>& a, std::common_type_t<T> s) {
    return a = a * s;
}
template <class T>
constexpr bool operator==(const Vec3<T>& a, const Vec3<T>& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

template <class T>
T dot(const Vec3<T>& a, const Vec3<T>& b) {
    return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

/// a*b - c*d with one rounding error of the exact result (Kahan's difference of products,
/// Jeannerod, Louvet and Muller 2013).
template <class T>
T differenceOfProducts(T a, T b, T c, T d) {
    const T cd = c * d;
    const T difference = fma(a, b, -cd);
    const T error = fma(-c, d, cd);
    return difference + error;
}

template <class T>
Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
    return {differenceOfProducts(a.y, b.z, a.z, b.y), differenceOfProducts(a.z, b.x, a.x, b.z),
            differenceOfProducts(a.x, b.y, a.y, b.x)};
}

template <class T>
T lengthSquared(const Vec3<T>& a) {
    return dot(a, a);
}
template <class T>
T length(const Vec3<T>& a) {
    return sqrt(lengthSquared(a));
}

/// The unit vector along a. Undefined (not finite) for a zero vector: callers check.
template <class T>
Vec3<T> normalize(const Vec3<T>& a) {
    return a / length(a);
}

template <class T>
Vec3<T> abs(const Vec3<T>& a) {
    return {abs(a.x), abs(a.y), abs(a.z)};
}
template <class T>
T maxComponent(const Vec3<T>& a) {
    return max(a.x, max(a.y, a.z));
}
template <class T>
Vec3<T> select(const Mask<T>& m, const Vec3<T>& a, const Vec3<T>& b) {
    return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}
template <class T>
Vec3<T> lerp(T t, const Vec3<T>& a, const Vec3<T>& b) {
    return {lerp(t, a.x, b.x), lerp(t, a.y, b.y), lerp(t, a.z, b.z)};
}

/// Luminance of linear Rec.709 RGB (ITU-R BT.709). Used for choices and statistics only, so it is
/// also used when the rendering space has other primaries.
template <class T>
T luminance(const Vec3<T>& c) {
    return T(0.2126F) * c.x + T(0.7152F) * c.y + T(0.0722F) * c.z;
}

using Float2 = Vec2<float>;
using Float3 = Vec3<float>;
using Float4 = Vec4<float>;
using Double3 = Vec3<double>;
/// Linear RGB in the rendering colour space.
using Rgb = Vec3<float>;

inline bool isFinite(const Float3& a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
inline bool isBlack(const Rgb& c) {
    return c.x == 0.0F && c.y == 0.0F && c.z == 0.0F;
}

} // namespace mbfeat
