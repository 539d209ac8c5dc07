#include "integrate/integrator.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <string>

#include "core/pixelFilter.h"
#include "integrate/accel.h"
#include "integrate/cameraRay.h"
#include "integrate/census.h"
#include "integrate/kernels.h"
#include "shading/lightSampler.h"

namespace mbfeat {

namespace {

/// Counters of one thread, on a cache line of their own.
struct alignas(64) CounterShard {
    std::atomic<std::uint64_t> paths{0}, rays{0}, shadowRays{0}, nonFinite{0};
};
constexpr std::size_t kShards = 64;

std::size_t shardOfThread() {
    static std::atomic<std::size_t> threads{0};
    thread_local const std::size_t shard = threads++ % kShards;
    return shard;
}

/// Paths of a batch. Small ones stay in the second-level cache, records and all; where the
/// acceleration structure does not, large ones give the sorting of rays something to sort.
constexpr int kSmallBatch = 2048;
constexpr int kLargeBatch = 32768;
constexpr std::size_t kLargeScene = 100000;

/// Only this many bad samples are logged one by one; all are counted.
constexpr int kLoggedNonFinite = 8;

/// Features were looked at by the kernel, while they were in its registers.
bool finiteRecord(const PathRecord& record, std::uint32_t recordFlags) {
    bool finite = isFinite(record.radiance) && !record.nonFinite;
    if ((recordFlags & kRecordContributions) != 0) {
        finite = finite && isFinite(record.emission) && isFinite(record.tail);
        for (const Rgb& contribution : record.contributions) {
            finite = finite && isFinite(contribution);
        }
    }
    return finite;
}

void scaleExposure(PathRecord& record, float scale, std::uint32_t recordFlags) {
    if (scale == 1.0F) {
        return;
    }
    record.radiance *= scale;
    if ((recordFlags & kRecordContributions) == 0) {
        return;
    }
    record.emission *= scale;
    record.tail *= scale;
    for (Rgb& contribution : record.contributions) {
        contribution *= scale;
    }
}

} // namespace

struct Integrator::Impl {
    explicit Impl(Scene& scene)
        : scene(scene),
          accel(scene.diagnostics()),
          lightMessages(scene.diagnostics()) {}

    Scene& scene;
    Accel accel;
    LightSampler lights;
    Diagnostics lightMessages; ///< of the last time that the lights were prepared
    bool lightsHaveMultipliers = false;
    bool committedOnce = false;
    SceneChanges pending; ///< what an interrupted commit left to do

    IntegratorRequest request;
    CameraRays camera;
    FilterSampler filter{PixelFilter::kBox, 1.0F};
    mutable std::array<CounterShard, kShards> counters;
    mutable std::atomic<int> loggedNonFinite{0}; ///< of this view

    Diagnostics& messages() const {
        return request.messages != nullptr ? *request.messages : scene.diagnostics();
    }

