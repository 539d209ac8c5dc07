// Traces batches of paths: the integrator's inside face. A worker belongs to one thread and keeps
// the memory of its batch; kernels for different instruction sets implement it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/effects.h"
#include "core/pixelFilter.h"
#include "core/settings.h"
#include "integrate/accel.h"
#include "integrate/cameraRay.h"
#include "integrate/pathRecord.h"
#include "shading/lightSampler.h"

namespace mbfeat {

/// One sample of one display-window pixel.
struct PixelSample {
    std::int32_t x = 0, y = 0;
    std::uint32_t index = 0;
};

/// Everything constant over a view's render, by reference; any thread.
struct PathContext {
    const Accel& accel;
    const LightSampler& lights;
    const CameraRays& camera;
    const FilterSampler& filter;
    const RenderOptions& options;
    const std::vector<std::string>& primvars; ///< names behind primvars:*
    std::uint32_t recordFlags = 0;            ///< those that the worker was made for
    std::int64_t frame = 0;
    /// What paths are handled for: all that the scene calls for, and maybe more. Stages and
    /// branches of others are left out.
    EffectSet effects = EffectSet::all();

    /// The same but for the options, which must outlive it too.
    PathContext with(const RenderOptions& other) const {
        return {accel, lights, camera, filter, other, primvars, recordFlags, frame, effects};
    }
};

/// Rays spent on paths.
struct PathCounts {
    std::uint64_t rays = 0, shadowRays = 0;
};

class PathWorker {
public:
    PathWorker() = default;
    PathWorker(const PathWorker&) = delete;
    PathWorker& operator=(const PathWorker&) = delete;
    virtual ~PathWorker() = default;

    /// Follows one path for each of `count` <= capacity() samples. records()[i] then holds what
    /// path i met: radiance, alpha, decomposition and what recordFlags ask for, not scaled by
    /// exposure; nonFinite where a feature is not finite. A path's record depends on its sample
    /// alone, not on what else is in the batch. `stop` (may be empty) is polled; true ends the
    /// batch early, and false is returned.
    virtual bool trace(const PathContext& context, const PixelSample* samples, int count,
                       const StopCheck& stop) = 0;

    virtual int capacity() const = 0;
    /// Memory of the batch: what paths carry along, and their records.
    virtual std::size_t stateBytes() const = 0;
    virtual std::size_t recordBytes() const = 0;
    virtual PathRecords records() = 0;
    /// Since the worker was made.
    virtual const PathCounts& counts() const = 0;
};

} // namespace mbfeat
