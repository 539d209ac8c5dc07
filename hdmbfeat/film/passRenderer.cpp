#include "film/passRenderer.h"

#include <algorithm>
#include <utility>

#include "core/sampler.h"

namespace mbfeat {

void PassRenderer::begin(const RenderJob& job, const RenderView& view, Refinement* refinement) {
    job_ = &job;
    view_ = &view;
    refinement_ = refinement;
    cut_ = false;
    const int wanted = job.options.threads > 0 ? job.options.threads : hardwareThreads();
    if (!pool_ || poolThreads_ != wanted) {
        pool_ = std::make_unique<ThreadPool>(wanted);
        poolThreads_ = wanted;
    }
    workers_.clear();
    for (int i = 0; i < pool_->threadCount(); ++i) {
        workers_.push_back({integrator_.makeWorker(), {}});
    }
}

void PassRenderer::end() {
    workers_.clear();
    job_ = nullptr;
    view_ = nullptr;
    refinement_ = nullptr;
}

int PassRenderer::passSamples(int done) const {
    constexpr int kBatchPass = 16;
    const bool fewAtFirst = job_->interactive || (kHasTargets && job_->options.timeLimit > 0.0);
    const int wanted = fewAtFirst ? std::clamp(done, 1, kBatchPass) : kBatchPass;
    return std::min(wanted, view_->samplesPerPixel - done);
}

void PassRenderer::render(int first, int samples) {
    // The first pass is finished whatever it takes: no pixel is without samples.
    mayCut_ = job_->options.timeLimit > 0.0 && first > 0;
    if (!job_->interactive || first > 0) {
        renderGrid(PixelGrid(), first, samples);
        return;
    }
    for (const PixelGrid& grid : kRisingGrids) {
        if (!observer_.shouldStop()) {
            renderGrid(grid, first, samples);
        }
    }
}

RowLoop PassRenderer::rowLoop() {
    return [this](int rows, const std::function<void(int)>& body) {
        constexpr int kChunk = 16;
        pool_->run(0, rows, kChunk, nullptr,
                   [&](std::int64_t row, int) { body(static_cast<int>(row)); });
    };
}

/// The pass, or that grid's part of it.
void PassRenderer::renderGrid(const PixelGrid& grid, int first, int samples) {
    const PixelRect& rect = view_->film->window().data;
    // A batch shows when it is whole: the first ones of a viewer are small.
    constexpr int kFirstBatch = 1024;
    const int capacity = worker().capacity();
    const int batch = job_->interactive && first == 0 ? std::min(kFirstBatch, capacity) : capacity;
    // Tiles of as many pixels of the grid as they would have of a whole image of that size.
    const PixelRect pixels{0, 0, (rect.width + grid.stride - 1) / grid.stride,
                           (rect.height + grid.stride - 1) / grid.stride};
    const int side = grid.stride * (job_->options.tileSize > 0
                                        ? job_->options.tileSize
                                        : fittedTile(pixels, samples, batch, pool_->threadCount()));
    const std::vector<TileGroup> groups =
        refines() && !refinement_->allActive()
            ? groupTiles(refinement_->activeBlocks(), samples, batch, pool_->threadCount())
            : singleTiles(rect, side);
    pool_->run(0, static_cast<std::int64_t>(groups.size()), 1, &stopping_,
               [&](std::int64_t index, int thread) {
                   if (observer_.waitWhilePaused()) {
                       renderTiles(groups[static_cast<std::size_t>(index)], grid, first, samples,
                                   workers_[static_cast<std::size_t>(thread)]);
                       observer_.reportProgress();
                   }
               });
}

void PassRenderer::renderTiles(const TileGroup& tiles, const PixelGrid& grid, int first,
                               int samples, Worker& worker) {
    const PixelRect& data = view_->film->window().data;
    const auto capacity = static_cast<std::size_t>(worker.tracer->capacity());
    const bool alternates = refines();
    worker.batch.clear();
    for (const PixelRect& tile : tiles) {
        for (int y = tile.y; y < tile.y + tile.height; ++y) {
            for (int x = tile.x; x < tile.x + tile.width; ++x) {
                if (!grid.has(x - data.x, y - data.y)) {
                    continue;
                }
                for (int s = first; s < first + samples; ++s) {
                    const auto sample = static_cast<std::uint32_t>(s);
                    worker.batch.push_back({x, y, alternates ? alternatingIndex(sample) : sample});
                    if (worker.batch.size() == capacity && !traceBatch(worker)) {
                        return;
                    }
                }
            }
        }
    }
    traceBatch(worker);
}

/// Traces the collected samples and adds them to the film; false when it was stopped. A pixel's
/// samples are added in order, whatever the batches.
bool PassRenderer::traceBatch(Worker& worker) {
    const auto count = static_cast<int>(worker.batch.size());
    if (mayCut_ && observer_.timeIsUp()) {
        cut_ = true;
        return false;
    }
    if (!integrator_.trace(*worker.tracer, worker.batch.data(), count,
                           [this] { return observer_.shouldStop(); })) {
        return false;
    }
    // Samples of one pixel lie side by side.
    const PixelSample* const batch = worker.batch.data();
    for (int i = 0, end = 0; i < count; i = end) {
        while (end < count && batch[end].x == batch[i].x && batch[end].y == batch[i].y) {
            ++end;
        }
        const ConstPathRecords records = worker.tracer->records().from(static_cast<std::size_t>(i));
        if (refines()) {
            refinement_->sums().add(batch[i].x, batch[i].y, sequenceOf(batch[i].index), records,
                                    end - i);
        }
        view_->film->add(batch[i].x, batch[i].y, records, end - i);
    }
    view_->film->addToDenoiser(batch, worker.tracer->records(), count);
    observer_.addSamples(static_cast<std::uint64_t>(count));
    worker.batch.clear();
    return true;
}

} // namespace mbfeat
