// The stages at the camera: where paths start, and what a record says of the camera ray's hit.
#pragma once

#include <algorithm>
#include <iterator>
#include <numeric>

#include "integrate/kernel/kernelState.h"
#include "integrate/surfacePoint.h"

namespace mbfeat {

template <class T>
class CameraStage {
public:
    explicit CameraStage(KernelState<T>& state) : s_(state), context_(*state.context) {}

    /// Path i starts at samples[i] in slot i.
    void start(const PixelSample* samples, int count) {
        s_.branches.clear(); // of the batch before, which may have been stopped
        s_.active.resize(static_cast<std::size_t>(count));
        std::iota(s_.active.begin(), s_.active.end(), 0);
        for (int i = 0; i < count; i += kWidth) {
            startGroup(samples, s_.group(s_.active.data() + i,
                                         s_.active.size() - static_cast<std::size_t>(i)));
        }
    }

    /// What the camera ray of each path met, once the first segments are traced.
    void recordArrivals(int count) {
        for (int i = 0; i < count; ++i) {
            PathRecord& record = s_.records[static_cast<std::size_t>(i)];
            record.alpha = 1.0F;
        }
        for (const std::int32_t slot : s_.misses) {
            s_.records[static_cast<std::size_t>(slot)].alpha = 0.0F;
        }
        if (!recordsFirstHit()) {
            return;
        }
        for (int i = 0; i < count; ++i) {
            s_.records[static_cast<std::size_t>(i)].distance = s_.paths.value(kDistance, i);
        }
        for (const std::int32_t slot : s_.misses) {
            s_.records[static_cast<std::size_t>(slot)].distance = 0.0F;
        }
        for (const std::int32_t slot : s_.lights) {
            recordDepth(slot);
        }
        for (const std::int32_t slot : s_.surfaces) {
            recordDepth(slot);
            recordSurface(slot);
        }
    }

    /// Normals in camera space, once the first vertices are shaded.
    void recordEyeNormals() {
        if (!recordsFirstHit()) {
            return;
        }
        for (const std::int32_t slot : s_.surfaces) {
            PathRecord& record = s_.records[static_cast<std::size_t>(slot)];
            record.eyeNormal = context_.camera.toCamera(record.normal);
        }
    }

private:
    /// Only what somebody reads: to write the rest would be most of the work of recording.
    void reset(PathRecord& record) const {
        const std::uint32_t flags = s_.recordFlags();
        record.radiance = Rgb(0.0F);
        record.nonFinite = false;
        if (flags == kRecordColor) {
            return;
        }
        record.vertexCount = 0;
        if ((flags & kRecordFeatures) != 0) {
            std::fill(std::begin(record.features), std::end(record.features), VertexFeatures());
        }
        if ((flags & kRecordContributions) != 0) {
            record.emission = Rgb(0.0F);
            std::fill(std::begin(record.contributions), std::end(record.contributions), Rgb(0.0F));
            record.tail = Rgb(0.0F);
        }
        const PathRecord fresh;
        if ((flags & kRecordExtended) != 0) {
            std::copy(std::begin(fresh.extended), std::end(fresh.extended), record.extended);
        }
        if ((flags & kRecordFirstNonDelta) != 0) {
            record.nonDeltaAlbedo = fresh.nonDeltaAlbedo;
            record.nonDeltaNormal = fresh.nonDeltaNormal;
            record.nonDeltaDepth = fresh.nonDeltaDepth;
            record.nonDeltaTint = fresh.nonDeltaTint;
        }
        if (recordsFirstHit()) {
            record.primId = fresh.primId;
            record.instanceId = fresh.instanceId;
            record.elementId = fresh.elementId;
            record.depth = fresh.depth;
            record.cameraDepth = fresh.cameraDepth;
            record.normal = fresh.normal;
            record.eyeNormal = fresh.eyeNormal;
        }
        if ((flags & kRecordPrimvars) != 0) {
            std::copy(std::begin(fresh.primvars), std::end(fresh.primvars), record.primvars);
        }
    }

    static constexpr int kWidth = LaneTraits<T>::kWidth;

