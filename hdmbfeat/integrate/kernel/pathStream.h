// The state of a batch of paths: a row a path, read and written as quads of as many rows as there
// are lanes. From the second vertex on the paths that lie side by side in a group are strewn over
// the batch: a plane a value, read by gathers, would touch a cache line a value.
//
// Behind the last path of the batch come a few scratch slots. Lanes that have nothing to store
// store there, so that no kernel needs masked stores.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>

#include "core/laneQuads.h"
#include "integrate/pathRecord.h"

namespace mbfeat {

/// Cache-line aligned memory for plain values, uninitialised.
template <class V>
class LaneArray {
public:
    LaneArray() = default;
    explicit LaneArray(std::size_t size)
        : data_(static_cast<V*>(::operator new(size * sizeof(V), kAlignment))),
          size_(size) {}
    std::size_t size() const { return size_; }
    V* data() { return data_.get(); }
    const V* data() const { return data_.get(); }

private:
    static constexpr std::align_val_t kAlignment{64};
    struct Free {
        void operator()(V* data) const { ::operator delete(data, kAlignment); }
    };
    std::unique_ptr<V, Free> data_;
    std::size_t size_ = 0;
};

/// Places in the row of a path, in floats. Vectors take three, and share their quad with the value
/// behind them. What tracing needs fills the first cache line, what scattering hands on the second.
enum PathField : int {
    kOrigin = 0,
    kNear = 3,
    kDirection = 4,
    kFar = 7,
    kHit = 8,
    kHitGeometry = kHit, ///< integer, as the next two
    kHitInstance = 9,
    kHitTriangle = 10, ///< of a light shape: its light
    kDistance = 11,    ///< from the last vertex
    kHitB1 = 12,
    kHitB2 = 13,

    kThroughput = 16,
    kRouletteScale = 19, ///< of the throughput, see roulette.h
    kReceiverP = 20,
    kBsdfPdf = 23, ///< density of the scattering that made the segment, times its branches
    kReceiverN = 24,
    kKindCounts = 27, ///< integer: scatterings of each kind, see ScatterLimits; 0 if not limited
    kKeys = 28,
    kKeyLow = kKeys, ///< integer, as the next three
    kKeyHigh = 29,
    kKeyIndex = 30,
    kFlags = 31,
    kPathFields = 32,

    // Only where the first vertex without a delta is recorded or lights have multipliers.
    kTint = 32,       ///< of the delta events so far
    kPathLength = 35, ///< up to the last vertex
    kDiffuseShare = 36,
    kAllPathFields = 48,
};
/// Bits of kFlags.
enum PathFlag : std::int32_t {
    kFlagDelta = 1,    ///< the segment was scattered by a delta lobe, or left the camera
    kFlagTwoSided = 2, ///< light could arrive from both sides of the last vertex
    kFlagNonDelta = 4, ///< a vertex with a lobe that is not a delta was met
    kFlagBranch = 8,   ///< the path is one of several branches, and does not split again
};
/// Above the bits: the number of scatterings that count for roulette.
inline constexpr int kScatteringsShift = 8;
inline constexpr std::int32_t kScatteringsMask = 0x00ffff00;

class PathStream {
public:
    /// `scratch` slots follow slot `capacity` - 1.
    PathStream(int capacity, int scratch, bool allFields)
        : capacity_(capacity),
          stride_(allFields ? kAllPathFields : kPathFields),
          rows_(stride_ * static_cast<std::size_t>(capacity + scratch)) {
        // Scratch slots are read as lanes that take no part; they must hold numbers.
        std::memset(rows_.data(), 0,
                    stride_ * sizeof(float) * static_cast<std::size_t>(capacity + scratch));
    }

    int capacity() const { return capacity_; }
    std::size_t bytes() const { return rows_.size() * sizeof(float); }

