#include "shading/lightChoice.h"

#include <algorithm>

namespace mbfeat {

struct LightChoice::Weights {
    LightWeights local, infinite;
    float infiniteShare; ///< probability of the first step: 0 and 1 where there is none
    bool any;
};

LightChoice::LightChoice(std::vector<LightBounds> entries) {
    std::vector<LightBounds> infinite;
    places_.reserve(entries.size());
    for (std::uint32_t i = 0; i < entries.size(); ++i) {
        auto& names = entries[i].atInfinity ? infiniteEntries_ : localEntries_;
        places_.push_back(static_cast<std::uint32_t>(names.size()) +
                          (entries[i].atInfinity ? kInfinite : 0U));
        names.push_back(i);
        if (entries[i].atInfinity) {
            infinite.push_back(entries[i]);
        }
    }
    entries.erase(std::remove_if(entries.begin(), entries.end(),
                                 [](const LightBounds& bounds) { return bounds.atInfinity; }),
                  entries.end());
    tree_ = LightTree(entries);
    infinite_ = InfiniteLights(infinite);
    makePair();
}

void LightChoice::makePair() {
    if (localEntries_.size() != 1 || infiniteEntries_.size() != 1) {
        return;
    }
    LightPair pair;
    pair.localEntry = localEntries_.front();
    pair.infiniteEntry = infiniteEntries_.front();
    tree_.describeOnly(pair);
    infinite_.describeOnly(pair);
    pair_ = pair;
}

void LightChoice::weigh(const LightReceiver& receiver, Weights& out) const {
    bool local = false, infinite = false;
    if (!tree_.empty()) {
        tree_.weighRoot(receiver, out.local);
        local = out.local.any();
    }
    if (infinite_.size() > 0) {
        infinite_.weigh(receiver, out.infinite);
        infinite = out.infinite.any();
    }
    out.any = local || infinite;
    out.infiniteShare = infinite ? 1.0F : 0.0F;
    if (local && infinite) {
        const double near = static_cast<double>(out.local.total) * tree_.rootScale();
        const double far = static_cast<double>(out.infinite.total) * infinite_.scale();
        out.infiniteShare = mbfeat::infiniteShare(near, far);
    }
}

void LightChoice::sample(const LightReceiver* receivers, const float* u, int count,
                         Pick* picks) const {
    if (places_.size() == 1) {
        std::fill(picks, picks + count, Pick{0, 1.0F});
        return;
    }
    // Walks down the tree go on together; the others are at their end from the beginning.
    LightTree::Walk walks[kMostAtOnce];
    float localShares[kMostAtOnce];
    Weights weights;
    for (int i = 0; i < count; ++i) {
        localShares[i] = 0.0F;
        weigh(receivers[i], weights);
        if (!weights.any) {
            picks[i] = {};
            continue;
        }
        double v = moreBits(u[i], receivers[i].p);
        if (weights.infiniteShare > 0.0F) {
            const auto share = static_cast<double>(weights.infiniteShare);
            if (v < share) {
                const std::uint32_t light = infinite_.choose(weights.infinite, v / share);
                picks[i] = {infiniteEntries_[light],
                            weights.infiniteShare * infinite_.probability(weights.infinite, light)};
                continue;
            }
            v = std::min((v - share) / (1.0 - share), 1.0 - 0x1p-53);
        }
        localShares[i] = 1.0F - weights.infiniteShare;
        walks[i] = tree_.begin(weights.local, v);
    }
    tree_.descend(receivers, walks, count);
    for (int i = 0; i < count; ++i) {
        if (localShares[i] > 0.0F) {
            const LightTree::Pick pick = LightTree::arrived(walks[i]);
            picks[i] = {localEntries_[pick.entry], localShares[i] * pick.probability};
        }
    }
}

float LightChoice::probability(std::uint32_t entry, const LightReceiver& receiver) const {
    if (places_.size() == 1) {
        return 1.0F;
    }
    Weights weights;
    weigh(receiver, weights);
    const std::uint32_t place = places_[entry];
    if (place >= kInfinite) {
        return weights.infiniteShare > 0.0F
                   ? weights.infiniteShare *
                         infinite_.probability(weights.infinite, place - kInfinite)
                   : 0.0F;
    }
    return weights.any && weights.infiniteShare < 1.0F
               ? (1.0F - weights.infiniteShare) * tree_.probability(place, receiver, weights.local)
               : 0.0F;
}

} // namespace mbfeat
