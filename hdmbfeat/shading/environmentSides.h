// Which part of an environment to look at for a surface that faces some way: parts are chosen by
// the irradiance that they give such a surface, so that a sun well behind it takes no samples.
#pragma once

#include <vector>

#include "core/distribution.h"
#include "core/vec.h"

namespace mbfeat {

/// A surface as lights at infinity know it.
template <class T>
struct Facing {
    Vec3<T> n{T(0), T(0), T(1)};      ///< unit
    Mask<T> twoSided = Mask<T>(true); ///< lit from below, too: n does not matter
};

/// A distribution over the parts, equal ones of a latitude-longitude grid, for every one of 256
/// cones of normals and for surfaces that are lit from both sides. Templates on the lane type,
/// which give the same bits.
class EnvironmentSides {
public:
    EnvironmentSides() = default;
    /// `power[y * width + x]` is radiance times solid angle of a cell of a grid that has a whole
    /// number of cells in each of `columns` times `rows` parts, from the bottom left; directions
    /// are those of environmentMap.h.
    EnvironmentSides(const std::vector<float>& power, int width, int height, int columns, int rows);

    template <class T>
    PiecewiseConstant2D::LaneSample<T> sample(const Facing<T>& to, const Vec2<T>& u) const {
        return parts_.sample<T>(u, sideOf(to));
    }
    template <class T>
    T probability(const Facing<T>& to, const IntLane<T>& x, const IntLane<T>& y) const {
        return parts_.probability<T>(x, y, sideOf(to));
    }

private:
    /// Cones are the cells of the octahedral map of the sphere (Meyer et al. 2010, "On
    /// Floating-Point Normal Vectors").
    static constexpr int kAcross = 16;
    static constexpr int kBoth = kAcross * kAcross;

    template <class T>
    static IntLane<T> sideOf(const Facing<T>& to) {
        const T sum = abs(to.n.x) + abs(to.n.y) + abs(to.n.z);
        const T scale = T(1) / select(sum > T(0), sum, T(1));
        const T x = to.n.x * scale, z = to.n.z * scale;
        const Mask<T> lower = to.n.y < T(0);
        const auto cell = [](const T& coordinate) {
            const T place = fma(coordinate, T(0.5F * kAcross), T(0.5F * kAcross));
            return toInteger(min(max(place, T(0)), T(kAcross - 0.5F)));
        };
        const IntLane<T> column = cell(select(lower, copysign(T(1) - abs(z), x), x));
        const IntLane<T> row = cell(select(lower, copysign(T(1) - abs(x), z), z));
        return selectInt(to.twoSided, IntLane<T>(kBoth), row * IntLane<T>(kAcross) + column);
    }

    PiecewiseConstant2D parts_; ///< a layer a cone, and one for both sides
};

} // namespace mbfeat