    // One path.
    float& value(int field, int slot) { return row(slot)[field]; }
    float value(int field, int slot) const { return row(slot)[field]; }
    std::int32_t& integer(int field, int slot) {
        return *reinterpret_cast<std::int32_t*>(row(slot) + field);
    }
    std::int32_t integer(int field, int slot) const {
        return *reinterpret_cast<const std::int32_t*>(row(slot) + field);
    }
    Float3 get3(int first, int slot) const {
        const float* const from = row(slot) + first;
        return {from[0], from[1], from[2]};
    }
    void set3(int first, int slot, const Float3& v) {
        float* const to = row(slot) + first;
        to[0] = v.x;
        to[1] = v.y;
        to[2] = v.z;
    }

    // As many paths as there are lanes: four fields from `first` on of each slot.
    template <class T>
    LaneQuad<T> get(int first, const std::int32_t* slots) const {
        return loadQuads<T>(rows_.data() + first, slots, stride_);
    }
    template <class T>
    void set(int first, const std::int32_t* slots, const LaneQuad<T>& quad) {
        storeQuads<T>(rows_.data() + first, slots, stride_, quad);
    }

private:
    float* row(int slot) { return rows_.data() + static_cast<std::size_t>(slot) * stride_; }
    const float* row(int slot) const {
        return rows_.data() + static_cast<std::size_t>(slot) * stride_;
    }

    int capacity_;
    std::size_t stride_;
    LaneArray<float> rows_;
};

/// Places in the row of a shadow ray, in floats.
enum ShadowField : int {
    kShadowOrigin = 0,
    kShadowFar = 3,
    kShadowDirection = 4,
    kShadowSlot = 7,         ///< integer: the path
    kShadowContribution = 8, ///< what the pixel gets if nothing is in the way
    kShadowDirect = 12,      ///< direct:k, before path throughput
    kShadowFields = 16,
};

/// Shadow rays of one vertex of all paths.
class ShadowQueue {
public:
    /// For one ray of each of `capacity` paths, pushed `lanes` at a time.
    ShadowQueue(int capacity, int lanes)
        : rows_(static_cast<std::size_t>(capacity + lanes) * kShadowFields) {}

    void clear() { size_ = 0; }
    int size() const { return size_; }
    std::size_t bytes() const { return rows_.size() * sizeof(float); }
    float value(int field, int entry) const { return row(entry)[field]; }
    std::int32_t slot(int entry) const {
        return *reinterpret_cast<const std::int32_t*>(row(entry) + kShadowSlot);
    }
    Float3 get3(int first, int entry) const {
        const float* const from = row(entry) + first;
        return {from[0], from[1], from[2]};
    }
    template <class T>
    LaneQuad<T> get(int first, const std::int32_t* entries) const {
        return loadQuads<T>(rows_.data() + first, entries, kShadowFields);
    }
    /// Adds an entry for every lane of m.
    template <class T>
    void push(const Mask<T>& m, const Vec3<T>& origin, const Vec3<T>& direction, const T& tFar,
              const Vec3<T>& direct, const Vec3<T>& contribution, const IntLane<T>& slots) {
        const std::uint32_t bits = laneBits(m);
        std::int32_t entries[LaneTraits<T>::kWidth];
        for (int i = 0; i < LaneTraits<T>::kWidth; ++i) {
            entries[i] = size_; // what a lane without m writes is overwritten or not used
            size_ += static_cast<int>((bits >> static_cast<unsigned>(i)) & 1U);
        }
        const T none(0);
        put<T>(kShadowOrigin, entries, {origin, tFar});
        put<T>(kShadowDirection, entries, {direction, valueOfBits(slots)});
        put<T>(kShadowContribution, entries, {contribution, none});
        put<T>(kShadowDirect, entries, {direct, none});
    }

private:
    template <class T>
    void put(int first, const std::int32_t* entries, const LaneQuad<T>& quad) {
        storeQuads<T>(rows_.data() + first, entries, kShadowFields, quad);
    }
    const float* row(int entry) const {
        return rows_.data() + static_cast<std::size_t>(entry) * kShadowFields;
    }

    int size_ = 0;
    LaneArray<float> rows_;
};

} // namespace mbfeat
