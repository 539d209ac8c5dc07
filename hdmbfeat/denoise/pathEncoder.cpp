#include "denoise/pathEncoder.h"

#include <cmath>
#include <cstring>

#include "core/floatTraps.h"
#include "core/library.h"
#include "denoise/splat.h"

extern "C" void encodeOnLanes(const mbfeat::PathEncoder* encoder, const float* channels, int count,
                              float* embeddings, float* divisors);

namespace mbfeat {

namespace {

constexpr int kMostOutputs = 256;
constexpr int kCommonFeatures =
    extended::kCommon + 11; ///< with those of the first non-delta vertex
constexpr int kVertexFeatures = 22;

/// Little-endian numbers one after the other.
class Reader {
public:
    explicit Reader(const std::string& bytes) : bytes_(bytes) {}

    bool isAtEnd() const { return !failed_ && place_ == bytes_.size(); }
    template <class N>
    N number() {
        N value{};
        if (bytes_.size() - place_ < sizeof(N)) {
            failed_ = true;
            return value;
        }
        std::memcpy(&value, bytes_.data() + place_, sizeof(N));
        place_ += sizeof(N);
        return value;
    }

    /// A count of layers, each inputs, outputs, weights [output][input] and bias.
    std::vector<DenseLayer> layers(int inputs) {
        std::vector<DenseLayer> found;
        const auto count = number<std::int32_t>();
        for (int i = 0; i < count && !failed_; ++i) {
            DenseLayer layer;
            layer.inputs = number<std::int32_t>();
            layer.outputs = number<std::int32_t>();
            failed_ = failed_ || layer.inputs != inputs || layer.outputs < 1 ||
                      layer.outputs > kMostOutputs;
            if (failed_) {
                break;
            }
            inputs = layer.outputs;
            readNumbers(layer);
            found.push_back(std::move(layer));
        }
        return found;
    }
    void fail() { failed_ = true; }

private:
    void readNumbers(DenseLayer& layer) {
        constexpr int kBlock = DenseLayer::kBlock;
        const std::size_t padded = static_cast<std::size_t>(layer.blocks()) * kBlock;
        layer.weights.assign(padded * static_cast<std::size_t>(layer.inputs), 0.0F);
        layer.bias.assign(padded, 0.0F);
        for (int o = 0; o < layer.outputs; ++o) {
            for (int i = 0; i < layer.inputs; ++i) {
                const auto row =
                    static_cast<std::size_t>(o / kBlock) * static_cast<std::size_t>(layer.inputs) +
                    static_cast<std::size_t>(i);
                layer.weights[row * kBlock + static_cast<std::size_t>(o % kBlock)] = finite();
            }
        }
        for (int o = 0; o < layer.outputs; ++o) {
            layer.bias[static_cast<std::size_t>(o)] = finite();
        }
    }
    float finite() {
        const auto value = number<float>();
        failed_ = failed_ || !std::isfinite(value);
        return value;
    }

    const std::string& bytes_;
    std::size_t place_ = 0;
    bool failed_ = false;
};

} // namespace

void PathEncoder::findVertexBias() {
    if (vertex.empty()) {
        return;
    }
    constexpr auto kBlock = static_cast<std::size_t>(DenseLayer::kBlock);
    const DenseLayer& layer = vertex.front();
    vertexBias.assign(extended::kVertices, layer.bias);
    for (std::size_t k = 0; k < vertexBias.size(); ++k) {
        for (std::size_t o = 0; o < layer.bias.size(); ++o) {
            const std::size_t row =
                o / kBlock * static_cast<std::size_t>(layer.inputs) + kVertexFeatures + k;
            vertexBias[k][o] += layer.weights[row * kBlock + o % kBlock];
        }
    }
}

std::optional<PathEncoder> PathEncoder::read(const std::string& bytes, bool hasCounts) {
    Reader reader(bytes);
    PathEncoder encoder;
    encoder.logScale = reader.number<float>();
    if (hasCounts) {
        encoder.guides = reader.number<std::int32_t>();
        encoder.vertices = reader.number<std::int32_t>();
    }
    if (encoder.vertices < 1 || encoder.vertices > extended::kVertices) {
        return std::nullopt;
    }
    encoder.vertex = reader.layers(kVertexFeatures + extended::kVertices);
    const int vertices = encoder.vertex.empty() ? encoder.vertices * kVertexFeatures
                                                : kVertexFeatures + encoder.vertex.back().outputs;
    encoder.embedding = reader.layers(kCommonFeatures + vertices);
    if (!reader.isAtEnd() || encoder.embedding.empty() || !(encoder.logScale > 0.0F) ||
        (encoder.guides != 0 && !guides::isCount(encoder.guides)) ||
        encoder.width() > kMostOutputs || kCommonFeatures + vertices > kMostOutputs) {
        return std::nullopt;
    }
    encoder.findVertexBias();
    return encoder;
}

void encodePaths(const PathEncoder& encoder, const float* channels, int count, float* embeddings,
                 PathClass* classes, float* divisors) {
    static const auto encode = widest("encodeOnWideLanes", &encodeOnLanes);
    const FloatTrapsMasked masked;
    encode(&encoder, channels, count, embeddings, divisors);
    const auto event = [&](int i, int path) {
        return channels[(extended::kEvents + i) * kPathGroup + path] != 0.0F;
    };
    for (int path = 0; path < count; ++path) {
        // Events of vertex 0 are specular, reflect, transmit, diffuse.
        const bool reflected = event(1, path) && !event(3, path);
        classes[path] = event(2, path) ? PathClass::kTransmitted
                        : reflected    ? PathClass::kReflected
                                       : PathClass::kDirect;
    }
}

void findWays(const float* channels, int count, PathWay* ways) {
    const auto is = [&](int channel, int path) {
        return channels[channel * kPathGroup + path] != 0.0F;
    };
    for (int path = 0; path < count; ++path) {
        ways[path] = PathWay::kStraight;
        for (int k = 0; k < extended::kVertices; ++k) {
            const int specular = extended::kEvents + 4 * k, reflect = specular + 1;
            if (!is(extended::kValid + k, path) || !is(specular, path)) {
                break;
            }
            if (is(reflect, path)) {
                ways[path] = k == 0 ? PathWay::kReflectedFirst : PathWay::kReflectedLater;
                break;
            }
        }
    }
}

} // namespace mbfeat
