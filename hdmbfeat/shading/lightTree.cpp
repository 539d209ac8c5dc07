#include "shading/lightTree.h"

#include <cmath>

#include "core/floatTraps.h"
#include "shading/lightPair.h"

namespace mbfeat {

namespace {

constexpr int kWidth = LightTreeNode::kWidth;

using Lanes = ClusterBatch;
constexpr int kLanes = LaneTraits<Lanes>::kWidth;

Lanes load(const float* p) {
    return Lanes::load_aligned(p);
}

ClusterLanes<Lanes> clusters(const LightTreeNode& node, int i) {
    return {{load(node.centerX + i), load(node.centerY + i), load(node.centerZ + i)},
            load(node.radius + i),
            {load(node.axisX + i), load(node.axisY + i), load(node.axisZ + i)},
            load(node.cosSpread + i),
            load(node.sinSpread + i),
            load(node.cosFalloff + i),
            load(node.strength + i)};
}

} // namespace

void LightTree::weigh(const LightTreeNode& node, const LightReceiver& receiver,
                      LightWeights& out) const {
    const FloatTrapsMasked lanes;
    for (int i = 0; i < kWidth; i += kLanes) {
        importance(clusters(node, i), receiver.p, receiver.n, receiver.twoSided, leastInverse_)
            .store_aligned(out.weight + i);
    }
    out.sum();
}

void LightTree::describeOnly(LightPair& pair) const {
    const LightTreeNode& node = nodes_.front();
    const auto lane = static_cast<std::size_t>(trails_.front() % kWidth);
    pair.local = {{node.centerX[lane], node.centerY[lane], node.centerZ[lane]},
                  node.radius[lane],
                  {node.axisX[lane], node.axisY[lane], node.axisZ[lane]},
                  node.cosSpread[lane],
                  node.sinSpread[lane],
                  node.cosFalloff[lane],
                  node.strength[lane]};
    pair.leastInverse = leastInverse_;
    pair.localScale = rootScale_;
}

/// Below the root one child has to be taken: bounds of children may show that none of the light
/// which the parent's bounds allow for arrives.
void LightTree::weighInner(const LightTreeNode& node, const LightReceiver& receiver,
                           LightWeights& out) const {
    weigh(node, receiver, out);
    if (!out.any()) {
        for (int i = 0; i < kWidth; ++i) {
            out.weight[i] = std::abs(node.strength[i]);
        }
        out.sum();
    }
}

LightTree::Walk LightTree::begin(const LightWeights& root, double u) const {
    const int lane = root.choose(u);
    return {nodes_.front().child[lane], root.probability(lane), u};
}

void LightTree::descend(const LightReceiver* receivers, Walk* walks, int count) const {
    LightWeights weights;
    for (bool walking = true; walking;) {
        walking = false;
        for (int i = 0; i < count; ++i) {
            Walk& walk = walks[i];
            if (walk.place >= LightTreeNode::kLeaf) {
                continue;
            }
            const LightTreeNode& node = nodes_[walk.place];
            weighInner(node, receivers[i], weights);
            const int lane = weights.choose(walk.u);
            walk.probability *= weights.probability(lane);
            walk.place = node.child[lane];
            walking = true;
        }
    }
}

float LightTree::probability(std::uint32_t entry, const LightReceiver& receiver,
                             const LightWeights& root) const {
    std::uint64_t trail = trails_[entry];
    const auto next = [&] {
        const int lane = static_cast<int>(trail % kWidth);
        trail /= kWidth;
        return lane;
    };
    int lane = next();
    float probability = root.probability(lane);
    std::uint32_t child = nodes_.front().child[lane];
    LightWeights weights;
    while (child < LightTreeNode::kLeaf) {
        const LightTreeNode& node = nodes_[child];
        weighInner(node, receiver, weights);
        lane = next();
        probability *= weights.probability(lane);
        child = node.child[lane];
    }
    return probability;
}

} // namespace mbfeat
