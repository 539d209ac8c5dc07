// Embree 3.13 and 4.x behind one face: the only file that knows which one it is.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "core/floatTraps.h"

namespace mbfeat {

/// Closest hit. `ray` is read and written as Embree does.
inline void embreeIntersect(RTCScene scene, RTCRayHit& ray, bool coherent) {
    const FloatTrapsMasked foreignCode;
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    rtcIntersect1(scene, &ray, &arguments);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags =
        coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcIntersect1(scene, &context, &ray);
#endif
}

/// True when anything is hit in (tnear, tfar).
inline bool embreeOccluded(RTCScene scene, RTCRay& ray) {
    const FloatTrapsMasked foreignCode;
#if RTC_VERSION_MAJOR >= 4
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    rtcOccluded1(scene, &ray, &arguments);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, &ray);
#endif
    return ray.tfar < 0.0F;
}

/// Packets of 8 or 16 rays. `valid` holds -1 for the rays that take part and 0 for the others. For
/// each ray the answer is that of the single query, bit for bit (tests/cpp/integrate/packets.cpp).
template <int N>
struct EmbreePacket;
template <>
struct EmbreePacket<8> {
    using RayHit = RTCRayHit8;
    using Ray = RTCRay8;
};
template <>
struct EmbreePacket<16> {
    using RayHit = RTCRayHit16;
    using Ray = RTCRay16;
};

template <int N>
void embreeIntersectPacket(RTCScene scene, const int* valid, typename EmbreePacket<N>::RayHit& rays,
                           bool coherent) {
    const FloatTrapsMasked foreignCode;
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    RTCIntersectArguments* const how = &arguments;
    if constexpr (N == 8) {
        rtcIntersect8(valid, scene, &rays, how);
    } else {
        rtcIntersect16(valid, scene, &rays, how);
    }
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags =
        coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    if constexpr (N == 8) {
        rtcIntersect8(valid, scene, &context, &rays);
    } else {
        rtcIntersect16(valid, scene, &context, &rays);
    }
#endif
}

/// Rays that meet something get a negative tfar.
template <int N>
void embreeOccludedPacket(RTCScene scene, const int* valid, typename EmbreePacket<N>::Ray& rays) {
    const FloatTrapsMasked foreignCode;
#if RTC_VERSION_MAJOR >= 4
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    if constexpr (N == 8) {
        rtcOccluded8(valid, scene, &rays, &arguments);
    } else {
        rtcOccluded16(valid, scene, &rays, &arguments);
    }
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if constexpr (N == 8) {
        rtcOccluded8(valid, scene, &context, &rays);
    } else {
        rtcOccluded16(valid, scene, &context, &rays);
    }
#endif
}

/// Sole owner of an Embree handle.
template <class Handle, void (*release)(Handle)>
class EmbreeHandle {
public:
    EmbreeHandle() = default;
    explicit EmbreeHandle(Handle handle) : handle_(handle) {}
    EmbreeHandle(EmbreeHandle&& o) noexcept : handle_(o.handle_) { o.handle_ = nullptr; }
    EmbreeHandle& operator=(EmbreeHandle&& o) noexcept {
        if (this != &o) {
            reset();
            handle_ = o.handle_;
            o.handle_ = nullptr;
        }
        return *this;
    }
    EmbreeHandle(const EmbreeHandle&) = delete;
    EmbreeHandle& operator=(const EmbreeHandle&) = delete;
    ~EmbreeHandle() { reset(); }

    Handle get() const { return handle_; }
    explicit operator bool() const { return handle_ != nullptr; }
    void reset() {
        if (handle_ != nullptr) {
            release(handle_);
            handle_ = nullptr;
        }
    }

private:
    Handle handle_ = nullptr;
};

using EmbreeDevice = EmbreeHandle<RTCDevice, rtcReleaseDevice>;
using EmbreeScene = EmbreeHandle<RTCScene, rtcReleaseScene>;
using EmbreeGeometry = EmbreeHandle<RTCGeometry, rtcReleaseGeometry>;

} // namespace mbfeat
