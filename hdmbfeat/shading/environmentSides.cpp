#include "shading/environmentSides.h"

#include <algorithm>
#include <cmath>

namespace mbfeat {

namespace {

/// Pieces of all parts along each axis, for their mean cosines and for what of them can light at
/// all: more than there are cells, in small images.
constexpr int kPiecesAcross = 64, kPiecesUp = 32;
/// What of a piece's power counts whatever the angle, where any of it can light: closures that are
/// not diffuse may want it more than the cosine says.
constexpr float kLeastCosine = 0.02F;
/// Radians that the cones which bound pieces and normals are widened by, against rounding and
/// against what lies between the places that they are made from.
constexpr float kSlack = 0.02F;

/// Of the place (x, y), from the bottom left, of a grid of that size.
Float3 directionAt(float x, float y, int width, int height) {
    const float latitude = kPi * (y / static_cast<float>(height) - 0.5F);
    const float longitude = kPi * (1.0F - 2.0F * x / static_cast<float>(width));
    const float c = std::cos(latitude);
    return {std::sin(longitude) * c, std::sin(latitude), std::cos(longitude) * c};
}

/// Of the octahedral map's place (x, z), each from -1 to 1.
Float3 normalAt(float x, float z) {
    const float y = 1.0F - std::abs(x) - std::abs(z);
    if (y >= 0.0F) {
        return normalize(Float3(x, y, z));
    }
    return normalize(
        Float3(std::copysign(1.0F - std::abs(z), x), y, std::copysign(1.0F - std::abs(x), z)));
}

float angleBetween(const Float3& a, const Float3& b) {
    return std::acos(std::clamp(dot(a, b), -1.0F, 1.0F));
}

struct Cone {
    Float3 axis{0.0F};
    float spread = 0.0F; ///< radians
    void include(const Float3& d) { spread = std::max(spread, angleBetween(axis, d) + kSlack); }
};

/// A piece of a part.
struct Piece {
    Cone cone;
    float power = 0.0F;
};
struct Part {
    std::vector<Piece> pieces;
    float power = 0.0F;
};

/// A grid of directions, and what comes along them.
struct Grid {
    const std::vector<float>& power;
    int width, height;

    /// From (x0, y0) to (x1, y1), in cells.
    Piece piece(float x0, float y0, float x1, float y1) const {
        Piece piece;
        const auto at = [&](float x, float y) {
            return directionAt(x0 + x * (x1 - x0), y0 + y * (y1 - y0), width, height);
        };
        piece.cone.axis = at(0.5F, 0.5F);
        for (const float t : {0.0F, 0.5F, 1.0F}) {
            for (const Float3& edge : {at(t, 0.0F), at(t, 1.0F), at(0.0F, t), at(1.0F, t)}) {
                piece.cone.include(edge);
            }
        }
        double sum = 0.0;
        for (int y = static_cast<int>(y0); y < height && static_cast<float>(y) < y1; ++y) {
            for (int x = static_cast<int>(x0); x < width && static_cast<float>(x) < x1; ++x) {
                sum += static_cast<double>(within(y, y0, y1) * within(x, x0, x1) *
                                           power[static_cast<std::size_t>(y) * width + x]);
            }
        }
        piece.power = static_cast<float>(sum);
        return piece;
    }
    /// The share of a cell that lies between two places along an axis.
    static float within(int cell, float from, float to) {
        const auto low = static_cast<float>(cell);
        return std::max(std::min(to, low + 1.0F) - std::max(from, low), 0.0F);
    }

    /// Of a part of so many cells; `across` and `up` are pieces.
    Part part(int x0, int y0, int wide, int high, int across, int up) const {
        Part part;
        const auto place = [](int first, int size, int i, int pieces) {
            return static_cast<float>(first) +
                   static_cast<float>(size) * static_cast<float>(i) / static_cast<float>(pieces);
        };
        for (int j = 0; j < up; ++j) {
            for (int i = 0; i < across; ++i) {
                part.pieces.push_back(piece(place(x0, wide, i, across), place(y0, high, j, up),
                                            place(x0, wide, i + 1, across),
                                            place(y0, high, j + 1, up)));
                part.power += part.pieces.back().power;
            }
        }
        return part;
    }
};

/// What the part gives to surfaces with such normals, in the mean.
float weightOf(const Part& part, const Cone& cone, const std::vector<Float3>& normals) {
    float sum = 0.0F;
    for (const Piece& piece : part.pieces) {
        if (angleBetween(cone.axis, piece.cone.axis) >
            0.5F * kPi + cone.spread + piece.cone.spread) {
            continue; // below the horizon of all of them
        }
        float cosines = 0.0F;
        for (const Float3& n : normals) {
            cosines += std::max(dot(n, piece.cone.axis), 0.0F);
        }
        sum += piece.power * (kLeastCosine + cosines / static_cast<float>(normals.size()));
    }
    return sum;
}

} // namespace

EnvironmentSides::EnvironmentSides(const std::vector<float>& power, int width, int height,
                                   int columns, int rows) {
    // Relative to the brightest cell: sums of huge powers must not overflow. Those that are not
    // finite count for nothing, as in distributions.
    float largest = 0.0F;
    for (const float p : power) {
        largest = std::isfinite(p) ? std::max(largest, p) : largest;
    }
    std::vector<float> scaled(power);
    for (float& p : scaled) {
        p = std::isfinite(p) && largest > 0.0F ? p / largest : 0.0F;
    }
    const Grid grid{scaled, width, height};
    const int wide = width / columns, high = height / rows;
    const int across = (kPiecesAcross + columns - 1) / columns, up = (kPiecesUp + rows - 1) / rows;
    std::vector<Part> parts;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            parts.push_back(grid.part(column * wide, row * high, wide, high, across, up));
        }
    }
    std::vector<float> weights;
    weights.reserve(parts.size() * (kBoth + 1));
    for (int side = 0; side < kBoth; ++side) {
        const int column = side % kAcross, row = side / kAcross;
        const auto at = [&](float x, float z) {
            return normalAt(2.0F * (static_cast<float>(column) + x) / kAcross - 1.0F,
                            2.0F * (static_cast<float>(row) + z) / kAcross - 1.0F);
        };
        Cone cone;
        cone.axis = at(0.5F, 0.5F);
        for (const Float3& corner :
             {at(0.0F, 0.0F), at(1.0F, 0.0F), at(0.0F, 1.0F), at(1.0F, 1.0F)}) {
            cone.include(corner);
        }
        const std::vector<Float3> normals{cone.axis, at(0.25F, 0.25F), at(0.75F, 0.25F),
                                          at(0.25F, 0.75F), at(0.75F, 0.75F)};
        for (const Part& part : parts) {
            weights.push_back(weightOf(part, cone, normals));
        }
    }
    for (const Part& part : parts) {
        weights.push_back(part.power);
    }
    parts_ = PiecewiseConstant2D(columns, rows, weights, kBoth + 1);
}

} // namespace mbfeat
