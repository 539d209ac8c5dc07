#include "shading/lightShapeTree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/floatTraps.h"
#include "core/laneMemory.h"
#include "core/overloaded.h"
#include "shading/preparedLight.h"
#include "shading/shapeLanes.h"

namespace mbfeat {

namespace {

/// As many children wait to be visited at most: below the root a level divides what is left by its
/// width, eight or four, and leaves as many less one behind. 2^31 shapes have 11 or 16 levels.
constexpr std::size_t kStackSize = 128;

/// Bounds are met with three roundings, of which this is a multiple: after Ize 2013 ("Robust BVH
/// Ray Traversal", section 3).
constexpr float kGrown = 1.0F + 0x1p-20F;

/// Number of the lowest bit of bits that are not all zero.
std::uint32_t lowestBit(std::uint32_t bits) {
#if defined(__GNUC__)
    return static_cast<std::uint32_t>(__builtin_ctz(bits));
#else
    std::uint32_t i = 0;
    for (; (bits & 1U) == 0; bits >>= 1U) {
        ++i;
    }
    return i;
#endif
}

} // namespace

class LightShapeTree::BoxBuilder {
public:
    void add(const Bounds& box) {
        for (int axis = 0; axis < 3; ++axis) {
            lower_[axis][count_] = box.lower[axis];
            upper_[axis][count_] = box.upper[axis];
        }
        ++count_;
    }
    Boxes boxes() const {
        Boxes result;
        for (int axis = 0; axis < 3; ++axis) {
            result.lower[axis] = lower_[axis].lanes();
            result.upper[axis] = upper_[axis].lanes();
        }
        result.used = (1U << static_cast<unsigned>(count_)) - 1U;
        return result;
    }

private:
    using Values = LaneBuffer<Lanes>;
    Values lower_[3] = {Values(Lanes(0)), Values(Lanes(0)), Values(Lanes(0))};
    Values upper_[3] = {Values(Lanes(0)), Values(Lanes(0)), Values(Lanes(0))};
    int count_ = 0;
};

class LightShapeTree::Builder {
public:
    Builder(const std::vector<const PreparedLight*>& shapes, LightShapeTree& tree,
            const std::function<bool()>& shouldStop)
        : shapes_(shapes),
          tree_(tree),
          shouldStop_(shouldStop) {}

    void run() {
        for (std::size_t i = 0; i < shapes_.size(); ++i) {
            order_.push_back(static_cast<std::int32_t>(i));
        }
        std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
            return std::pair(kindOf(a), a) < std::pair(kindOf(b), b);
        });
        Parts kinds;
        for (std::size_t begin = 0; begin < order_.size();) {
            std::size_t end = begin;
            while (end < order_.size() && kindOf(order_[end]) == kindOf(order_[begin])) {
                ++end;
            }
            kinds.parts[kinds.count++] = {begin, end};
            begin = end;
        }
        tree_.nodes_.emplace_back();
        fill(0, kinds);
    }

