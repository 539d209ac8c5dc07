#include "shading/lightTreeBuilder.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mbfeat {

namespace {

constexpr int kWidth = LightTreeNode::kWidth;
constexpr int kBins = 16;
constexpr float kEpsilon = std::numeric_limits<float>::epsilon();
/// Relative to the size of the tree: below float positions' resolution, but far above underflow.
constexpr float kLeastRadius = 1e-9F;
/// Farther away than this many sizes, distances to the lights of a tree are all the same.
constexpr float kFarthest = 1e6F;
/// A child counts as this share of its node's strength at least, so that weights do not underflow.
constexpr double kLeastShare = 1e-20;
/// Sides of a box count as this share of the longest at least: lights on a line have no area.
constexpr float kThinnest = 1e-3F;

/// Number of entries that fit below a node of that level.
std::uint64_t capacity(int level) {
    return std::uint64_t{1} << (3U * static_cast<unsigned>(LightTree::kMaxDepth - level));
}

float surfaceArea(const Bounds& box, float thinnest) {
    const Float3 d = box.upper - box.lower;
    const float x = max(d.x, thinnest), y = max(d.y, thinnest), z = max(d.z, thinnest);
    return 2.0F * (x * y + y * z + z * x);
}

/// The middle of a box around unit vectors, as a unit vector; zero where there is none.
Float3 middleAxis(const Bounds& axes) {
    const Float3 middle = axes.lower + axes.upper;
    const float l = length(middle);
    return l > 1e-3F ? middle / l : Float3(0.0F);
}

} // namespace

LightTreeBuilder::MinBox::MinBox() {
    std::fill(std::begin(least), std::end(least), std::numeric_limits<float>::max());
}

LightTreeBuilder::MinBox::MinBox(const Float3& lower, const Float3& upper)
    : least{lower.x, lower.y, lower.z, 0.0F, -upper.x, -upper.y, -upper.z, 0.0F} {}

Bounds LightTreeBuilder::MinBox::bounds() const {
    return {{least[0], least[1], least[2]}, {-least[4], -least[5], -least[6]}};
}

LightTreeBuilder::Entry::Entry(const LightBounds& bounds, std::uint32_t index_)
    : box(bounds.box.lower, bounds.box.upper),
      axes(bounds.axis, bounds.axis),
      center(bounds.box.center()),
      radius(bounds.radius),
      strength(bounds.strength),
      spread(bounds.spread),
      falloff(bounds.falloff),
      index(index_),
      bothSides(bounds.bothSides) {}

/// What the cost of a set needs to know. The cone of directions is bounded by a box around the
/// axes.
struct LightTreeBuilder::Summary {
    MinBox box, axes;
    double strength = 0.0;
    float spread = 0.0F, falloff = 0.0F;
    std::uint32_t count = 0;

    void add(const Entry& entry, float sign) {
        box.add(entry.box);
        axes.add(entry.axes, sign);
        strength += entry.strength;
        spread = max(spread, entry.spread);
        falloff = max(falloff, entry.falloff);
        ++count;
    }
    void add(const Summary& other) {
        box.add(other.box);
        axes.add(other.axes);
        strength += other.strength;
        spread = max(spread, other.spread);
        falloff = max(falloff, other.falloff);
        count += other.count;
    }
    /// `unit` of strength and `thinnest` side keep it within the range of floats and above zero.
    float cost(bool bothSides, double unit, float thinnest) const {
        const Bounds cone = axes.bounds();
        const Float3 axis = middleAxis(cone);
        // No unit vector in the box has a smaller cosine to the axis than the box's farthest
        // corner.
        const float least = min(cone.lower.x * axis.x, cone.upper.x * axis.x) +
                            min(cone.lower.y * axis.y, cone.upper.y * axis.y) +
                            min(cone.lower.z * axis.z, cone.upper.z * axis.z);
        const float angle = std::acos(clamp(least, -1.0F, 1.0F));
        const float measure = orientationMeasure(min(angle + spread, kPi), falloff, bothSides);
        return static_cast<float>(strength / unit) * surfaceArea(box.bounds(), thinnest) * measure;
    }
};

