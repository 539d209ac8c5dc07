#include "shading/environmentMap.h"

#include <algorithm>
#include <cmath>

namespace mbfeat {

namespace {

/// Larger images are sampled by blocks of texels; the look-up keeps their resolution.
constexpr int kMaxGridWidth = 2048;
constexpr int kMaxGridHeight = 1024;
/// Parts of the grid that are chosen by a surface's normal: so small that the cosine is much the
/// same all over one, and so few that their choice for all normals lies in a cache.
constexpr int kMostColumns = 16;
constexpr int kMostRows = 8;
constexpr double kPiExact = 3.14159265358979323846;

/// Means of the bilinearly interpolated image over its texels: along each axis the interpolant
/// weighs a texel with 3/4 and its neighbours with 1/8. The image wraps around in s.
std::vector<float> texelMeans(const Image& image) {
    const int w = image.width(), h = image.height();
    std::vector<float> gray(static_cast<std::size_t>(w) * h), rows(gray.size());
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const Float4 c = image.texel(x, y);
            gray[static_cast<std::size_t>(y) * w + x] =
                (max(c.x, 0.0F) + max(c.y, 0.0F) + max(c.z, 0.0F)) / 3.0F;
        }
    }
    for (int y = 0; y < h; ++y) {
        const float* row = &gray[static_cast<std::size_t>(y) * w];
        for (int x = 0; x < w; ++x) {
            rows[static_cast<std::size_t>(y) * w + x] =
                0.75F * row[x] + 0.125F * (row[(x + w - 1) % w] + row[(x + 1) % w]);
        }
    }
    for (int y = 0; y < h; ++y) {
        const float* at = &rows[static_cast<std::size_t>(y) * w];
        const float* below = &rows[static_cast<std::size_t>(std::max(y - 1, 0)) * w];
        const float* above = &rows[static_cast<std::size_t>(std::min(y + 1, h - 1)) * w];
        for (int x = 0; x < w; ++x) {
            gray[static_cast<std::size_t>(y) * w + x] =
                0.75F * at[x] + 0.125F * (below[x] + above[x]);
        }
    }
    return gray;
}

/// How much of texel `texel` lies in cell `cell` along an axis. A texel that touches a cell counts
/// for something there, so that no cell with light in it gets weight zero.
double overlap(int texel, int texels, int cell, int cells) {
    const double scale = static_cast<double>(texels) / cells;
    const double from = std::max(static_cast<double>(texel), cell * scale);
    const double to = std::min(texel + 1.0, (cell + 1) * scale);
    return std::max(to - from, 0.05);
}

/// Means over the cells of a coarser (or equal) grid.
std::vector<float> gridMeans(const std::vector<float>& texels, int w, int h, int gridW, int gridH) {
    if (gridW == w && gridH == h) {
        return texels;
    }
    std::vector<float> grid(static_cast<std::size_t>(gridW) * gridH);
    for (int gy = 0; gy < gridH; ++gy) {
        const auto y0 = static_cast<int>(static_cast<std::int64_t>(gy) * h / gridH);
        const auto y1 =
            static_cast<int>((static_cast<std::int64_t>(gy + 1) * h + gridH - 1) / gridH);
        for (int gx = 0; gx < gridW; ++gx) {
            const auto x0 = static_cast<int>(static_cast<std::int64_t>(gx) * w / gridW);
            const auto x1 =
                static_cast<int>((static_cast<std::int64_t>(gx + 1) * w + gridW - 1) / gridW);
            double sum = 0.0, area = 0.0;
            for (int y = y0; y < y1; ++y) {
                const double high = overlap(y, h, gy, gridH);
                for (int x = x0; x < x1; ++x) {
                    const double part = high * overlap(x, w, gx, gridW);
                    sum += part * texels[static_cast<std::size_t>(y) * w + x];
                    area += part;
                }
            }
            grid[static_cast<std::size_t>(gy) * gridW + gx] = static_cast<float>(sum / area);
        }
    }
    return grid;
}

