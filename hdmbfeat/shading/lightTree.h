// A hierarchy over lights of finite position, from which one is chosen by how much it can light a
// receiver: in a time that grows with the logarithm of the number of lights.
//
// The binary tree of Conty Estevez and Kulla 2018, three levels of which make one node here: its
// eight children are weighed at once, in SIMD lanes, and the choice among them sees bounds three
// levels finer than the choice between two halves would.
#pragma once

#include <cstdint>
#include <vector>

#include "shading/lightBounds.h"
#include "shading/lightWeights.h"

namespace mbfeat {

struct LightPair;

/// Up to eight clusters. An array a quantity, so that lanes are loaded without shuffling.
struct alignas(64) LightTreeNode {
    static constexpr int kWidth = LightWeights::kWidth;

    // ClusterLanes of the children. Strengths are relative within the node, times the squared size
    // of the tree, so that weights are far from the ends of the range of floats. Unused lanes have
    // 0.
    float centerX[kWidth], centerY[kWidth], centerZ[kWidth], radius[kWidth];
    float axisX[kWidth], axisY[kWidth], axisZ[kWidth];
    float cosSpread[kWidth], sinSpread[kWidth], cosFalloff[kWidth], strength[kWidth];
    /// Index of a node, or kLeaf + the entry.
    std::uint32_t child[kWidth];

    static constexpr std::uint32_t kLeaf = 0x80000000U;
};

class LightTree {
public:
    LightTree() = default;
    /// The entries are named by their index; none is at infinity.
    explicit LightTree(const std::vector<LightBounds>& entries);

    bool empty() const { return nodes_.empty(); }

    /// Weights at the root. Their total times rootScale() estimates the irradiance at the receiver,
    /// shadows left out; it is zero only where no light of the tree arrives.
    void weighRoot(const LightReceiver& receiver, LightWeights& out) const {
        weigh(nodes_.front(), receiver, out);
    }
    double rootScale() const { return rootScale_; }
    /// Of a tree of one entry: its part of a choice between two lights.
    void describeOnly(LightPair& pair) const;

    struct Pick {
        std::uint32_t entry = 0;
        float probability = 0.0F;
    };
    /// A walk down the tree.
    struct Walk {
        std::uint32_t place = LightTreeNode::kLeaf; ///< as LightTreeNode::child
        float probability = 0.0F;                   ///< of coming there
        double u = 0.0;                             ///< what is left of the number
    };
    /// Begins a walk with u in [0, 1), given the weights of weighRoot(), of which any() must hold.
    Walk begin(const LightWeights& root, double u) const;
    /// Ends walks, each for its receiver: level by level, since the steps of one wait for each
    /// other.
    void descend(const LightReceiver* receivers, Walk* walks, int count) const;
    static Pick arrived(const Walk& walk) {
        return {walk.place - LightTreeNode::kLeaf, walk.probability};
    }
    Pick sample(const LightReceiver& receiver, const LightWeights& root, double u) const {
        Walk walk = begin(root, u);
        descend(&receiver, &walk, 1);
        return arrived(walk);
    }
    /// The probability that sample() returns, bit for bit.
    float probability(std::uint32_t entry, const LightReceiver& receiver,
                      const LightWeights& root) const;

    std::size_t nodeCount() const { return nodes_.size(); }
    /// Levels of nodes on the way to the deepest entry.
    int depth() const { return depth_; }

    /// The trail of an entry is 64 bits: three a level.
    static constexpr int kMaxDepth = 21;

private:
    friend class LightTreeBuilder;
    void weigh(const LightTreeNode& node, const LightReceiver& receiver, LightWeights& out) const;
    void weighInner(const LightTreeNode& node, const LightReceiver& receiver,
                    LightWeights& out) const;

    std::vector<LightTreeNode> nodes_;
    /// An entry's lane at each level, three bits each, the root's lowest.
    std::vector<std::uint64_t> trails_;
    float leastInverse_ = 0.0F;
    double rootScale_ = 0.0;
    int depth_ = 0;
};

} // namespace mbfeat