private:
    struct Part {
        std::size_t begin = 0, end = 0; ///< in order_
        std::size_t leaves() const { return (end - begin + kWidth - 1) / kWidth; }
    };
    struct Parts {
        std::array<Part, static_cast<std::size_t>(kWidth)> parts;
        std::size_t count = 0;
    };

    const PreparedLight& light(std::int32_t shape) const {
        return *shapes_[static_cast<std::size_t>(shape)];
    }
    std::size_t kindOf(std::int32_t shape) const { return light(shape).emitter.index(); }

    /// Node `index` of these parts, which are split further while there is room for children.
    void fill(std::size_t index, Parts parts) {
        if (shouldStop_ && shouldStop_()) {
            return;
        }
        while (parts.count < parts.parts.size()) {
            Part* const end = parts.parts.data() + parts.count;
            Part* const largest =
                std::max_element(parts.parts.data(), end, [](const Part& a, const Part& b) {
                    return a.leaves() < b.leaves();
                });
            if (largest->leaves() < 2) {
                break;
            }
            const std::size_t middle = split(*largest);
            parts.parts[parts.count++] = {middle, largest->end};
            largest->end = middle;
        }
        BoxBuilder boxes;
        for (std::size_t i = 0; i < parts.count; ++i) {
            const Part& part = parts.parts[i];
            Bounds box;
            for (std::size_t k = part.begin; k < part.end; ++k) {
                box.add(light(order_[k]).bounds);
            }
            boxes.add(box);
            std::uint32_t child = 0;
            if (part.leaves() == 1) {
                child = kLeaf + addLeaf(part);
            } else {
                child = static_cast<std::uint32_t>(tree_.nodes_.size());
                tree_.nodes_.emplace_back();
                Parts inner;
                inner.parts[inner.count++] = part;
                fill(child, inner);
            }
            tree_.nodes_[index].child[i] = child;
        }
        tree_.nodes_[index].boxes = boxes.boxes();
    }

    /// Orders a part about the middle along the axis on which it is longest, in whole leaves.
    std::size_t split(const Part& part) {
        Bounds centers;
        for (std::size_t k = part.begin; k < part.end; ++k) {
            centers.add(light(order_[k]).bounds.center());
        }
        const Float3 size = centers.upper - centers.lower;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const std::size_t middle = part.begin + part.leaves() / 2 * kWidth;
        const auto at = [&](std::size_t k) {
            return order_.begin() + static_cast<std::ptrdiff_t>(k);
        };
        const auto placeOf = [&](std::int32_t shape) {
            return std::pair(light(shape).bounds.center()[axis], shape);
        };
        std::nth_element(at(part.begin), at(middle), at(part.end),
                         [&](std::int32_t a, std::int32_t b) { return placeOf(a) < placeOf(b); });
        return middle;
    }

    std::uint32_t addLeaf(const Part& part) {
        // Of shapes at the same distance the first lane is taken.
        std::sort(order_.begin() + static_cast<std::ptrdiff_t>(part.begin),
                  order_.begin() + static_cast<std::ptrdiff_t>(part.end));
        const int count = static_cast<int>(part.end - part.begin);
        std::int32_t names[kWidth];
        for (int i = 0; i < kWidth; ++i) {
            names[i] = order_[part.begin + static_cast<std::size_t>(i < count ? i : 0)];
        }
        BoxBuilder boxes;
        for (int i = 0; i < count; ++i) {
            boxes.add(light(names[i]).bounds);
        }
        std::visit(Overloaded{
                       [&](const RectShape<float>&) { addShapes<RectShape>(names, boxes.boxes()); },
                       [&](const DiskShape<float>&) { addShapes<DiskShape>(names, boxes.boxes()); },
                       [&](const EllipsoidShape<float>&) {
                           addShapes<EllipsoidShape>(names, boxes.boxes());
                       },
                       [&](const CylinderShape<float>&) {
                           addShapes<CylinderShape>(names, boxes.boxes());
                       },
                       [](const auto&) {},
                   },
                   light(names[0]).emitter);
        return static_cast<std::uint32_t>(tree_.leaves_.size() - 1);
    }

    template <template <class> class X>
    void addShapes(const std::int32_t* names, const Boxes& boxes) {
        tree_.leaves_.push_back({boxes,
                                 shapeLanes<X, Lanes>([&](int i) -> const X<float>& {
                                     return std::get<X<float>>(light(names[i]).emitter);
                                 }),
                                 {}});
        std::copy(names, names + kWidth, tree_.leaves_.back().names);
    }

    const std::vector<const PreparedLight*>& shapes_;
    LightShapeTree& tree_;
    const std::function<bool()>& shouldStop_;
    std::vector<std::int32_t> order_;
};

LightShapeTree::LightShapeTree(const std::vector<const PreparedLight*>& shapes,
                               const std::function<bool()>& shouldStop) {
    if (!shapes.empty()) {
        const FloatTrapsMasked lanes;
        Builder(shapes, *this, shouldStop).run();
    }
}