/// The bounds of a set, as tight as it gets.
struct LightTreeBuilder::Cluster {
    Float3 center{0.0F};
    float radius = 0.0F;
    Float3 axis{0.0F, 0.0F, 1.0F};
    double spread = 0.0, falloff = 0.0;
    bool bothSides = false;
    double strength = 0.0;
};

LightTreeBuilder::LightTreeBuilder(const std::vector<LightBounds>& entries, LightTree& tree)
    : tree_(tree) {
    entries_.reserve(entries.size());
    Bounds all;
    for (std::uint32_t i = 0; i < entries.size(); ++i) {
        entries_.emplace_back(entries[i], i);
        all.add(entries[i].box);
        strength_ += entries[i].strength;
    }
    // Only ratios to it count; lights at one point have no size of their own.
    const float radius = all.radius();
    size_ = radius > 0.0F ? clamp(radius, 1e-15F, 1e15F) : 1.0F;
}

void LightTreeBuilder::build() {
    if (entries_.empty()) {
        return;
    }
    tree_.trails_.resize(entries_.size());
    tree_.leastInverse_ =
        max(1.0F / (kFarthest * kFarthest * size_ * size_), std::numeric_limits<float>::min());
    tree_.rootScale_ = strength_ / (static_cast<double>(size_) * size_);
    buildNode({0, static_cast<std::uint32_t>(entries_.size()), 0.0F}, 0, 0);
    tree_.nodes_.shrink_to_fit();
}

void LightTreeBuilder::buildNode(const Set& set, int level, std::uint64_t trail) {
    const auto index = static_cast<std::uint32_t>(tree_.nodes_.size());
    tree_.nodes_.push_back({});
    tree_.depth_ = std::max(tree_.depth_, level + 1);
    const std::vector<Set> children = childSets(set, level);
    double strength = 0.0;
    std::array<Cluster, kWidth> clusters;
    for (std::size_t i = 0; i < children.size(); ++i) {
        clusters[i] = clusterOf(children[i]);
        strength += clusters[i].strength;
    }
    for (std::size_t i = 0; i < children.size(); ++i) {
        const Set& child = children[i];
        const std::uint64_t childTrail = trail | (static_cast<std::uint64_t>(i) << (3 * level));
        std::uint32_t reference = static_cast<std::uint32_t>(tree_.nodes_.size());
        if (child.size() == 1) {
            const std::uint32_t entry = entries_[child.begin].index;
            tree_.trails_[entry] = childTrail;
            reference = LightTreeNode::kLeaf + entry;
        } else {
            buildNode(child, level + 1, childTrail);
        }
        LightTreeNode& node = tree_.nodes_[index]; // the vector may have moved
        setLane(node, static_cast<int>(i), clusters[i], clusters[i].strength / strength);
        node.child[i] = reference;
    }
    LightTreeNode& node = tree_.nodes_[index];
    for (std::size_t i = children.size(); i < kWidth; ++i) {
        node.radius[i] = size_; // any: the strength is zero
        node.child[i] = LightTreeNode::kLeaf;
    }
}

