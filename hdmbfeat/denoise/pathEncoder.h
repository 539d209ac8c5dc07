// What a layered network computes for each path, written out: the features that it is given of the
// `extended` channels, a network shared over vertices, and the path's embedding.
//
// It does what the model's own graph of samples does (training/model/encoding.py, Encoding and
// Sksn.class_sums), several times faster: all of it stays in registers and the first-level cache,
// and vertices that no path reached are skipped. Formulas: Gharbi et al. 2019, section 4.3, for the
// scaled logarithm of radiance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "denoise/channels.h"

namespace mbfeat {

/// A layer: outputs = leakyReLU(weights x inputs + bias).
struct DenseLayer {
    static constexpr int kBlock = 8; ///< outputs that are computed together
    int inputs = 0, outputs = 0;
    std::vector<float> weights; ///< [outputs / kBlock][inputs][kBlock], padded with zeros
    std::vector<float> bias;    ///< padded too

    int blocks() const { return (outputs + kBlock - 1) / kBlock; }
};

/// Offsets among the channels of the feature set `extended`, see training/model/inputs.py.
namespace extended {
inline constexpr int kVertices = 6;
inline constexpr int kCommon = 6; ///< R, G, B, subpixel.X, subpixel.Y, Z
inline constexpr int kFeatures = kCommon;
inline constexpr int kValid = kFeatures + 9 * kVertices;
inline constexpr int kExtended = kValid + kVertices; ///< roughness, distance, throughput
inline constexpr int kEvents = kExtended + 5 * kVertices;
inline constexpr int kChannels = kEvents + 4 * kVertices;
} // namespace extended

/// How a path came to its first vertex that is no mirror nor clear glass: past no mirror, by a
/// reflection at its first vertex, by one later on.
enum class PathWay : std::uint8_t { kStraight, kReflectedFirst, kReflectedLater };
inline constexpr int kPathWays = 3;

struct PathEncoder {
    float logScale = 1.0F;
    std::vector<DenseLayer> vertex; ///< empty: the vertices' features are given as they are
    /// Of the first of these by vertex, padded: the bias, and the weights of the inputs that tell
    /// which vertex it is, of which one is 1 and the others 0.
    std::vector<std::vector<float>> vertexBias;
    std::vector<DenseLayer> embedding; ///< the last one's outputs are the embedding
    /// How many features of the first vertex that is no mirror follow it as they are: those of
    /// guides in splat.h, or none.
    int guides = 0;
    /// Whether guides are summed up by the way to that vertex (PathWay); the last recorded vertex
    /// then stands for one that is not there.
    bool hasWays = false;
    int vertices = extended::kVertices; ///< that are looked at, from the camera on

    /// Values of a path, guides included.
    int width() const { return embeddingWidth() + guides; }
    int embeddingWidth() const { return embedding.empty() ? 0 : embedding.back().outputs; }
    /// Sums of a class: its values', and how many paths there are, with ways of each.
    int planes() const {
        return hasWays ? embeddingWidth() + kPathWays * (guides + 1) : width() + 1;
    }

    /// Makes vertexBias of `vertex`, as it has to be before paths are encoded.
    void findVertexBias();

    /// Of the bytes in the metadata of a model, which before format 4 had no counts of guides and
    /// vertices; nothing where they make no sense.
    static std::optional<PathEncoder> read(const std::string& bytes, bool hasCounts);
};

enum class PathClass : std::uint8_t { kDirect, kReflected, kTransmitted };

/// Embeddings, guides included, [path][width] and classes of `count` paths, at most kPathGroup,
/// whose channels are [channel][kPathGroup]; channels of paths beyond `count` are to be zero. On
/// the widest lanes. `divisors`, which may be null, become the albedos [3][kPathGroup] that
/// radiance is divided by.
void encodePaths(const PathEncoder& encoder, const float* channels, int count, float* embeddings,
                 PathClass* classes, float* divisors);

/// Of the same channels, the ways of the paths.
void findWays(const float* channels, int count, PathWay* ways);

} // namespace mbfeat
