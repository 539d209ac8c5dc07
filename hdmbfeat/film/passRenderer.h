// Passes over an image: cuts them into tiles, traces these on all threads, and adds what the paths
// found to the film.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/parallel.h"
#include "film/refinement.h"
#include "film/renderer.h"
#include "film/risingPass.h"
#include "film/tiles.h"

namespace mbfeat {

/// Whether renders may stop at an error or at a time. A build without that measures what it costs
/// renders that do not (tests/bench/targets).
#if defined(MBFEAT_WITHOUT_TARGETS)
inline constexpr bool kHasTargets = false;
#else
inline constexpr bool kHasTargets = true;
#endif

/// Whom a pass asks, and tells how far it is. From all render threads at once.
class PassObserver {
public:
    /// Whether paths are to be left where they are.
    virtual bool shouldStop() const = 0;
    /// Blocks during a pause; false when the work is to end.
    virtual bool waitWhilePaused() = 0;
    /// Whether a view that has something in every pixel is to end.
    virtual bool timeIsUp() const = 0;
    /// So many more samples are in the film.
    virtual void addSamples(std::uint64_t count) = 0;
    /// A tile is done.
    virtual void reportProgress() = 0;

protected:
    ~PassObserver() = default;
};

class PassRenderer {
public:
    /// No more tiles are begun when `stopping` becomes true.
    PassRenderer(Integrator& integrator, PassObserver& observer, const std::atomic<bool>& stopping)
        : integrator_(integrator),
          observer_(observer),
          stopping_(stopping) {}

    /// For passes over that view, whose camera the integrator has been given. `refinement` says
    /// where samples go and hears of all of them; null: everywhere. Both are to live until end().
    void begin(const RenderJob& job, const RenderView& view, Refinement* refinement);
    void end();

    /// Samples of the next pass: few at first where somebody watches or time is short.
    int passSamples(int done) const;
    /// `samples` of every pixel from number `first` on. Left early where the observer says so.
    void render(int first, int samples);
    /// Whether time was up during a pass.
    bool wasCut() const { return cut_; }

    /// A loop over rows of the image on the render threads.
    RowLoop rowLoop();
    const PathWorker& worker() const { return *workers_.front().tracer; }
    std::size_t workerCount() const { return workers_.size(); }

private:
    /// What a render thread works with.
    struct Worker {
        std::unique_ptr<PathWorker> tracer;
        std::vector<PixelSample> batch;
    };

    bool refines() const { return kHasTargets && refinement_ != nullptr; }
    void renderGrid(const PixelGrid& grid, int first, int samples);
    void renderTiles(const TileGroup& tiles, const PixelGrid& grid, int first, int samples,
                     Worker& worker);
    bool traceBatch(Worker& worker);

    Integrator& integrator_;
    PassObserver& observer_;
    const std::atomic<bool>& stopping_;
    std::unique_ptr<ThreadPool> pool_; ///< kept from view to view
    int poolThreads_ = 0;

    const RenderJob* job_ = nullptr;
    const RenderView* view_ = nullptr;
    Refinement* refinement_ = nullptr;
    std::vector<Worker> workers_;  ///< one a thread of the pool
    bool mayCut_ = false;          ///< whether the running pass may end when time is up
    std::atomic<bool> cut_{false}; ///< it did
};

} // namespace mbfeat
