// The path encoder on a lane type; see pathEncoder.h. Internal.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/laneMemory.h"
#include "core/laneQuads.h"
#include "denoise/pathEncoder.h"
#include "denoise/splat.h"

namespace mbfeat {

template <class T>
class PathEncoderLanes {
public:
    PathEncoderLanes(const PathEncoder& encoder, const float* channels)
        : encoder_(encoder),
          channels_(channels),
          perScale_(1.0F / encoder.logScale) {}

    /// Embeddings of the lanes' paths and what follows them, [output].
    const T* run() {
        int size = addCommon(features_.data());
        size += addFirstNonDelta(features_.data() + size);
        if (encoder_.vertex.empty()) {
            for (int k = 0; k < encoder_.vertices; ++k) {
                size += addVertex(k, features_.data() + size);
            }
        } else {
            size += addVertex(0, features_.data() + size);
            size += addShared(features_.data() + size);
        }
        const T* const embedding = layers(encoder_.embedding, features_.data(), size);
        if (encoder_.guides == 0) {
            return embedding;
        }
        const T* const found = features_.data() + extended::kCommon; // addFirstNonDelta()'s
        T* const out = std::copy_n(embedding, encoder_.embeddingWidth(), outputs_.data());
        std::copy_n(found, guides::kWithoutRoughness, out);
        if (hasRoughness()) {
            out[kRoughness] = foundRoughness_;
        }
        if (encoder_.hasWays) {
            fillGuides(found[kFound], out);
        }
        return outputs_.data();
    }

    /// What a colour of the radiance is divided by, after run(): see demodulator() in
    /// training/model/encoding.py.
    T divisor(int i) const {
        const T* const found = features_.data() + extended::kCommon; // addFirstNonDelta()'s
        const T albedo = min(max(found[i] * found[7 + i], T(kLeastAlbedo)), T(kMostAlbedo));
        return select(found[kFound] > T(0.5F), albedo, T(1.0F));
    }

private:
    static constexpr int kWidth = LaneTraits<T>::kWidth;
    static constexpr float kLeastAlbedo = 0.05F, kMostAlbedo = 4.0F;
    static constexpr int kFound = 10; ///< of addFirstNonDelta(): whether there is one
    static constexpr int kRoughness = guides::kCount - 1; ///< of guides, the last one
    static constexpr int kMost = 256;                     ///< features, and outputs of a layer
    static constexpr float kDepthScale = 0.3F, kSlope = 0.01F, kLargestTint = 4.0F;

    T channel(int index) const {
        return loadLanes<T>(channels_ + static_cast<std::ptrdiff_t>(index) * kPathGroup);
    }
    T feature(int k, int i) const { return channel(extended::kFeatures + 9 * k + i); }
    T valid(int k) const { return channel(extended::kValid + k); }
    T roughness(int k) const { return channel(extended::kExtended + 5 * k); }
    T distance(int k) const { return channel(extended::kExtended + 5 * k + 1); }
    T throughput(int k, int i) const { return channel(extended::kExtended + 5 * k + 2 + i); }
    T event(int k, int i) const { return channel(extended::kEvents + 4 * k + i); }

    static T logOnePlus(const T& x) { return log(T(1.0F) + max(x, T(0.0F))); }
    T logScaled(const T& x) const { return logOnePlus(x) * T(perScale_); }

    int addCommon(T* out) const {
        for (int i = 0; i < 3; ++i) {
            out[i] = logScaled(channel(i));
        }
        out[3] = channel(3);
        out[4] = channel(4);
        out[5] = T(kDepthScale) * logOnePlus(channel(5));
        return extended::kCommon;
    }

    bool hasRoughness() const { return encoder_.guides > kRoughness; }

    /// Albedo, normal, depth, throughput and whether there is one; foundRoughness_, too.
    int addFirstNonDelta(T* out) {
        constexpr int kSize = kFound + 1;
        std::fill(out, out + kSize, T(0.0F));
        T before(1.0F), length(0.0F);
        foundRoughness_ = T(0.0F);
        for (int k = 0; k < extended::kVertices; ++k) {
            const T here = before * valid(k) * (T(1.0F) - event(k, 0));
            length = length + distance(k);
            for (int i = 0; i < 6; ++i) {
                out[i] = fma(here, feature(k, i), out[i]);
            }
            out[6] = fma(here, T(kDepthScale) * logOnePlus(length), out[6]);
            for (int i = 0; i < 3; ++i) {
                const T tint = min(max(throughput(k, i), T(0.0F)), T(kLargestTint));
                out[7 + i] = fma(here, tint, out[7 + i]);
            }
            out[kFound] = out[kFound] + here;
            foundRoughness_ = fma(here, roughness(k), foundRoughness_);
            before = before * (T(1.0F) - here);
        }
        return kSize;
    }

