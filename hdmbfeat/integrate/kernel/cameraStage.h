// The stages at the camera: where paths start, and what a record says of the camera ray's hit.
#pragma once

#include <algorithm>
#include <iterator>

#include "integrate/kernel/kernelState.h"
#include "integrate/surfacePoint.h"

namespace mbfeat {

template <class T>
class CameraStage {
public:
    explicit CameraStage(KernelState<T>& state) : s_(state), context_(*state.context) {}

    /// Path i starts at samples[i] in slot i.
    void start(const PixelSample* samples, int count) {
        const RenderOptions& options = context_.options;
        s_.active.clear();
        for (int i = 0; i < count; ++i) {
            const PixelSample& at = samples[i];
            const SamplerKey key =
                SamplerKey::make(at.x, at.y, at.index, options.seed, context_.frame);
            const Sampler sampler(key);
            PathRecord& record = s_.records[static_cast<std::size_t>(i)];
            reset(record);
            const FilterSample offset = context_.filter.sample(sampler.get2D(kDimPixel));
            record.subpixel = {0.5F + offset.offset.x, 0.5F + offset.offset.y};
            record.filterWeight = offset.weight;
            const CameraRay ray =
                context_.camera.generate({static_cast<float>(at.x) + record.subpixel.x,
                                          static_cast<float>(at.y) + record.subpixel.y},
                                         sampler.get2D(kDimLens));
            startPath(i, key, ray);
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
        const std::uint32_t flags = context_.recordFlags;
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
        constexpr std::uint32_t kOthers =
            ~static_cast<std::uint32_t>(kRecordFeatures | kRecordContributions);
        if ((flags & kOthers) != 0) {
            resetOthers(record);
        }
    }

    static void resetOthers(PathRecord& record) {
        const PathRecord fresh;
        std::copy(std::begin(fresh.extended), std::end(fresh.extended), record.extended);
        record.nonDeltaAlbedo = fresh.nonDeltaAlbedo;
        record.nonDeltaNormal = fresh.nonDeltaNormal;
        record.nonDeltaDepth = fresh.nonDeltaDepth;
        record.nonDeltaTint = fresh.nonDeltaTint;
        record.primId = fresh.primId;
        record.instanceId = fresh.instanceId;
        record.elementId = fresh.elementId;
        record.depth = fresh.depth;
        record.cameraDepth = fresh.cameraDepth;
        record.normal = fresh.normal;
        record.eyeNormal = fresh.eyeNormal;
        std::copy(std::begin(fresh.primvars), std::end(fresh.primvars), record.primvars);
    }

    void startPath(int slot, const SamplerKey& key, const CameraRay& ray) {
        PathStream& paths = s_.paths;
        paths.set3(kOrigin, slot, ray.origin);
        paths.value(kNear, slot) = ray.tNear;
        paths.set3(kDirection, slot, ray.direction);
        paths.value(kFar, slot) = ray.tFar;
        paths.set3(kThroughput, slot, Rgb(1.0F));
        paths.value(kEtaScale, slot) = 1.0F;
        paths.set3(kReceiverP, slot, ray.origin);
        paths.value(kBsdfPdf, slot) = 0.0F;
        paths.set3(kReceiverN, slot, LightReceiver().n);
        paths.integer(kKeyLow, slot) = static_cast<std::int32_t>(key.low);
        paths.integer(kKeyHigh, slot) = static_cast<std::int32_t>(key.high);
        paths.integer(kKeyIndex, slot) = static_cast<std::int32_t>(key.index);
        paths.integer(kFlags, slot) = kFlagDelta | kFlagTwoSided;
        if ((context_.recordFlags & kRecordFirstNonDelta) != 0) {
            paths.set3(kTint, slot, Rgb(1.0F));
            paths.value(kPathLength, slot) = 0.0F;
        }
        s_.active.push_back(slot);
    }

    bool recordsFirstHit() const {
        return (context_.recordFlags & (kRecordFirstHit | kRecordPrimvars)) != 0;
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
        for (std::size_t i = 0; i < names.size() && i < kMaxPrimvarAovs; ++i) {
            record.primvars[i] = primvarAt(geometry, hit, names[i]);
        }
    }

    KernelState<T>& s_;
    const PathContext& context_;
};

} // namespace mbfeat
