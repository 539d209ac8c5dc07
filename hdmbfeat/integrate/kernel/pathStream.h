// The state of a batch of paths as structure of arrays: a plane a value, a slot a path.
//
// Behind the last path of the batch come a few scratch slots. Lanes that have nothing to store
// store there, so that no kernel needs masked stores.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>

#include "core/laneMemory.h"
#include "integrate/pathRecord.h"

namespace mbfeat {

/// Cache-line aligned memory for plain values, uninitialised.
template <class V>
class LaneArray {
public:
    LaneArray() = default;
    explicit LaneArray(std::size_t size)
        : data_(static_cast<V*>(::operator new(size * sizeof(V), kAlignment))) {}
    V* data() { return data_.get(); }
    const V* data() const { return data_.get(); }

private:
    static constexpr std::align_val_t kAlignment{64};
    struct Free {
        void operator()(V* data) const { ::operator delete(data, kAlignment); }
    };
    std::unique_ptr<V, Free> data_;
};

/// Vectors take three planes.
enum FloatPlane : int {
    kOrigin = 0,
    kDirection = 3,
    kNear = 6, ///< of camera rays and segments behind cut-outs
    kFar = 7,
    kThroughput = 8,
    kEtaScale = 11, ///< undoes the radiance scaling of refraction for roulette
    kBsdfPdf = 12,  ///< density of the scattering that made the segment
    kReceiverP = 13,
    kReceiverN = 16,
    kDistance = 19, ///< from the last vertex
    kHitB1 = 20,
    kHitB2 = 21,
    kAlwaysPlanes = 22,
    // Only where paths are recorded or lights have multipliers.
    kPathLength = 22, ///< up to the last vertex
    kTint = 23,       ///< of the delta events so far
    kDiffuseShare = 26,
    kFloatPlanes = 29,
};
enum IntPlane : int {
    kFlags = 0,
    kHitGeometry = 1,
    kHitInstance = 2,
    kHitTriangle = 3, ///< of a light shape: its light
    kKeyLow = 4,
    kKeyHigh = 5,
    kKeyIndex = 6,
    kIntPlanes = 7,
};
/// Bits of kFlags.
enum PathFlag : std::int32_t {
    kFlagDelta = 1,    ///< the segment was scattered by a delta lobe, or left the camera
    kFlagTwoSided = 2, ///< light could arrive from both sides of the last vertex
    kFlagNonDelta = 4, ///< a vertex with a lobe that is not a delta was met
};

class PathStream {
public:
    /// `scratch` slots follow slot `capacity` - 1.
    PathStream(int capacity, int scratch, bool allPlanes)
        : capacity_(capacity),
          stride_(static_cast<std::size_t>(capacity + scratch + 31) / 16 * 16),
          floats_(stride_ * static_cast<std::size_t>(allPlanes ? kFloatPlanes : kAlwaysPlanes)),
          ints_(stride_ * kIntPlanes) {
        // Scratch slots are read as lanes that take no part; they must hold numbers.
        std::memset(floats_.data(), 0,
                    stride_ * sizeof(float) *
                        static_cast<std::size_t>(allPlanes ? kFloatPlanes : kAlwaysPlanes));
        std::memset(ints_.data(), 0, stride_ * kIntPlanes * sizeof(std::int32_t));
    }

    int capacity() const { return capacity_; }
    float* plane(int plane) { return floats_.data() + stride_ * static_cast<std::size_t>(plane); }
    const float* plane(int plane) const {
        return floats_.data() + stride_ * static_cast<std::size_t>(plane);
    }
    std::int32_t* ints(int plane) {
        return ints_.data() + stride_ * static_cast<std::size_t>(plane);
    }
    const std::int32_t* ints(int plane) const {
        return ints_.data() + stride_ * static_cast<std::size_t>(plane);
    }

    // One path.
    Float3 get3(int first, int slot) const {
        return {plane(first)[slot], plane(first + 1)[slot], plane(first + 2)[slot]};
    }
    void set3(int first, int slot, const Float3& v) {
        plane(first)[slot] = v.x;
        plane(first + 1)[slot] = v.y;
        plane(first + 2)[slot] = v.z;
    }

    // As many paths as there are lanes.
    template <class T>
    T get(int p, const IntLane<T>& slot) const {
        return gatherLanes<T>(plane(p), slot);
    }
    template <class T>
    Vec3<T> get3(int first, const IntLane<T>& slot) const {
        return {get<T>(first, slot), get<T>(first + 1, slot), get<T>(first + 2, slot)};
    }
    template <class T>
    void set(int p, const IntLane<T>& slot, const T& value) {
        scatterLanes<T>(plane(p), slot, value);
    }
    template <class T>
    void set3(int first, const IntLane<T>& slot, const Vec3<T>& v) {
        set<T>(first, slot, v.x);
        set<T>(first + 1, slot, v.y);
        set<T>(first + 2, slot, v.z);
    }

private:
    int capacity_;
    std::size_t stride_;
    LaneArray<float> floats_;
    LaneArray<std::int32_t> ints_;
};

/// Shadow rays of one vertex of all paths. Entries come in groups of as many as there are lanes;
/// an entry of slot -1 is empty.
enum ShadowPlane : int {
    kShadowOrigin = 0,
    kShadowDirection = 3,
    kShadowFar = 6,
    kShadowDirect = 7,        ///< direct:k, before path throughput
    kShadowContribution = 10, ///< what the pixel gets if nothing is in the way
    kShadowPlanes = 13,
};

class ShadowQueue {
public:
    explicit ShadowQueue(int capacity)
        : stride_(static_cast<std::size_t>(capacity + 31) / 16 * 16),
          floats_(stride_ * kShadowPlanes),
          slots_(stride_) {}

    void clear() { size_ = 0; }
    int size() const { return size_; }
    float* plane(int plane) { return floats_.data() + stride_ * static_cast<std::size_t>(plane); }
    const float* plane(int plane) const {
        return floats_.data() + stride_ * static_cast<std::size_t>(plane);
    }
    std::int32_t* slots() { return slots_.data(); }
    const std::int32_t* slots() const { return slots_.data(); }

    Float3 get3(int first, int entry) const {
        return {plane(first)[entry], plane(first + 1)[entry], plane(first + 2)[entry]};
    }
    template <class T>
    void push(const Vec3<T>& origin, const Vec3<T>& direction, const T& tFar, const Vec3<T>& direct,
              const Vec3<T>& contribution, const IntLane<T>& slot) {
        put3<T>(kShadowOrigin, origin);
        put3<T>(kShadowDirection, direction);
        storeLanes<T>(plane(kShadowFar) + size_, tFar);
        put3<T>(kShadowDirect, direct);
        put3<T>(kShadowContribution, contribution);
        storeIntLanes<T>(slots() + size_, slot);
        size_ += LaneTraits<T>::kWidth;
    }

private:
    template <class T>
    void put3(int first, const Vec3<T>& v) {
        storeLanes<T>(plane(first) + size_, v.x);
        storeLanes<T>(plane(first + 1) + size_, v.y);
        storeLanes<T>(plane(first + 2) + size_, v.z);
    }

    std::size_t stride_;
    int size_ = 0;
    LaneArray<float> floats_;
    LaneArray<std::int32_t> slots_;
};

} // namespace mbfeat
