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
#include "core/frame.h"
#include "core/vec.h"
#include "core/warp.h"
#include "scene/texture.h"
#include "scene/textureLanes.h"
#include "shading/environmentSides.h"

namespace mbfeat {

/// The angle of (x, y) from the x axis in turns, -1/2 to 1/2, to 4e-8 of a turn and, where it is
/// below an eighth, to 4 ulp of itself; 0 where both are. Float and SIMD lanes get the same bits,
/// which the C library's function would not give; doubles get the library's. Reduced to a
/// sixteenth of a turn about an axis or a diagonal; the polynomial is minimax for the relative
/// error there (2e-8), by Remez' exchange.
template <class T>
T angleInTurns(const T& y, const T& x) {
    if constexpr (std::is_same_v<T, double>) {
        return std::atan2(y, x) * 0.159154943091895335769;
    } else {
        const T ax = abs(x), ay = abs(y);
        const T smaller = min(ax, ay), larger = max(ax, ay);
        const Mask<T> diagonal = smaller > larger * T(0.41421356F); // tan(pi / 8)
        const T above = select(diagonal, smaller - larger, smaller);
        const T below = select(diagonal, smaller + larger, larger);
        const T t = above / select(below > T(0), below, T(1));
        const T z = t * t;
        const T tail =
            fma(z, fma(z, fma(z, T(1.271128654e-2F), T(-2.204628289e-2F)), T(3.179035708e-2F)),
                T(-5.305079743e-2F));
        const T octant =
            fma(t * z, tail, t * T(1.591549367e-1F)) + select(diagonal, T(0.125F), T(0));
        const T quarter = select(ay > ax, T(0.25F) - octant, octant);
        const T half = select(x < T(0), T(0.5F) - quarter, quarter);
        return select(y < T(0), negate(half), half);
    }
}

/// Texture coordinates of a unit direction, in [0, 1].
template <class T>
Vec2<T> latLongFromDirection(const Vec3<T>& d) {
    const T longitude = angleInTurns(d.x, d.z);
    const T latitude = angleInTurns(d.y, sqrt(d.x * d.x + d.z * d.z));
    return {T(0.5F) - longitude, T(0.5F) + T(2) * latitude};
}

/// An image around the origin. Directions are sampled for a surface that faces some way: first one
/// of up to 128 parts of the image by the irradiance that it gives there (EnvironmentSides), then
/// within it with a density that is constant on the cells of a grid (the texels, or about as many,
/// or blocks of them in large images) and proportional there to the mean of the bilinearly filtered
/// image. Templates on the lane type, which give the same bits for all but double.
class EnvironmentMap {
public:
    /// Without an image: 1 in every direction, sampled by the cosine, and for surfaces that are lit
    /// from both sides uniformly.
    EnvironmentMap() = default;
    explicit EnvironmentMap(std::shared_ptr<const Image> image);

    bool isUniform() const { return image_ == nullptr; }

    /// What is to be seen along unit directions.
    template <class T>
    struct Seen {
        Vec3<T> value; ///< radiance, never negative
        T pdf;         ///< of sampling the direction for the surface, per solid angle
    };
    template <class T>
    Seen<T> look(const Vec3<T>& d, const Facing<T>& to = {}) const {
        if (!image_) {
            return {Vec3<T>(T(1)), evenPdf(d, to)};
        }
        const Vec2<T> st = latLongFromDirection(d);
        return {texels(st), pdfAt(st, to)};
    }
    Rgb value(const Float3& d) const { return look(d).value; }
    float pdf(const Float3& d, const Facing<float>& to = {}) const { return look(d, to).pdf; }

