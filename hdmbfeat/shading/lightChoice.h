// Which light to sample for a receiver. First between the lights at infinity and those in the
// scene, by the irradiance that either can give at most, then among the former by that too, among
// the latter by a walk down the light tree.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "shading/infiniteLights.h"
#include "shading/lightPair.h"
#include "shading/lightTree.h"

namespace mbfeat {

class LightChoice {
public:
    LightChoice() = default;
    /// Entries are named by their index in the list.
    explicit LightChoice(std::vector<LightBounds> entries);

    bool empty() const { return places_.empty(); }

    struct Pick {
        std::uint32_t entry = 0;
        float probability = 0.0F; ///< 0: no light arrives at the receiver
    };
    /// Choices for as many receivers at once as SIMD lanes have at most.
    static constexpr int kMostAtOnce = 16;
    /// u in [0, 1). No entry that lights the receiver has probability zero.
    Pick sample(const LightReceiver& receiver, float u) const {
        Pick pick;
        sample(&receiver, &u, 1, &pick);
        return pick;
    }
    void sample(const LightReceiver* receivers, const float* u, int count, Pick* picks) const;
    /// The probability with which sample() picks the entry: the same float.
    float probability(std::uint32_t entry, const LightReceiver& receiver) const;

    const LightTree& tree() const { return tree_; }

    /// Where all there is to choose from is one light in the scene and one at infinity: the choice
    /// between them, for many receivers at a time.
    const LightPair* pair() const { return pair_ ? &*pair_ : nullptr; }

private:
    struct Weights;
    void makePair();
    void weigh(const LightReceiver& receiver, Weights& out) const;

    LightTree tree_;
    InfiniteLights infinite_;
    /// Of an entry: its index in the tree, or kInfinite + that among the lights at infinity.
    std::vector<std::uint32_t> places_;
    std::vector<std::uint32_t> localEntries_, infiniteEntries_; ///< and back
    std::optional<LightPair> pair_;

    static constexpr std::uint32_t kInfinite = 0x80000000U;
};

} // namespace mbfeat
