#include "shading/lightChoice.h"

#include <algorithm>
#include <cstring>

namespace mbfeat {

namespace {

/// Neither the lights at infinity nor those in the scene are chosen less often than this where both
/// can light. Nothing is known of what stands before either, and of where in the tree's bounds the
/// lights are; so much bounds the noise of a wrong guess.
constexpr double kLeastShare = 0.1;

/// A random number of 53 bits out of one of 24 bits, which come first. Where lights are many, 24
/// are too few: one of a million would have 17 numbers to be chosen by. The others are mixed from
/// the number and the receiver (SplitMix64, Steele et al. 2014).
double moreBits(float u, const Float3& p) {
    std::uint32_t words[4];
    const float floats[4] = {u, p.x, p.y, p.z};
    std::memcpy(words, floats, sizeof(words));
    std::uint64_t x =
        (static_cast<std::uint64_t>(words[0]) << 32U | words[1]) ^
        (static_cast<std::uint64_t>(words[2]) << 32U | words[3]) * 0x9E3779B97F4A7C15ULL;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
    return static_cast<double>(u) + static_cast<double>(x >> 35U) * 0x1p-53;
}

} // namespace

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
        out.infiniteShare =
            static_cast<float>(std::clamp(far / (near + far), kLeastShare, 1.0 - kLeastShare));
    }
}

LightChoice::Pick LightChoice::sample(const LightReceiver& receiver, float u) const {
    if (places_.size() == 1) {
        return {0, 1.0F};
    }
    Weights weights;
    weigh(receiver, weights);
    if (!weights.any) {
        return {};
    }
    double v = moreBits(u, receiver.p);
    if (weights.infiniteShare > 0.0F) {
        const auto share = static_cast<double>(weights.infiniteShare);
        if (v < share) {
            const std::uint32_t i = infinite_.choose(weights.infinite, v / share);
            return {infiniteEntries_[i],
                    weights.infiniteShare * infinite_.probability(weights.infinite, i)};
        }
        v = std::min((v - share) / (1.0 - share), 1.0 - 0x1p-53);
    }
    const LightTree::Pick pick = tree_.sample(receiver, weights.local, v);
    return {localEntries_[pick.entry], (1.0F - weights.infiniteShare) * pick.probability};
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