    template <class T>
    struct LaneSample {
        Vec3<T> direction{T(0), T(0), T(1)};
        T pdf{T(0)};         ///< per solid angle
        Vec3<T> value{T(0)}; ///< radiance
    };
    using Sample = LaneSample<float>;
    Sample sample(Float2 u, const Facing<float>& to = {}) const { return sample<float>(u, to); }
    template <class T>
    LaneSample<T> sample(const Vec2<T>& u, const Facing<T>& to = {}) const {
        if (!image_) {
            const Vec3<T> above = Frame<T>::fromNormal(to.n).toWorld(cosineHemisphere(u));
            const Vec3<T> d = select<T>(to.twoSided, uniformSphere(u), above);
            return {d, evenPdf(d, to), Vec3<T>(T(1))};
        }
        const auto part = sides_.sample<T>(to, u);
        const auto cell = grid_.sample<T>(part.fraction, part.y * IntLane<T>(columns_) + part.x);
        const IntLane<T> x = part.x * IntLane<T>(grid_.width()) + cell.x;
        const IntLane<T> y = part.y * IntLane<T>(grid_.height()) + cell.y;
        // Uniform in sin(lat) within the row, so the density is constant over the cell.
        const IntLane<T> edges = y + y;
        const T h = lerp(cell.fraction.y, gatherLanes<T>(edges_.data(), edges),
                         gatherLanes<T>(edges_.data() + 1, edges));
        const T cosLat = safeSqrt(h * (T(2) - h));
        const Mask<T> upper = toFloat(edges) >= T(static_cast<float>(height()));
        const T sinLat = select(upper, T(1) - h, h - T(1));
        const T s = (toFloat(x) + cell.fraction.x) / T(static_cast<float>(width()));
        T sine, cosine;
        sinCosTurns(T(0.5F) - s, sine, cosine);
        // The image where the direction was chosen: looked up by the direction, which is rounded,
        // it would be that of the neighbour at the edges of cells.
        const Vec2<T> st{s, T(0.5F) + T(2) * angleInTurns(sinLat, cosLat)};
        return {{sine * cosLat, sinLat, cosine * cosLat},
                part.probability * cell.probability / gatherLanes<T>(solidAngles_.data(), y),
                texels(st)};
    }

    /// Mean of (r + g + b) / 3 over the sphere.
    double mean() const { return mean_; }
    /// What of the light comes from directions so bright that scattering by the cosine, whose
    /// density is 1 / pi at most, would take too few samples there: the integral of what the
    /// density of sampling by radiance has above that. 0 for a clear sky, near 1 for a sun.
    double concentration() const { return concentration_; }

private:
    template <class T>
    Vec3<T> texels(const Vec2<T>& st) const {
        const auto positive = [](const auto& c) {
            using L = std::decay_t<decltype(c.x)>;
            return Vec3<L>(max(c.x, L(0)), max(c.y, L(0)), max(c.z, L(0)));
        };
        if constexpr (kIsBatch<T>) {
            if (image_->hasLanes()) {
                return positive(sampleTexture<T>(*image_, st, Wrap::kRepeat, Wrap::kClamp));
            }
            const LaneBuffer<T> s(st.x), t(st.y);
            LaneBuffer3<T> result;
            for (int i = 0; i < LaneTraits<T>::kWidth; ++i) {
                result.set(i, positive(image_->sample({s[i], t[i]}, Wrap::kRepeat, Wrap::kClamp)));
            }
            return result.lanes();
        } else {
            return positive(image_->sample(st, Wrap::kRepeat, Wrap::kClamp));
        }
    }

    /// Of directions where there is no image.
    template <class T>
    static T evenPdf(const Vec3<T>& d, const Facing<T>& to) {
        return select(to.twoSided, uniformSpherePdf<T>(), cosineHemispherePdf(dot(d, to.n)));
    }

    template <class T>
    T pdfAt(const Vec2<T>& st, const Facing<T>& to) const {
        const auto cell = [](const T& coordinate, int size) {
            const IntLane<T> at = toInteger(coordinate * T(static_cast<float>(size)));
            return min(max(at, IntLane<T>(0)), IntLane<T>(size - 1));
        };
        const IntLane<T> x = cell(st.x, width()), y = cell(st.y, height());
        const IntLane<T> column = quotient<T>(x, grid_.width());
        const IntLane<T> row = quotient<T>(y, grid_.height());
        return sides_.probability<T>(to, column, row) *
               grid_.probability<T>(x - column * IntLane<T>(grid_.width()),
                                    y - row * IntLane<T>(grid_.height()),
                                    row * IntLane<T>(columns_) + column) /
               gatherLanes<T>(solidAngles_.data(), y);
    }

    /// a / b, rounded down, of numbers from 0 to 2048.
    template <class T>
    static IntLane<T> quotient(const IntLane<T>& a, int b) {
        return toInteger((toFloat(a) + T(0.5F)) / T(static_cast<float>(b)));
    }

    /// Of the grid as a whole.
    int width() const { return columns_ * grid_.width(); }
    int height() const { return rows_ * grid_.height(); }

    std::shared_ptr<const Image> image_;
    int columns_ = 1, rows_ = 1; ///< parts
    EnvironmentSides sides_;
    PiecewiseConstant2D grid_;       ///< of a part, a layer each
    std::vector<float> solidAngles_; ///< of a cell, by row
    /// 1 - sin(lat) in the upper half and 1 + sin(lat) in the lower, at the lower and the upper
    /// edge of each row: unlike sin(lat) they keep their precision at the poles.
    std::vector<float> edges_;
    double mean_ = 1.0, concentration_ = 0.0;
};

} // namespace mbfeat
