#include "integrate/integrator.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <set>
#include <string>

#include "core/pixelFilter.h"
#include "integrate/accel.h"
#include "integrate/cameraRay.h"
#include "integrate/census.h"
#include "integrate/effectParts.h"
#include "integrate/kernels.h"
#include "integrate/splitting.h"
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
    EffectCensus census;       ///< of the committed scene
    EffectSet handled;         ///< by the view's kernel
    std::uint64_t lightTables = 0;
    bool committedOnce = false;
    SceneChanges pending; ///< what an interrupted commit left to do

    IntegratorRequest request;
    int branches = 1; ///< that each path of the view becomes
    CameraRays camera;
    FilterSampler filter{PixelFilter::kBox, 1.0F};
    mutable std::array<CounterShard, kShards> counters;
    mutable std::atomic<int> loggedNonFinite{0}; ///< of this view

    Diagnostics& messages() const {
        return request.messages != nullptr ? *request.messages : scene.diagnostics();
    }

    PathContext context() const {
        return {accel,
                lights,
                camera,
                filter,
                request.options,
                request.primvars,
                request.recordFlags,
                request.frame,
                handled};
    }

    std::unique_ptr<PathWorker> makeWorker(int branchesOfPath) const {
        const bool large = accel.triangleCount() + accel.instanceCount() >= kLargeScene;
        const bool allFields = (request.recordFlags & kRecordFirstNonDelta) != 0 ||
                               handled.has(Effect::kLightMultipliers);
        return makePathWorker(request.options.kernel,
                              (large ? kLargeBatch : kSmallBatch) / branchesOfPath, branchesOfPath,
                              allFields, request.recordFlags, closureParts(handled));
    }

    /// Records tell of one path, and a clamp of what one path brings: there is one branch then.
    void chooseBranches(int width, int height) {
        const RenderOptions& options = request.options;
        const bool whole = (request.recordFlags & (kPathRecordFlags | kRecordContributions)) != 0;
        const bool clamped = options.clampDirect > 0.0F || options.clampIndirect > 0.0F;
        branches = whole || clamped ? 1 : options.splitting;
        if (options.splitting > 1 && branches == 1) {
            messages().warn("mbfeat:splitting",
                            std::string("is 1 for this view, not ") +
                                std::to_string(options.splitting) + ": " +
                                (whole ? "path features or contributions are recorded, for an AOV, "
                                         "a deep product or the denoiser"
                                       : "light is clamped") +
                                ". Set it to 0 or 1, or leave that out.");
        }
        if (branches == kFittedSplitting) {
            const int most = options.samplesPerPixel;
            const int least =
                request.leastSamples > 0 ? std::min(request.leastSamples, most) : most;
            branches = fittedBranches(
                {context(), width, height, least, request.targetSamples, camera.exposureScale()},
                [this](int count) { return makeWorker(count); }, request.stop);
        }
    }

    void rejectNonFinite(int x, int y, std::uint32_t sampleIndex, PathRecord& record) const {
        const Float2 subpixel = record.subpixel;
        const float weight = record.filterWeight;
        clearRecord(record, recordBytes(request.recordFlags));
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
    m.scene.takeEffects(options.effects.taken);
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
        ++m.lightTables;
        m.lightMessages.withdraw();
        m.lights.commit(m.scene.lights(), m.scene.origin(), m.accel.bounds().radius(),
                        m.accel.collectEmissiveTriangles(), m.lightMessages);
    }
    if (rebuilt || m.pending.lights) {
        if (!m.accel.commitTop(m.lights, rebuilt, shouldStop)) {
            m.pending.geometry = rebuilt; // edits of lights alone leave the surfaces as they are
            return false;
        }
    }
    if (rebuilt || m.pending.materials || m.pending.lights) {
        m.census = takeCensus(m.scene, m.accel, m.lights);
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
    Camera seen = camera;
    const EffectRequest& effects = request.options.effects;
    if (!request.options.blur || effects.taken.has(Effect::kDepthOfField)) {
        seen.lensRadius = 0.0F;
    }
    m.handled = m.census.effects() | recordedEffects(request.recordFlags) | effects.forced;
    if (effects.full) {
        // Whether lights have multipliers is no matter of a kernel: they take more memory a path.
        m.handled |= EffectSet::all() - EffectSet(Effect::kLightMultipliers);
    }
    m.camera = CameraRays(seen, window, m.scene.origin());
    m.handled |= m.camera.hasLens() ? EffectSet(Effect::kDepthOfField) : EffectSet();
    m.filter = FilterSampler(request.options.pixelFilter, request.options.pixelFilterWidth);
    m.chooseBranches(window.width, window.height);
    return {};
}

std::unique_ptr<PathWorker> Integrator::makeWorker() const {
    return impl_->makeWorker(impl_->branches);
}

bool Integrator::trace(PathWorker& worker, const PixelSample* samples, int count,
                       const StopCheck& stop) const {
    const Impl& m = *impl_;
    const std::uint32_t flags = m.request.recordFlags;
    const PathContext context = m.context();
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
    const PathRecords records = worker.records();
    for (int i = 0; i < count; ++i) {
        PathRecord& record = records[static_cast<std::size_t>(i)];
        scaleExposure(record, m.camera.exposureScale(), flags);
        if (!finiteRecord(record, flags)) {
            m.rejectNonFinite(samples[i].x, samples[i].y, samples[i].index, record);
        }
    }
    return true;
}

EffectCensus Integrator::census() const {
    return impl_->census;
}

KernelChoice Integrator::kernel() const {
    const Kernel wanted = impl_->request.options.kernel;
    return {kernelName(chooseKernel(wanted)),
            prebuiltName(choosePrebuilt(wanted, closureParts(impl_->handled))), impl_->handled,
            impl_->branches};
}

bool Integrator::hasLens() const {
    return impl_->camera.hasLens();
}

BuildStatistics Integrator::builds() const {
    return {impl_->accel.builds(), impl_->lightTables, impl_->scene.textures().loaded()};
}

BuildStatistics BuildStatistics::operator-(const BuildStatistics& before) const {
    return {{accel.meshes - before.accel.meshes, accel.placements - before.accel.placements,
             accel.bindings - before.accel.bindings, accel.top - before.accel.top,
             accel.lights - before.accel.lights},
            lightTables - before.lightTables,
            images - before.images};
}

MemoryStatistics Integrator::memory(const PathWorker& worker) const {
    const Impl& m = *impl_;
    MemoryStatistics memory;
    memory.pathStates = worker.stateBytes();
    memory.records = worker.recordBytes();
    std::set<const Mesh*> meshes;
    for (const std::unique_ptr<AccelGeometry>& geometry : m.accel.geometries()) {
        memory.emitters += geometry->emissiveIndex.size() * sizeof(std::int32_t);
        if (!meshes.insert(geometry->mesh.get()).second) {
            continue;
        }
        memory.normals += geometry->mesh->normals.values.size() * sizeof(float);
        for (const NamedAttribute& primvar : geometry->mesh->primvars) {
            ++memory.primvarCount;
            memory.primvars += primvar.attribute.values.size() * sizeof(float);
        }
    }
    memory.images = m.scene.textures().bytes();
    memory.imageCount = static_cast<std::size_t>(m.scene.textures().count());
    memory.lightsInBvh = m.accel.lightsInside();
    return memory;
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
