// The choice among up to eight: of the children of a node of the light tree, or of lights.
#pragma once

#include <algorithm>
#include <limits>

namespace mbfeat {

/// Weights for one receiver. Each is chosen with its share of the total.
struct alignas(32) LightWeights {
    static constexpr int kWidth = 8;

    float weight[kWidth];
    float total;

    /// From the weights, in an order that does not depend on the width of SIMD registers.
    void sum() {
        const float* w = weight;
        total = ((w[0] + w[1]) + (w[2] + w[3])) + ((w[4] + w[5]) + (w[6] + w[7]));
    }
    /// True where something can be chosen. All other functions want that.
    bool any() const { return total > 0.0F && total < std::numeric_limits<float>::infinity(); }
    float probability(int i) const { return weight[i] / total; }
    /// One of weight above zero, by u in [0, 1). What is left of u can be used again: it is uniform
    /// whatever was chosen.
    int choose(double& u) const {
        // Where the lanes begin, in double: float would lose what is weaker than its steps. Summed
        // so that the sequence rises whatever rounding does, and a lane of weight zero ends where
        // it begins.
        double w[kWidth];
        std::copy(weight, weight + kWidth, w);
        const double two = w[0] + w[1], four = two + (w[2] + w[3]), six = four + (w[4] + w[5]);
        const double begin[kWidth] = {0.0,  w[0],        two, two + w[2],
                                      four, four + w[4], six, six + w[6]};
        const double t = u * (begin[7] + w[7]);
        int lane = 0;
        for (int i = 1; i < kWidth; ++i) {
            lane += t >= begin[i] ? 1 : 0; // no branches: they could not be foreseen
        }
        // The last lane ends at the sum to rounding.
        while (!(weight[lane] > 0.0F)) {
            --lane;
        }
        u = std::clamp((t - begin[lane]) / w[lane], 0.0, 1.0 - 0x1p-53);
        return lane;
    }
};

} // namespace mbfeat
