// The choice among lights at infinity: environments and distant lights.
#pragma once

#include <vector>

#include "core/distribution.h"
#include "shading/lightBounds.h"
#include "shading/lightWeights.h"

namespace mbfeat {

struct LightPair;

/// Up to eight are weighed by what they can send to the receiver's side, like the clusters of one
/// node of the light tree. Of more, which no scene needs, one is chosen by strength alone, so that
/// the time does not grow.
class InfiniteLights {
public:
    InfiniteLights() = default;
    explicit InfiniteLights(const std::vector<LightBounds>& lights);

    std::size_t size() const { return size_; }
    /// Weights for the receiver: LightBounds::strength of each divided by scale(). Zero only for
    /// what is below the horizon of a one-sided receiver.
    void weigh(const LightReceiver& receiver, LightWeights& out) const;
    double scale() const { return scale_; }
    /// Of one light: its part of a choice between two lights.
    void describeOnly(LightPair& pair) const;

    /// Chooses a light by u in [0, 1); any() of the weights must hold.
    std::uint32_t choose(const LightWeights& weights, double u) const;
    float probability(const LightWeights& weights, std::uint32_t light) const;

private:
    bool byStrength() const { return size_ > LightWeights::kWidth; }

    std::size_t size_ = 0;
    double scale_ = 0.0;
    struct alignas(32) {
        float axisX[LightWeights::kWidth], axisY[LightWeights::kWidth], axisZ[LightWeights::kWidth];
        float lowest[LightWeights::kWidth]; ///< cosine to the normal below which nothing arrives
        float strength[LightWeights::kWidth];
    } lanes_ = {};
    AliasTable table_;
};

} // namespace mbfeat
