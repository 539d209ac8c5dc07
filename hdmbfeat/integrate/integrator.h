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
#include "integrate/census.h"
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
    int leastSamples = 0;  ///< that each pixel gets, however soon the view ends; 0: all of them
    int targetSamples = 0; ///< that each has when a target error is first looked at
    Diagnostics* messages = nullptr; ///< for bad settings and samples; null: the scene's
    StopCheck stop;                  ///< may be empty; ends what setView() tries out
};

/// Counts that the integrator keeps; read between renders.
struct TraceStatistics {
    std::uint64_t paths = 0, rays = 0, shadowRays = 0, nonFinite = 0;
};

/// What commits built and loaded, since the integrator was made.
struct BuildStatistics {
    AccelBuilds accel;
    std::uint64_t lightTables = 0;
    std::uint64_t images = 0; ///< read from files

    BuildStatistics operator-(const BuildStatistics& before) const;
};

/// The kernel that a view is traced by, and what for.
struct KernelChoice {
    std::string instructions; ///< "scalar", "avx2" or "avx512"
    std::string prebuilt;     ///< "diffuse", "opaque", "glass", "coated" or "full"
    EffectSet handled;        ///< what the scene and the view call for, and what was forced on
    int branches = 1;         ///< paths that each becomes at its first wide scattering
};

/// Memory of a render, bytes.
struct MemoryStatistics {
    std::size_t pathStates = 0; ///< of one worker
    std::size_t records = 0;    ///< of one worker
    std::size_t primvars = 0;   ///< of meshes, normals apart
    std::size_t normals = 0;
    std::size_t emitters = 0; ///< tables of triangles that emit
    std::size_t images = 0;
    std::size_t imageCount = 0, primvarCount = 0, lightsInBvh = 0;
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

    /// Of the committed scene, without names.
    EffectCensus census() const;
    KernelChoice kernel() const; ///< for the view
    bool hasLens() const;        ///< whether the view has depth of field
    TraceStatistics statistics() const;
    BuildStatistics builds() const;
    /// Of the scene and of a worker for the view.
    MemoryStatistics memory(const PathWorker& worker) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
