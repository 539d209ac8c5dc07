// The path integrator's face to its callers: batches of pixel samples.
//
// Threads: commit() and setView() by one thread while nothing traces; trace() by any number at
// once, each with a worker of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/settings.h"
#include "integrate/pathRecord.h"
#include "integrate/pathWorker.h"
#include "scene/camera.h"
#include "scene/scene.h"

namespace mbfeat {

/// What a render asks of the integrator beside the scene.
struct IntegratorRequest {
    RenderOptions options;
    std::uint32_t recordFlags = kRecordColor;
    std::vector<std::string> primvars; ///< names behind primvars:*, at most kMaxPrimvarAovs
    std::int64_t frame = 0;
    Diagnostics* messages = nullptr; ///< for bad samples; null: the scene's
};

/// Counts that the integrator keeps; read between renders.
struct TraceStatistics {
    std::uint64_t paths = 0, rays = 0, shadowRays = 0, nonFinite = 0;
};

/// Which effects the scene calls for, and how much there is of things.
struct EffectCensus {
    std::vector<std::string> present; ///< e.g. "transmission", "textures", "environment"
    std::vector<std::string> absent;
    std::size_t triangles = 0, instances = 0, lights = 0, textureBytes = 0;
};

class Integrator {
public:
    explicit Integrator(Scene& scene);
    ~Integrator();

    /// Commits the scene and brings acceleration structures and light tables up to date; cheap
    /// where nothing changed. `shouldStop` (may be empty) is polled and lets it return early with
    /// false: the next commit goes on.
    bool commit(const RenderOptions& options, const std::function<bool()>& shouldStop);

    /// Prepares for a camera; returns a message for a camera that cannot see (zero aperture).
    Status setView(const Camera& camera, const ImageWindow& window,
                   const IntegratorRequest& request);

    /// A worker for the view, for one thread. Not to be used after the next setView().
    std::unique_ptr<PathWorker> makeWorker() const;
    /// Traces up to worker.capacity() samples; worker.records()[i] then belongs to samples[i].
    /// `stop` (may be empty) is polled every few milliseconds; true leaves the records undefined
    /// and returns false.
    bool trace(PathWorker& worker, const PixelSample* samples, int count,
               const StopCheck& stop) const;

    EffectCensus census() const;
    TraceStatistics statistics() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
