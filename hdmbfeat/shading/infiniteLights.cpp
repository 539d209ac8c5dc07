#include "shading/infiniteLights.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "shading/lightPair.h"

namespace mbfeat {

namespace {

/// A weak light still counts as this share of the strongest one: it may be the only one that is not
/// in shadow.
constexpr double kWeakestShare = 0.05;

} // namespace

InfiniteLights::InfiniteLights(const std::vector<LightBounds>& lights) : size_(lights.size()) {
    std::vector<double> strengths;
    for (const LightBounds& light : lights) {
        strengths.push_back(light.strength);
        scale_ = std::max(scale_, light.strength);
    }
    for (double& s : strengths) {
        s = std::max(s / scale_, kWeakestShare);
    }
    if (byStrength()) {
        table_ = AliasTable(strengths);
        scale_ *= std::accumulate(strengths.begin(), strengths.end(), 0.0);
        return;
    }
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const LightBounds& light = lights[i];
        lanes_.axisX[i] = light.axis.x;
        lanes_.axisY[i] = light.axis.y;
        lanes_.axisZ[i] = light.axis.z;
        const bool overHalf = light.spread >= 0.5F * kPi;
        lanes_.lowest[i] = overHalf ? -2.0F : -std::sin(light.spread) - kCosineSlack;
        lanes_.strength[i] = static_cast<float>(strengths[i]);
    }
}

void InfiniteLights::weigh(const LightReceiver& receiver, LightWeights& out) const {
    if (byStrength()) {
        out.total = 1.0F;
        return;
    }
    for (int i = 0; i < LightWeights::kWidth; ++i) {
        const float along = fma(receiver.n.x, lanes_.axisX[i],
                                fma(receiver.n.y, lanes_.axisY[i], receiver.n.z * lanes_.axisZ[i]));
        // No cosine: a small light may be found by light sampling only, whatever the angle, and a
        // large one by scattering too.
        out.weight[i] = along >= lanes_.lowest[i] || receiver.twoSided ? lanes_.strength[i] : 0.0F;
    }
    out.sum();
}

void InfiniteLights::describeOnly(LightPair& pair) const {
    pair.axis = {lanes_.axisX[0], lanes_.axisY[0], lanes_.axisZ[0]};
    pair.lowest = lanes_.lowest[0];
    pair.strength = lanes_.strength[0];
    pair.infiniteScale = scale_;
}

std::uint32_t InfiniteLights::choose(const LightWeights& weights, double u) const {
    return byStrength() ? table_.sample(std::min(static_cast<float>(u), kOneMinusEpsilon)).index
                        : static_cast<std::uint32_t>(weights.choose(u));
}

float InfiniteLights::probability(const LightWeights& weights, std::uint32_t light) const {
    return byStrength() ? table_.probability(light) : weights.probability(static_cast<int>(light));
}

} // namespace mbfeat