    void rejectNonFinite(int x, int y, std::uint32_t sampleIndex, PathRecord& record) const {
        const Float2 subpixel = record.subpixel;
        const float weight = record.filterWeight;
        record = PathRecord{};
        record.subpixel = subpixel;
        record.filterWeight = weight;
        record.nonFinite = true;
        counters[shardOfThread()].nonFinite.fetch_add(1, std::memory_order_relaxed);
        if (loggedNonFinite.fetch_add(1, std::memory_order_relaxed) < kLoggedNonFinite) {
            messages().warn(
                "pixel " + std::to_string(x) + ", " + std::to_string(y),
                "sample " + std::to_string(sampleIndex) +
                    " is not finite; it counts as zero (AOV nonFinite). Please report the "
                    "scene.");
        }
    }
};

Integrator::Integrator(Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
Integrator::~Integrator() = default;

bool Integrator::commit(const RenderOptions& options, const std::function<bool()>& shouldStop) {
    Impl& m = *impl_;
    const SceneChanges changes = m.scene.commit();
    m.pending.geometry = m.pending.geometry || changes.geometry || !m.committedOnce;
    m.pending.materials = m.pending.materials || changes.materials;
    m.pending.lights = m.pending.lights || changes.lights;

    const bool rebuilt = m.pending.geometry || m.accel.robust() != options.robust;
    if (rebuilt) {
        if (!m.accel.commit(m.scene, options.robust, shouldStop)) {
            return false;
        }
    } else if (m.pending.materials) {
        m.accel.bindMaterials(m.scene);
    }
    if (rebuilt || m.pending.materials || m.pending.lights) {
        m.lightMessages.withdraw();
        m.lights.commit(m.scene.lights(), m.scene.origin(), m.accel.bounds().radius(),
                        m.accel.collectEmissiveTriangles(), m.lightMessages);
        m.lightsHaveMultipliers =
            std::any_of(m.scene.lights().begin(), m.scene.lights().end(), [](const auto& light) {
                return light->diffuse != 1.0F || light->specular != 1.0F;
            });
    }
    if (rebuilt || m.pending.lights) {
        if (!m.accel.commitTop(m.lights, shouldStop)) {
            m.pending.geometry = true;
            return false;
        }
    }
    m.pending = SceneChanges();
    m.committedOnce = true;
    return true;
}

Status Integrator::setView(const Camera& camera, const ImageWindow& window,
                           const IntegratorRequest& request) {
    Impl& m = *impl_;
    const float width = camera.windowMax.x - camera.windowMin.x;
    const float height = camera.windowMax.y - camera.windowMin.y;
    const bool finite = std::isfinite(width) && std::isfinite(height);
    if (!finite || !(width > 0.0F) || !(height > 0.0F)) {
        return Error{"camera",
                     "has an aperture or focal length of zero and sees nothing; the image stays "
                     "empty. Give it a horizontal and vertical aperture and a focal length."};
    }
    const double determinant = camera.toWorld.determinant();
    if (!std::isfinite(determinant) || determinant == 0.0) {
        return Error{"camera", "has a singular transform and sees nothing; the image stays empty. "
                               "Remove scales of zero above it."};
    }
    if (window.width <= 0 || window.height <= 0) {
        return Error{"camera", "renders at a resolution of zero pixels; nothing was rendered. Set "
                               "the product's resolution."};
    }
    m.request = request;
    m.loggedNonFinite = 0;
    if (const std::string problem = kernelProblem(request.options.kernel); !problem.empty()) {
        m.messages().warn("mbfeat:kernel", problem);
    }
    m.camera = CameraRays(camera, window, m.scene.origin());
    m.filter = FilterSampler(request.options.pixelFilter, request.options.pixelFilterWidth);
    return {};
}

std::unique_ptr<PathWorker> Integrator::makeWorker() const {
    const Impl& m = *impl_;
    const bool large = m.accel.triangleCount() + m.accel.instanceCount() >= kLargeScene;
    const bool allFields =
        (m.request.recordFlags & kRecordFirstNonDelta) != 0 || m.lightsHaveMultipliers;
    return makePathWorker(m.request.options.kernel, large ? kLargeBatch : kSmallBatch, allFields);
}

bool Integrator::trace(PathWorker& worker, const PixelSample* samples, int count,
                       const StopCheck& stop) const {
    const Impl& m = *impl_;
    const std::uint32_t flags = m.request.recordFlags;
    const PathContext context{m.accel,  m.lights,          m.camera,
                              m.filter, m.request.options, m.request.primvars,
                              flags,    m.request.frame,   m.lightsHaveMultipliers};
    const PathCounts before = worker.counts();
    const bool done = worker.trace(context, samples, count, stop);
    CounterShard& counters = m.counters[shardOfThread()];
    const PathCounts after = worker.counts();
    counters.rays.fetch_add(after.rays - before.rays, std::memory_order_relaxed);
    counters.shadowRays.fetch_add(after.shadowRays - before.shadowRays, std::memory_order_relaxed);
    if (!done) {
        return false;
    }
    counters.paths.fetch_add(static_cast<std::uint64_t>(count), std::memory_order_relaxed);
    for (int i = 0; i < count; ++i) {
        PathRecord& record = worker.records()[i];
        scaleExposure(record, m.camera.exposureScale(), flags);
        if (!finiteRecord(record, flags)) {
            m.rejectNonFinite(samples[i].x, samples[i].y, samples[i].index, record);
        }
    }
    return true;
}

EffectCensus Integrator::census() const {
    return takeCensus(impl_->scene, impl_->accel, impl_->lights);
}

TraceStatistics Integrator::statistics() const {
    TraceStatistics total;
    for (const CounterShard& shard : impl_->counters) {
        total.paths += shard.paths;
        total.rays += shard.rays;
        total.shadowRays += shard.shadowRays;
        total.nonFinite += shard.nonFinite;
    }
    return total;
}

} // namespace mbfeat
