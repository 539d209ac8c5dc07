// What one light path met on its way: the multi-bounce path features.
//
// A path has vertices k = 0..5; vertex 0 is the first camera hit. The integrator fills a record a
// path; the film adds it up. The record is plain floats, so that AOVs are offsets into it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "core/vec.h"

namespace mbfeat {

inline constexpr int kFeatureVertices = 6;
inline constexpr int kMaxPrimvarAovs = 8;

/// Which parts of the record somebody reads. The integrator may leave the others at zero.
enum RecordFlags : std::uint32_t {
    kRecordColor = 0, ///< radiance and alpha are always there
    kRecordFeatures = 1U << 0U,
    kRecordContributions = 1U << 1U,
    kRecordExtended = 1U << 2U,
    kRecordFirstNonDelta = 1U << 3U,
    kRecordFirstHit = 1U << 4U,
    kRecordPrimvars = 1U << 5U,
};

/// Flags that make the path itself be recorded vertex by vertex.
inline constexpr std::uint32_t kPathRecordFlags =
    kRecordFeatures | kRecordExtended | kRecordFirstNonDelta;

/// Bits of VertexExtended::event. At an emitter that ends the path only kEventEmission is set.
enum PathEvent : std::uint32_t {
    kEventReflect = 1U << 0U,
    kEventTransmit = 1U << 1U,
    kEventDiffuse = 1U << 2U,
    kEventGlossy = 1U << 3U,
    kEventSpecular = 1U << 4U, ///< delta
    kEventEmission = 1U << 5U,
};

/// The paper's nine values of a vertex, in channel order.
struct VertexFeatures {
    Float3 albedo{0.0F}; ///< 0..1; texture colour after all look-ups
    Float3 normal{0.0F}; ///< shading normal, world space, facing the ray, -1..1
    Float3 direct{0.0F}; ///< light-sampled term with MIS, before path throughput
};

struct VertexExtended {
    float roughness = 0.0F;  ///< of the lobe that continued the path; 1 for diffuse
    float distance = 0.0F;   ///< from the previous vertex, scene units
    Float3 throughput{0.0F}; ///< of the path up to this vertex
    std::int32_t event = 0;  ///< PathEvent bits of the scattering that left this vertex
};

/// Aligned so that what every path writes, up to vertexCount, is in one cache line.
struct alignas(64) PathRecord {
    Rgb radiance{0.0F}; ///< the sample's estimate of `color`
    float alpha = 0.0F; ///< 1 where the camera ray met something that is not the background
    Float2 subpixel{0.5F, 0.5F}; ///< position in the pixel, 0..1; outside with a wide filter
    float filterWeight = 1.0F;
    bool nonFinite = false;       ///< the sample was not finite and was replaced by zero
    std::uint8_t vertexCount = 0; ///< vertices reached, at most 6: the valid mask is (1 << n) - 1

    // Per-vertex features: contiguous, vertex-major, albedo, normal, direct.
    VertexFeatures features[kFeatureVertices];
    /// Emission seen by the camera ray, what each vertex adds, and what all later ones add. Their
    /// sum is radiance, to rounding.
    Rgb emission{0.0F};
    Rgb contributions[kFeatureVertices] = {Rgb(0.0F), Rgb(0.0F), Rgb(0.0F),
                                           Rgb(0.0F), Rgb(0.0F), Rgb(0.0F)};
    Rgb tail{0.0F};
    VertexExtended extended[kFeatureVertices];

    // First vertex with a lobe that is not a delta: what a mirror shows, what stands behind glass.
    Float3 nonDeltaAlbedo{0.0F};
    Float3 nonDeltaNormal{0.0F};
    float nonDeltaDepth = 0.0F; ///< path length to it, scene units
    Float3 nonDeltaTint{0.0F};  ///< throughput up to it, Fresnel choice divided out

    // The camera ray's hit. Ids are -1 and distances 0 at the background.
    std::int32_t primId = -1;
    std::int32_t instanceId = -1;
    std::int32_t elementId = -1;
    float depth = 1.0F;               ///< Hydra depth: projected, 0 near .. 1 far
    float cameraDepth = 0.0F;         ///< distance along the view axis, scene units
    float distance = 0.0F;            ///< distance along the ray
    Float3 normal{0.0F};              ///< world-space shading normal, facing the ray
    Float3 eyeNormal{0.0F};           ///< the same in camera space
    Float4 primvars[kMaxPrimvarAovs]; ///< values of the requested primvars:*

    std::uint32_t validMask() const { return (1U << static_cast<unsigned>(vertexCount)) - 1U; }
};

/// Bytes of a record up to the last part that is recorded, in whole cache lines. The parts lie in
/// the order of what is asked for most: `color` alone takes one line.
constexpr std::size_t recordBytes(std::uint32_t recordFlags) {
    std::size_t end = offsetof(PathRecord, features);
    const auto add = [&end, recordFlags](std::uint32_t flag, std::size_t partEnd) {
        end = (recordFlags & flag) != 0 ? partEnd : end;
    };
    // Lanes write quads: one more float than the last vector has.
    add(kRecordFeatures, offsetof(PathRecord, emission) + sizeof(float));
    add(kRecordContributions, offsetof(PathRecord, extended) + sizeof(float));
    add(kRecordExtended, offsetof(PathRecord, nonDeltaAlbedo));
    add(kRecordFirstNonDelta, offsetof(PathRecord, primId));
    add(kRecordFirstHit, offsetof(PathRecord, primvars));
    add(kRecordPrimvars, sizeof(PathRecord));
    constexpr std::size_t kLine = alignof(PathRecord);
    return (end + kLine - 1) / kLine * kLine;
}

/// The first `bytes` of a record become those of a fresh one.
inline void clearRecord(PathRecord& record, std::size_t bytes) {
    static_assert(std::is_trivially_copyable_v<PathRecord>);
    const PathRecord fresh;
    std::memcpy(static_cast<void*>(&record), &fresh, bytes);
}

/// Records side by side, so far apart as what is recorded takes: see recordBytes(). What lies
/// behind that must not be touched, and a record not be copied as a whole. Owns nothing.
template <class R>
class PathRecordRows {
public:
    PathRecordRows(R* first, std::size_t stride = sizeof(PathRecord))
        : first_(reinterpret_cast<Byte*>(first)),
          stride_(stride) {}
    /// Of records that may be written, to be read.
    template <class Other, class = std::enable_if_t<std::is_same_v<const Other, R>>>
    PathRecordRows(const PathRecordRows<Other>& other)
        : PathRecordRows(&other[0], other.stride()) {}

    R& operator[](std::size_t i) const { return *reinterpret_cast<R*>(first_ + i * stride_); }
    PathRecordRows from(std::size_t i) const { return {&(*this)[i], stride_}; }
    std::size_t stride() const { return stride_; } ///< bytes

private:
    using Byte = std::conditional_t<std::is_const_v<R>, const unsigned char, unsigned char>;
    Byte* first_;
    std::size_t stride_;
};
using PathRecords = PathRecordRows<PathRecord>;
using ConstPathRecords = PathRecordRows<const PathRecord>;

} // namespace mbfeat
