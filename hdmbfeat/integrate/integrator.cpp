#include "integrate/integrator.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <string>

#include "core/pixelFilter.h"
#include "core/sampler.h"
#include "integrate/accel.h"
#include "integrate/cameraRay.h"
#include "integrate/census.h"
#include "integrate/dimensions.h"
#include "integrate/pathTracer.h"
#include "integrate/surfacePoint.h"
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

/// Flags that make the path itself be recorded vertex by vertex; contributions always are.
constexpr std::uint32_t kPathFlags = kRecordFeatures | kRecordExtended | kRecordFirstNonDelta;

/// Only this many bad samples are logged one by one; all are counted.
constexpr int kLoggedNonFinite = 8;

bool finiteRecord(const PathRecord& record) {
    bool finite = isFinite(record.radiance) && isFinite(record.emission) && isFinite(record.tail);
    for (int k = 0; k < kFeatureVertices; ++k) {
        finite = finite && isFinite(record.contributions[k]) &&
                 isFinite(record.features[k].albedo) && isFinite(record.features[k].normal) &&
                 isFinite(record.features[k].direct);
    }
    return finite;
}

void scaleExposure(PathRecord& record, float scale) {
    if (scale == 1.0F) {
        return;
    }
    record.radiance *= scale;
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

    void recordFirstHit(const RayHit& hit, const CameraRay& ray, PathRecord& record) const {
        record.depth = 1.0F;
        if (hit.kind == RayHit::Kind::kNone) {
            return;
        }
        const Float3 p = ray.origin + ray.direction * record.distance;
        record.cameraDepth = camera.viewDepth(p);
        record.depth = camera.projectedDepth(record.cameraDepth);
        record.eyeNormal = camera.toCamera(record.normal);
        if (hit.kind != RayHit::Kind::kSurface) {
            return;
        }
        const AccelGeometry& geometry = *accel.geometries()[hit.geometry];
        const std::vector<std::int32_t>& ids = geometry.source->instanceIds;
        record.primId = geometry.source->primId;
        record.instanceId =
            ids.empty() ? static_cast<std::int32_t>(hit.instance) : ids[hit.instance];
        record.elementId = static_cast<std::int32_t>(geometry.mesh->faceOf(hit.triangle));
        for (std::size_t i = 0; i < request.primvars.size() && i < kMaxPrimvarAovs; ++i) {
            record.primvars[i] = primvarAt(geometry, hit, request.primvars[i]);
        }
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
            (request.messages != nullptr ? *request.messages : scene.diagnostics())
                .warn("pixel " + std::to_string(x) + ", " + std::to_string(y),
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
    m.camera = CameraRays(camera, window, m.scene.origin());
    m.filter = FilterSampler(request.options.pixelFilter, request.options.pixelFilterWidth);
    return {};
}

void Integrator::trace(int x, int y, std::uint32_t sampleIndex, PathRecord& record) const {
    const Impl& m = *impl_;
    const RenderOptions& options = m.request.options;
    record = PathRecord{};
    const Sampler sampler(x, y, sampleIndex, options.seed, m.request.frame);

    const FilterSample offset = m.filter.sample(sampler.get2D(kDimPixel));
    record.subpixel = {0.5F + offset.offset.x, 0.5F + offset.offset.y};
    record.filterWeight = offset.weight;
    const CameraRay ray = m.camera.generate(
        {static_cast<float>(x) + record.subpixel.x, static_cast<float>(y) + record.subpixel.y},
        sampler.get2D(kDimLens));

    const PathTracer tracer{m.accel, m.lights, options, m.lightsHaveMultipliers};
    RayHit firstHit;
    const PathCounts spent = (m.request.recordFlags & kPathFlags) != 0
                                 ? tracer.trace<true>(ray, sampler, record, firstHit)
                                 : tracer.trace<false>(ray, sampler, record, firstHit);
    if ((m.request.recordFlags & (kRecordFirstHit | kRecordPrimvars)) != 0) {
        m.recordFirstHit(firstHit, ray, record);
    }
    scaleExposure(record, m.camera.exposureScale());

    CounterShard& counters = m.counters[shardOfThread()];
    counters.paths.fetch_add(1, std::memory_order_relaxed);
    counters.rays.fetch_add(spent.rays, std::memory_order_relaxed);
    counters.shadowRays.fetch_add(spent.shadowRays, std::memory_order_relaxed);
    if (!finiteRecord(record)) {
        m.rejectNonFinite(x, y, sampleIndex, record);
    }
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
