// Builds a LightTree from the top: sets of entries are split where the surface-area-orientation
// heuristic is least (Conty Estevez and Kulla 2018, section 4.4), over bins, until a node is full.
#pragma once

#include "shading/lightTree.h"

namespace mbfeat {

class LightTreeBuilder {
public:
    LightTreeBuilder(const std::vector<LightBounds>& entries, LightTree& tree);
    /// Fills the tree, in O(n log n).
    void build();

private:
    /// A box as the least of its points and of their negatives: eight floats that are enlarged at
    /// once.
    struct MinBox {
        alignas(16) float least[8];

        MinBox();
        MinBox(const Float3& lower, const Float3& upper);
        /// The other box taken `sign` times: 1, or -1 for its image through the origin.
        void add(const MinBox& other, float sign = 1.0F) {
            using Four = xsimd::make_sized_batch_t<float, 4>;
            for (int i = 0; i < 8; i += 4) {
                const Four v = Four::load_aligned(other.least + i) * Four(sign);
                min(v, Four::load_aligned(least + i)).store_aligned(least + i);
            }
        }
        Bounds bounds() const;
    };
    struct Entry {
        MinBox box, axes;
        Float3 center{0.0F};
        float radius = 0.0F;
        double strength = 0.0;
        float spread = 0.0F, falloff = 0.0F;
        std::uint32_t index = 0;
        bool bothSides = false;

        Entry(const LightBounds& bounds, std::uint32_t index);
        Float3 axis() const { return {axes.least[0], axes.least[1], axes.least[2]}; }
    };
    /// Entries that are to become one child of a node.
    struct Set {
        std::uint32_t begin = 0, end = 0;
        float cost = 0.0F;
        std::uint32_t size() const { return end - begin; }
    };
    struct Halves {
        std::uint32_t middle = 0;
        float costs[2] = {};
    };
    /// How the axes of a set are compared: those with two sides are turned to a common one.
    struct Facing {
        bool bothSides = false;
        Float3 reference{0.0F};
        float sign(const Entry& entry) const {
            return bothSides && dot(entry.axis(), reference) < 0.0F ? -1.0F : 1.0F;
        }
    };
    struct Cluster;
    struct Summary;

    void buildNode(const Set& set, int level, std::uint64_t trail);
    std::vector<Set> childSets(const Set& set, int level);
    Halves splitByCost(const Set& set);
    Halves splitInHalves(const Set& set);
    Facing facingOf(const Set& set) const;
    Cluster clusterOf(const Set& set) const;
    void setLane(LightTreeNode& node, int lane, const Cluster& cluster, double share) const;

    std::vector<Entry> entries_; ///< sorted into place as sets are split
    LightTree& tree_;
    float size_ = 1.0F; ///< of the tree: a length for scales
    double strength_ = 0.0;
};

} // namespace mbfeat