/// At most eight sets in the order of their entries.
std::vector<LightTreeBuilder::Set> LightTreeBuilder::childSets(const Set& set, int level) {
    std::vector<Set> sets{set};
    const bool balanced = level + 1 >= LightTree::kMaxDepth || set.size() > capacity(level + 1);
    const auto less = [&](const Set& a, const Set& b) {
        // Sets that fit into a node are not split further before there is no other.
        const bool fitsA = a.size() <= kWidth, fitsB = b.size() <= kWidth;
        if (fitsA != fitsB) {
            return fitsA;
        }
        return balanced || a.cost == b.cost ? a.size() < b.size() : a.cost < b.cost;
    };
    while (sets.size() < kWidth) {
        const auto next = std::max_element(sets.begin(), sets.end(), less);
        if (next->size() <= kWidth) {
            break;
        }
        const Set whole = *next;
        const Halves halves = balanced ? splitInHalves(whole) : splitByCost(whole);
        *next = {whole.begin, halves.middle, halves.costs[0]};
        sets.insert(next + 1, {halves.middle, whole.end, halves.costs[1]});
    }
    // Lanes that are left take single entries in place of nodes, the smallest sets first.
    for (std::uint32_t size = 2; size <= kWidth; ++size) {
        for (std::size_t i = 0; i < sets.size(); ++i) {
            if (sets[i].size() != size || sets.size() + size - 1 > kWidth) {
                continue;
            }
            const Set whole = sets[i];
            sets.erase(sets.begin() + static_cast<std::ptrdiff_t>(i));
            for (std::uint32_t e = whole.end; e > whole.begin; --e) {
                sets.insert(sets.begin() + static_cast<std::ptrdiff_t>(i), {e - 1, e, 0.0F});
            }
        }
    }
    return sets;
}

/// Sorts the entries of a set in two where the costs of both parts are least.
LightTreeBuilder::Halves LightTreeBuilder::splitByCost(const Set& set) {
    Bounds centers;
    MinBox box;
    for (std::uint32_t i = set.begin; i < set.end; ++i) {
        centers.add(entries_[i].center);
        box.add(entries_[i].box);
    }
    const Facing facing = facingOf(set);
    const Float3 extent = centers.upper - centers.lower;
    const auto binOf = [&](const Entry& entry, int axis) {
        const float t = (entry.center[axis] - centers.lower[axis]) / extent[axis];
        return std::min(static_cast<int>(t * kBins), kBins - 1);
    };
    std::array<std::array<Summary, kBins>, 3> bins;
    for (std::uint32_t i = set.begin; i < set.end; ++i) {
        const float sign = facing.sign(entries_[i]);
        for (int axis = 0; axis < 3; ++axis) {
            if (extent[axis] > 0.0F) {
                bins[axis][binOf(entries_[i], axis)].add(entries_[i], sign);
            }
        }
    }

    const Float3 sides = box.bounds().upper - box.bounds().lower;
    const float longest = maxComponent(sides), thinnest = kThinnest * longest;
    float best = std::numeric_limits<float>::infinity();
    int bestAxis = -1, bestBin = 0;
    Halves halves;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(extent[axis] > 0.0F)) {
            continue;
        }
        // Costs of what is at and after a bin, then of what is before it.
        std::array<float, kBins> after{};
        Summary sum;
        for (int b = kBins - 1; b > 0; --b) {
            sum.add(bins[axis][b]);
            after[b] =
                bins[axis][b].count > 0 ? sum.cost(facing.bothSides, strength_, thinnest) : 0.0F;
        }
        // Thin slices are as bad as they are long (the regularisation of the paper).
        const float regular = longest / max(sides[axis], thinnest);
        sum = Summary();
        float before = 0.0F;
        for (int b = 0; b < kBins; ++b) {
            // Between full bins, a split is looked at where the next of them begins.
            if (bins[axis][b].count == 0) {
                continue;
            }
            if (sum.count > 0 && regular * (before + after[b]) < best) {
                best = regular * (before + after[b]);
                bestAxis = axis;
                bestBin = b;
                halves.costs[0] = before;
                halves.costs[1] = after[b];
            }
            sum.add(bins[axis][b]);
            before = sum.cost(facing.bothSides, strength_, thinnest);
        }
    }
    if (bestAxis < 0) {
        return splitInHalves(set);
    }
    const auto begin = entries_.begin() + set.begin, end = entries_.begin() + set.end;
    const auto middle = std::partition(
        begin, end, [&](const Entry& entry) { return binOf(entry, bestAxis) < bestBin; });
    halves.middle = static_cast<std::uint32_t>(middle - entries_.begin());
    return halves;
}

