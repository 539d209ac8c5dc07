// The render thread: takes a job (cameras and films of one scene), refines all films progressively
// until every pixel has its samples, and finishes the job (writes products) before it is converged.
//
// Threads: the public members may be called from any one controlling thread at a time;
// isConverged() and progress() from any. The films of a running job belong to the renderer:
// resolve() them freely, but add nothing.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "film/film.h"
#include "film/report.h"
#include "integrate/integrator.h"

namespace mbfeat {

struct RenderView {
    Camera camera;
    std::shared_ptr<Film> film;
    std::string cameraPath;  ///< for messages
    int samplesPerPixel = 0; ///< 0: RenderOptions::samplesPerPixel
};

struct RenderJob {
    std::vector<RenderView> views;
    RenderOptions options;
    std::vector<Settings::Resolved> settings; ///< what options came from, for the report
    std::int64_t frame = 0;
    /// What this job, rather than the scene, has to complain of; null: made by start(). A section
    /// of the scene's, so that it stands until the next job replaces this one.
    std::shared_ptr<Diagnostics> messages;
    /// First passes at few samples, the first one at rising resolution (film/risingPass.h), for a
    /// viewer; else large passes.
    bool interactive = false;
    /// Called on the render thread after the last sample (also of an interrupted job whose host
    /// asked to stop, with report.interrupted) and before isConverged() turns true. Adds what it
    /// wrote to the report.
    std::function<void(RenderReport&)> finish;
};

/// What became of a job, for whoever started it: the renderer may have gone on to another's.
/// Any thread.
class JobState {
public:
    bool isRunning() const { return stage_ == Stage::kRunning; }
    /// Complete, its finish call included, or interrupted by the host.
    bool isConverged() const { return stage_ == Stage::kConverged; }

private:
    friend class Renderer;
    enum class Stage : std::uint8_t { kRunning, kConverged, kStopped };
    std::atomic<Stage> stage_{Stage::kRunning};
};

struct RenderProgress {
    /// Of all samples of the job, 0..1; with a target error of those that it is expected to take,
    /// which may change, with a time limit of the time where that ends first.
    double fraction = 0.0;
    double seconds = 0.0; ///< since the job started, pauses excluded
    double samplesPerSecond = 0.0;
    double secondsLeft = 0.0; ///< estimate; 0 when unknown
    std::uint64_t samples = 0;
};

class Renderer {
public:
    explicit Renderer(Scene& scene);
    /// Stops and joins.
    ~Renderer();

    /// Starts a job in the background; a running one is stopped first. The scene must not be
    /// edited until stop() returned or the job converged.
    std::shared_ptr<const JobState> start(RenderJob job);
    /// False while a job other than that one (null: any job) runs. Who shares the renderer and
    /// starts a job only then gets a turn, and lets the others finish theirs.
    bool isFreeFor(const JobState* job) const;
    /// Stops at the next vertex of the batches that are traced, within some tens of milliseconds;
    /// the films keep what they have, without those batches. No finish call.
    void stop();
    void pause();
    void resume();
    bool isPaused() const;
    /// True while the thread works on a job, paused or not.
    bool isRendering() const;
    /// True when the last job is complete, its finish call included, or was interrupted.
    bool isConverged() const;
    /// Blocks until the job converged.
    void wait();
    /// Blocks until the job converged, at most for that time.
    void waitFor(std::chrono::milliseconds longest);

    RenderProgress progress() const;
    /// Of the last finished (or running) job.
    RenderReport report() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