    void startGroup(const PixelSample* samples, const typename KernelState<T>::Group& g) {
        alignas(64) std::int32_t low[kWidth], high[kWidth], index[kWidth];
        for (int i = 0; i < kWidth; ++i) {
            const PixelSample& at = samples[g.read[i]];
            const SamplerKey key =
                SamplerKey::make(at.x, at.y, at.index, context_.options.seed, context_.frame);
            low[i] = static_cast<std::int32_t>(key.low);
            high[i] = static_cast<std::int32_t>(key.high);
            index[i] = static_cast<std::int32_t>(key.index);
        }
        const LaneQuad<T> keys(valueOfBits(loadIntLanes<T>(low)),
                               valueOfBits(loadIntLanes<T>(high)),
                               valueOfBits(loadIntLanes<T>(index)),
                               valueOfBits(IntLane<T>(kFlagDelta | kFlagTwoSided)));
        const LaneSampler<T> sampler = samplerOf(keys);
        const Vec2<T> position = filmPositions(samples, g, sampler.get2D(kDimPixel));
        const Vec2<T> lens = kBuiltEffects.has(Effect::kDepthOfField) && context_.camera.hasLens()
                                 ? sampler.get2D(kDimLens)
                                 : Vec2<T>(T(0));
        startPaths(g, context_.camera.generate(position, lens), keys);
    }

    /// Places in the display window, distributed as the pixel filter wants it.
    Vec2<T> filmPositions(const PixelSample* samples, const typename KernelState<T>::Group& g,
                          const Vec2<T>& u) {
        const LaneBuffer<T> ux(u.x), uy(u.y);
        LaneBuffer<T> x, y;
        for (int i = 0; i < kWidth; ++i) {
            const PixelSample& at = samples[g.read[i]];
            const FilterSample offset = context_.filter.sample({ux[i], uy[i]});
            const Float2 subpixel(0.5F + offset.offset.x, 0.5F + offset.offset.y);
            x[i] = static_cast<float>(at.x) + subpixel.x;
            y[i] = static_cast<float>(at.y) + subpixel.y;
            if (i < g.count) {
                PathRecord& record = s_.records[static_cast<std::size_t>(g.read[i])];
                reset(record);
                record.subpixel = subpixel;
                record.filterWeight = offset.weight;
            }
        }
        return {x.lanes(), y.lanes()};
    }

    void startPaths(const typename KernelState<T>::Group& g, const CameraRay<T>& ray,
                    const LaneQuad<T>& keys) {
        PathStream& paths = s_.paths;
        const T zero(0), one(1);
        const Float3 n = LightReceiver().n;
        paths.template set<T>(kOrigin, g.write, {ray.origin, ray.tNear});
        paths.template set<T>(kDirection, g.write, {ray.direction, ray.tFar});
        paths.template set<T>(kThroughput, g.write, {one, one, one, one}); // and kRouletteScale
        paths.template set<T>(kReceiverP, g.write, {ray.origin, zero});
        paths.template set<T>(kReceiverN, g.write, {Vec3<T>(n), zero});
        paths.template set<T>(kKeys, g.write, keys);
        if ((s_.recordFlags() & kRecordFirstNonDelta) != 0) {
            paths.template set<T>(kTint, g.write, {one, one, one, zero}); // and kPathLength
        }
    }

    bool recordsFirstHit() const {
        return (s_.recordFlags() & (kRecordFirstHit | kRecordPrimvars)) != 0;
    }

    void recordDepth(std::int32_t slot) {
        PathRecord& record = s_.records[static_cast<std::size_t>(slot)];
        const Float3 p =
            s_.paths.get3(kOrigin, slot) + s_.paths.get3(kDirection, slot) * record.distance;
        record.cameraDepth = context_.camera.viewDepth(p);
        record.depth = context_.camera.projectedDepth(record.cameraDepth);
    }

    void recordSurface(std::int32_t slot) {
        PathRecord& record = s_.records[static_cast<std::size_t>(slot)];
        const RayHit hit = s_.hit(slot);
        const AccelGeometry& geometry = *context_.accel.geometries()[hit.geometry];
        const std::vector<std::int32_t>& ids = geometry.source->instanceIds;
        record.primId = geometry.source->primId;
        record.instanceId =
            ids.empty() ? static_cast<std::int32_t>(hit.instance) : ids[hit.instance];
        record.elementId = static_cast<std::int32_t>(geometry.mesh->faceOf(hit.triangle));
        const std::vector<std::string>& names = context_.primvars;
        const bool wanted = (s_.recordFlags() & kRecordPrimvars) != 0;
        for (std::size_t i = 0; wanted && i < names.size() && i < kMaxPrimvarAovs; ++i) {
            record.primvars[i] = primvarAt(geometry, hit, names[i]);
        }
    }

    KernelState<T>& s_;
    const PathContext& context_;
};

} // namespace mbfeat