    /// Where there is none, those of the last recorded vertex.
    void fillGuides(const T& found, T* out) const {
        const Mask<T> isThere = found > T(0.5F);
        if (all(isThere)) {
            return;
        }
        T length(0.0F);
        for (int k = 0; k < extended::kVertices; ++k) {
            length = length + distance(k);
            const T next = k + 1 < extended::kVertices ? valid(k + 1) : T(0.0F);
            const T here = select(isThere, T(0.0F), valid(k) * (T(1.0F) - next));
            for (int i = 0; i < 6; ++i) {
                out[i] = fma(here, feature(k, i), out[i]);
            }
            out[6] = fma(here, T(kDepthScale) * logOnePlus(length), out[6]);
            if (hasRoughness()) {
                out[kRoughness] = fma(here, roughness(k), out[kRoughness]);
            }
        }
    }

    int addVertex(int k, T* out) const {
        for (int i = 0; i < 6; ++i) {
            out[i] = feature(k, i);
        }
        for (int i = 0; i < 3; ++i) {
            const T direct = feature(k, 6 + i), weight = throughput(k, i);
            out[6 + i] = logScaled(weight * direct);
            out[16 + i] = weight / (weight + T(0.1F));
            out[19 + i] = logScaled(direct);
        }
        out[9] = valid(k);
        for (int i = 0; i < 4; ++i) {
            out[10 + i] = event(k, i);
        }
        out[14] = roughness(k);
        out[15] = T(kDepthScale) * logOnePlus(distance(k));
        return 22;
    }

    /// The sum over vertices of what the shared network makes of them.
    int addShared(T* out) {
        const int size = encoder_.vertex.back().outputs;
        std::fill(out, out + size, T(0.0F));
        for (int k = 0; k < encoder_.vertices; ++k) {
            const T isValid = valid(k);
            if (none(isValid != T(0.0F))) {
                continue;
            }
            const int inputs = addVertex(k, row_.data());
            const T* const encoded =
                layers(encoder_.vertex, row_.data(), inputs,
                       encoder_.vertexBias[static_cast<std::size_t>(k)].data());
            for (int i = 0; i < size; ++i) {
                out[i] = fma(isValid, encoded[i], out[i]);
            }
        }
        return size;
    }

    /// `firstBias`, if any, in place of the first one's bias.
    const T* layers(const std::vector<DenseLayer>& all, const T* inputs, int size,
                    const float* firstBias = nullptr) {
        T* out = first_.data();
        T* spare = second_.data();
        for (const DenseLayer& layer : all) {
            const float* const bias = firstBias != nullptr ? firstBias : layer.bias.data();
            dense(layer, inputs, std::min(size, layer.inputs), bias, out);
            firstBias = nullptr;
            inputs = out;
            size = layer.outputs;
            std::swap(out, spare);
        }
        return inputs;
    }

    /// The weights of inputs from `size` on are not looked at.
    static void dense(const DenseLayer& layer, const T* inputs, int size, const float* bias,
                      T* out) {
        constexpr int kBlock = DenseLayer::kBlock;
        const float* weights = layer.weights.data();
        for (int block = 0; block < layer.blocks(); ++block) {
            std::array<T, kBlock> sum;
            for (int o = 0; o < kBlock; ++o) {
                sum[static_cast<std::size_t>(o)] = T(bias[block * kBlock + o]);
            }
            for (int i = 0; i < size; ++i, weights += kBlock) {
                const T x = inputs[i];
                for (int o = 0; o < kBlock; ++o) {
                    sum[static_cast<std::size_t>(o)] =
                        fma(x, T(weights[o]), sum[static_cast<std::size_t>(o)]);
                }
            }
            weights += static_cast<std::ptrdiff_t>(layer.inputs - size) * kBlock;
            for (int o = 0; o < kBlock; ++o) {
                const T value = sum[static_cast<std::size_t>(o)];
                out[block * kBlock + o] = max(value, value * T(kSlope));
            }
        }
    }

    const PathEncoder& encoder_;
    const float* channels_;
    float perScale_;
    std::array<T, kMost> features_, first_, second_, outputs_;
    std::array<T, 32> row_;
    T foundRoughness_;
};

/// encodePaths() but for the classes, on a lane type.
template <class T>
void encodePathsOnLanes(const PathEncoder& encoder, const float* channels, int count,
                        float* embeddings, float* divisors) {
    constexpr int kWidth = LaneTraits<T>::kWidth;
    const int width = encoder.width();
    for (int first = 0; first < count; first += kWidth) {
        PathEncoderLanes<T> lanes(encoder, channels + first);
        const T* const found = lanes.run();
        const int here = std::min(kWidth, count - first);
        for (int i = 0; divisors != nullptr && i < 3; ++i) {
            storeLanes<T>(divisors + i * kPathGroup + first, lanes.divisor(i));
        }
        float* const to = embeddings + static_cast<std::ptrdiff_t>(first) * width;
        int o = 0;
        if (here == kWidth) {
            const auto row = [&](int lane) {
                return to + static_cast<std::ptrdiff_t>(lane) * width;
            };
            for (; o + 4 <= width; o += 4) {
                const LaneQuad<T> quad(found[o], found[o + 1], found[o + 2], found[o + 3]);
                storeQuadsAt<T>([&](int lane) { return row(lane) + o; }, quad);
            }
        }
        for (; o < width; ++o) {
            const LaneBuffer<T> values(found[o]);
            for (int lane = 0; lane < here; ++lane) {
                to[lane * width + o] = values[lane];
            }
        }
    }
}

} // namespace mbfeat
