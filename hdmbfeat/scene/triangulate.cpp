#include "scene/triangulate.h"

#include <vector>

#include "scene/meshBuilder.h"

namespace mbfeat {

namespace {

struct Point2 {
    double x = 0.0, y = 0.0;
    bool operator==(const Point2& o) const { return x == o.x && y == o.y; }
};

/// Twice the signed area of the triangle, positive when counter-clockwise.
double orientation(const Point2& a, const Point2& b, const Point2& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The polygon seen along the axis that its normal (Newell's method) is closest to, counter-
/// clockwise. Dropping a coordinate keeps the others exact.
std::vector<Point2> project(const ArrayView<Float3>& points) {
    Double3 normal(0.0);
    const Double3 origin(points[0]);
    for (std::size_t i = 0; i < points.size; ++i) {
        const Double3 a = Double3(points[i]) - origin;
        const Double3 b = Double3(points[i + 1 == points.size ? 0 : i + 1]) - origin;
        normal += cross(a, b);
    }
    const Double3 size = abs(normal);
    const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    const bool flip = normal[axis] < 0.0;
    std::vector<Point2> projected;
    projected.reserve(points.size);
    for (const Float3& p : points) {
        const double u = static_cast<double>(p[(axis + 1) % 3]);
        const double v = static_cast<double>(p[(axis + 2) % 3]);
        projected.push_back(flip ? Point2{v, u} : Point2{u, v});
    }
    return projected;
}

/// Convex and once around: no right turn, and the boundary changes its x direction just twice.
bool isConvex(const std::vector<Point2>& p) {
    const std::size_t n = p.size();
    int changes = 0;
    double last = 0.0;
    double first = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        const Point2& a = p[i];
        const Point2& b = p[(i + 1) % n];
        const Point2& c = p[(i + 2) % n];
        if (orientation(a, b, c) < 0.0) {
            return false;
        }
        const double dx = b.x - a.x;
        if (dx != 0.0) {
            changes += last * dx < 0.0 ? 1 : 0;
            first = first == 0.0 ? dx : first;
            last = dx;
        }
    }
    changes += last * first < 0.0 ? 1 : 0;
    return changes <= 2;
}

/// Ear clipping (Meisters 1975; O'Rourke, Computational Geometry in C, section 1.6). Polygons that
/// intersect or touch themselves have no proper ears at times; then the test is relaxed step by
/// step, so that every polygon ends up as n - 2 triangles.
class EarClipper {
public:
    EarClipper(const std::vector<Point2>& points, std::vector<std::uint32_t>& triangles)
        : points_(points),
          triangles_(triangles),
          left_(points.size()) {
        const std::size_t n = points.size();
        nodes_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            nodes_[i].previous = static_cast<std::uint32_t>(i == 0 ? n - 1 : i - 1);
            nodes_[i].next = static_cast<std::uint32_t>(i + 1 == n ? 0 : i + 1);
        }
    }

    void run() {
        markEars(Rule::kProper);
        std::uint32_t at = 0;
        std::size_t tried = 0;
        int relaxations = 0;
        while (left_ > 3) {
            if (nodes_[at].ear) {
                const std::uint32_t following = nodes_[at].next;
                clip(at);
                // Two on, so that triangles do not all share one corner.
                at = nodes_[following].next;
                tried = 0;
                continue;
            }
            at = nodes_[at].next;
            if (++tried > left_) {
                relax(at, relaxations++);
                tried = 0;
            }
        }
        emit(at);
    }

private:
    enum class Rule { kProper, kTouching };
    struct Node {
        std::uint32_t previous = 0, next = 0;
        bool ear = false, reflex = false;
    };

    /// No ear was found: look again with touching corners allowed, then cut anywhere.
    void relax(std::uint32_t at, int times) {
        constexpr int kPatience = 64; // garbage of any size must end soon
        markEars(Rule::kTouching);
        std::uint32_t i = at;
        do {
            if (nodes_[i].ear && times < kPatience) {
                return;
            }
            i = nodes_[i].next;
        } while (i != at);
        if (times < kPatience) {
            nodes_[at].ear = true;
            return;
        }
        while (left_ > 3) {
            clipWithoutTest(nodes_[at].next);
        }
    }

    double turn(std::uint32_t i) const {
        return orientation(points_[nodes_[i].previous], points_[i], points_[nodes_[i].next]);
    }

    void markEars(Rule rule) {
        const std::uint32_t start = lastKept_;
        std::uint32_t i = start;
        reflex_.clear();
        do {
            nodes_[i].reflex = turn(i) < 0.0;
            if (nodes_[i].reflex) {
                reflex_.push_back(i);
            }
            i = nodes_[i].next;
        } while (i != start);
        do {
            nodes_[i].ear = isEar(i, rule);
            i = nodes_[i].next;
        } while (i != start);
    }

    bool isEar(std::uint32_t i, Rule rule) const {
        const Point2& a = points_[nodes_[i].previous];
        const Point2& b = points_[i];
        const Point2& c = points_[nodes_[i].next];
        const double area = orientation(a, b, c);
        if (area <= 0.0) {
            return area == 0.0; // cuts off nothing
        }
        const auto blocks = [&](std::uint32_t j) {
            const Point2& p = points_[j];
            if (!nodes_[j].reflex || p == a || p == b || p == c) {
                return false;
            }
            const double s = orientation(a, b, p);
            const double t = orientation(b, c, p);
            const double u = orientation(c, a, p);
            return rule == Rule::kProper ? s >= 0.0 && t >= 0.0 && u >= 0.0
                                         : s > 0.0 && t > 0.0 && u > 0.0;
        };
        for (const std::uint32_t j : reflex_) {
            if (blocks(j)) {
                return false;
            }
        }
        return true;
    }

    void emit(std::uint32_t i) {
        triangles_.insert(triangles_.end(), {nodes_[i].previous, i, nodes_[i].next});
    }

    void clipWithoutTest(std::uint32_t i) {
        emit(i);
        nodes_[nodes_[i].previous].next = nodes_[i].next;
        nodes_[nodes_[i].next].previous = nodes_[i].previous;
        nodes_[i].reflex = false;
        lastKept_ = nodes_[i].next;
        --left_;
    }

    void clip(std::uint32_t i) {
        clipWithoutTest(i);
        for (const std::uint32_t neighbour : {nodes_[i].previous, nodes_[i].next}) {
            const bool reflex = turn(neighbour) < 0.0;
            if (reflex && !nodes_[neighbour].reflex) {
                reflex_.push_back(neighbour); // only after a cut that was no proper ear
            }
            nodes_[neighbour].reflex = reflex;
            nodes_[neighbour].ear = isEar(neighbour, Rule::kProper);
        }
    }

    const std::vector<Point2>& points_;
    std::vector<std::uint32_t>& triangles_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> reflex_; ///< may hold nodes that are no longer reflex
    std::size_t left_;
    std::uint32_t lastKept_ = 0;
};

} // namespace

void triangulatePolygon(ArrayView<Float3> points, std::vector<std::uint32_t>& triangles) {
    if (points.size < 3) {
        return;
    }
    if (points.size == 4) {
        for (const auto& triangle : splitQuad(points[0], points[1], points[2], points[3])) {
            for (const int corner : triangle) {
                triangles.push_back(static_cast<std::uint32_t>(corner));
            }
        }
        return;
    }
    if (points.size > 3) {
        const std::vector<Point2> projected = project(points);
        if (!isConvex(projected)) {
            EarClipper(projected, triangles).run();
            return;
        }
    }
    for (std::size_t i = 1; i + 1 < points.size; ++i) {
        triangles.insert(triangles.end(),
                         {0U, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i + 1)});
    }
}

} // namespace mbfeat
