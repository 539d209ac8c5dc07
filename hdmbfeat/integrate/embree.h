// Embree 3.13 and 4.x behind one face: the only file that knows which one it is.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace mbfeat {

/// Closest hit. `ray` is read and written as Embree does.
inline void embreeIntersect(RTCScene scene, RTCRayHit& ray, bool coherent) {
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