/// An axis of the grid: `parts` of equally many cells. As many parts as divide the texels evenly,
/// so that cells are texels; of a large prime number the last few are made do without.
struct Axis {
    int cells, parts;
};
Axis axisOf(int texels, int mostCells, int mostParts) {
    constexpr int kLarge = 64; // cells that are no texels make little noise then
    const int cells = std::min(texels, mostCells);
    int parts = std::min(cells, mostParts);
    while (cells % parts != 0) {
        --parts;
    }
    if (2 * parts < mostParts && cells >= kLarge) {
        return {cells - cells % mostParts, mostParts};
    }
    return {cells, parts};
}

/// Height of the polar cap above (upper) or below row edge number `edge` of `rows`.
float capHeight(int edge, int rows, bool upper) {
    const double fromPole = upper ? rows - edge : edge;
    const double s = std::sin(0.5 * kPiExact * fromPole / rows);
    return static_cast<float>(2.0 * s * s);
}

/// The same cells, one part of the grid after the other.
std::vector<float> byParts(const std::vector<float>& grid, int width, int height, int columns,
                           int rows) {
    const int wide = width / columns, high = height / rows;
    std::vector<float> ordered;
    ordered.reserve(grid.size());
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            for (int y = row * high; y < (row + 1) * high; ++y) {
                const float* const line = &grid[static_cast<std::size_t>(y) * width];
                ordered.insert(ordered.end(), line + column * wide, line + (column + 1) * wide);
            }
        }
    }
    return ordered;
}

} // namespace

EnvironmentMap::EnvironmentMap(std::shared_ptr<const Image> image) : image_(std::move(image)) {
    const Axis across = axisOf(image_->width(), kMaxGridWidth, kMostColumns);
    const Axis up = axisOf(image_->height(), kMaxGridHeight, kMostRows);
    columns_ = across.parts;
    rows_ = up.parts;
    const int gridW = across.cells, gridH = up.cells;
    std::vector<float> weights =
        gridMeans(texelMeans(*image_), image_->width(), image_->height(), gridW, gridH);
    double total = 0.0;
    solidAngles_.resize(static_cast<std::size_t>(gridH));
    edges_.resize(2 * static_cast<std::size_t>(gridH));
    for (int y = 0; y < gridH; ++y) {
        // sin(b) - sin(a) without cancellation.
        const double a = kPiExact * y / gridH, b = kPiExact * (y + 1) / gridH;
        const double rowSolidAngle =
            4.0 * kPiExact * std::sin(0.5 * (a + b)) * std::sin(0.5 * (b - a));
        solidAngles_[static_cast<std::size_t>(y)] = static_cast<float>(rowSolidAngle / gridW);
        const bool upper = 2 * y >= gridH;
        edges_[2 * static_cast<std::size_t>(y)] = capHeight(y, gridH, upper);
        edges_[2 * static_cast<std::size_t>(y) + 1] = capHeight(y + 1, gridH, upper);
        for (int x = 0; x < gridW; ++x) {
            float& weight = weights[static_cast<std::size_t>(y) * gridW + x];
            weight *= solidAngles_[static_cast<std::size_t>(y)];
            total += weight;
        }
    }
    mean_ = total / (4.0 * kPiExact);
    for (int y = 0; y < gridH && total > 0.0; ++y) {
        const double found = static_cast<double>(solidAngles_[y]) / kPiExact;
        for (int x = 0; x < gridW; ++x) {
            const double share = weights[static_cast<std::size_t>(y) * gridW + x] / total;
            concentration_ += std::max(share - found, 0.0);
        }
    }
    sides_ = EnvironmentSides(weights, gridW, gridH, columns_, rows_);
    grid_ = PiecewiseConstant2D(gridW / columns_, gridH / rows_,
                                byParts(weights, gridW, gridH, columns_, rows_), columns_ * rows_);
}

} // namespace mbfeat