/// The same by number, along the longest axis. The parts share the cost.
LightTreeBuilder::Halves LightTreeBuilder::splitInHalves(const Set& set) {
    Bounds centers;
    for (std::uint32_t i = set.begin; i < set.end; ++i) {
        centers.add(entries_[i].center);
    }
    const Float3 extent = centers.upper - centers.lower;
    const int axis = extent.x >= max(extent.y, extent.z) ? 0 : extent.y >= extent.z ? 1 : 2;
    const std::uint32_t middle = set.begin + set.size() / 2;
    std::nth_element(entries_.begin() + set.begin, entries_.begin() + middle,
                     entries_.begin() + set.end, [&](const Entry& a, const Entry& b) {
                         return a.center[axis] != b.center[axis] ? a.center[axis] < b.center[axis]
                                                                 : a.index < b.index;
                     });
    return {middle, {0.5F * set.cost, 0.5F * set.cost}};
}

LightTreeBuilder::Facing LightTreeBuilder::facingOf(const Set& set) const {
    Facing out{false, entries_[set.begin].axis()};
    for (std::uint32_t i = set.begin; i < set.end; ++i) {
        out.bothSides = out.bothSides || entries_[i].bothSides;
    }
    return out;
}

LightTreeBuilder::Cluster LightTreeBuilder::clusterOf(const Set& set) const {
    Cluster out;
    const Facing facing = facingOf(set);
    MinBox boxes, axes;
    for (std::uint32_t i = set.begin; i < set.end; ++i) {
        const Entry& entry = entries_[i];
        boxes.add(entry.box);
        axes.add(entry.axes, facing.sign(entry));
        out.strength += entry.strength;
        out.falloff = std::max(out.falloff, static_cast<double>(entry.falloff));
    }
    const Bounds box = boxes.bounds();
    const Float3 axis = middleAxis(axes.bounds());
    const bool anyAxis = lengthSquared(axis) > 0.0F;
    out.center = box.center();
    out.axis = anyAxis ? axis : facing.reference;
    out.spread = anyAxis ? 0.0 : static_cast<double>(kPi);
    out.bothSides = facing.bothSides;
    for (std::uint32_t i = set.begin; i < set.end; ++i) {
        const Entry& entry = entries_[i];
        out.radius = max(out.radius, length(entry.center - out.center) + entry.radius);
        const double cosine = dot(Double3(entry.axis()), Double3(out.axis));
        const double angle =
            std::acos(std::clamp(out.bothSides ? std::abs(cosine) : cosine, -1.0, 1.0));
        out.spread = std::max(out.spread, angle + static_cast<double>(entry.spread));
    }
    out.spread = std::min(out.spread, static_cast<double>(kPi));
    const float rounding = kEpsilon * maxComponent(abs(box.lower) + abs(box.upper));
    out.radius = min(out.radius, box.radius()) * (1.0F + 8.0F * kEpsilon) + rounding;
    return out;
}

/// `share` is that of the cluster's strength in the node's.
void LightTreeBuilder::setLane(LightTreeNode& node, int lane, const Cluster& cluster,
                               double share) const {
    node.centerX[lane] = cluster.center.x;
    node.centerY[lane] = cluster.center.y;
    node.centerZ[lane] = cluster.center.z;
    node.radius[lane] = std::max({cluster.radius, kLeastRadius * size_, 1e-18F});
    node.axisX[lane] = cluster.axis.x;
    node.axisY[lane] = cluster.axis.y;
    node.axisZ[lane] = cluster.axis.z;
    node.cosSpread[lane] = static_cast<float>(std::cos(cluster.spread));
    node.sinSpread[lane] = static_cast<float>(std::sin(cluster.spread));
    node.cosFalloff[lane] = static_cast<float>(std::cos(cluster.falloff));
    const auto strength = static_cast<float>(std::max(share, kLeastShare)) * (size_ * size_);
    node.strength[lane] = cluster.bothSides ? -strength : strength;
}

LightTree::LightTree(const std::vector<LightBounds>& entries) {
    LightTreeBuilder(entries, *this).build();
}

} // namespace mbfeat