class LightShapeTree::Query {
public:
    explicit Query(const Ray& ray)
        : origin_(ray.origin),
          direction_(ray.direction),
          near_(ray.tNear) {
        const Float3& d = ray.direction;
        inverse_ = {Lanes(inverse(d.x)), Lanes(inverse(d.y)), Lanes(inverse(d.z))};
    }

    /// Which boxes the ray may meet up to tFar, as bits, and where it would enter.
    std::uint32_t meets(const Boxes& boxes, float tFar, Lanes& entry) const {
        Lanes near = near_, far(tFar);
        for (int axis = 0; axis < 3; ++axis) {
            const Lanes a = (boxes.lower[axis] - origin_[axis]) * inverse_[axis];
            const Lanes b = (boxes.upper[axis] - origin_[axis]) * inverse_[axis];
            near = max(near, min(a, b));
            far = min(far, max(a, b));
        }
        entry = near;
        return laneBits(near <= far * Lanes(kGrown)) & boxes.used;
    }

    /// Distances to the shapes of a leaf; none positive that is not met.
    Lanes meets(const Leaf& leaf, float tFar) const {
        return std::visit(
            [&](const auto& shapes) {
                return shapes.intersect(origin_, direction_, near_, Lanes(tFar));
            },
            leaf.shapes);
    }

private:
    /// Finite: nothing is not a number where a ray runs along a bound.
    static float inverse(float d) {
        constexpr float kLeast = std::numeric_limits<float>::min();
        return 1.0F / (std::abs(d) < kLeast ? std::copysign(kLeast, d) : d);
    }

    Vec3<Lanes> origin_, direction_, inverse_;
    Lanes near_;
};

template <bool Any>
LightShapeTree::Hit LightShapeTree::meet(const Ray& ray) const {
    Hit hit;
    hit.t = ray.tFar;
    if (nodes_.empty()) {
        return hit;
    }
    const FloatTrapsMasked lanes;
    const Query query(ray);
    struct Waiting {
        std::uint32_t child;
        float entry;
    };
    std::array<Waiting, kStackSize> stack;
    std::size_t waiting = 0;
    stack[waiting++] = {0, ray.tNear};
    while (waiting > 0) {
        const Waiting next = stack[--waiting];
        if (next.entry > hit.t * kGrown) {
            continue;
        }
        Lanes entry;
        if (next.child >= kLeaf) {
            const Leaf& leaf = leaves_[next.child - kLeaf];
            std::uint32_t bits = query.meets(leaf.boxes, hit.t, entry);
            if (bits == 0) {
                continue;
            }
            const Lanes t = query.meets(leaf, hit.t);
            bits &= laneBits(t > Lanes(0));
            if (bits == 0) {
                continue;
            }
            const LaneBuffer<Lanes> distances(t);
            for (int i = 0; bits != 0; ++i, bits >>= 1U) {
                const bool nearer = distances[i] < hit.t || hit.shape < 0 ||
                                    (distances[i] == hit.t && leaf.names[i] < hit.shape);
                if ((bits & 1U) != 0 && nearer) {
                    hit = {leaf.names[i], distances[i]};
                }
            }
            if (Any) {
                return hit;
            }
            continue;
        }
        const Node& node = nodes_[next.child];
        std::uint32_t bits = query.meets(node.boxes, hit.t, entry);
        if (bits == 0) {
            continue;
        }
        const LaneBuffer<Lanes> entries(entry);
        const std::size_t first = waiting;
        for (; bits != 0; bits &= bits - 1U) {
            const auto i = static_cast<int>(lowestBit(bits));
            std::size_t place = waiting++;
            if (!Any) { // the nearest on top
                for (; place > first && stack[place - 1].entry < entries[i]; --place) {
                    stack[place] = stack[place - 1];
                }
            }
            stack[place] = {node.child[i], entries[i]};
        }
    }
    return hit;
}

LightShapeTree::Hit LightShapeTree::intersect(const Ray& ray) const {
    return meet<false>(ray);
}

bool LightShapeTree::occluded(const Ray& ray) const {
    return meet<true>(ray).shape >= 0;
}

} // namespace mbfeat
