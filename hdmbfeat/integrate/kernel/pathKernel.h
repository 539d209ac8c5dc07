// The path tracer: unidirectional, next-event estimation with multiple importance sampling, Russian
// roulette and splitting. One page: follow(). A batch of paths moves from vertex to vertex
// together, so that rays can be traced in packets, sorted, and vertices shaded as many at a time as
// there are lanes.
//
// T is the lane type: float is the readable reference, a SIMD batch the production kernel. Each
// path gets the same bits from all of them, in any company.
#pragma once

#include <numeric>

#include "integrate/kernel/cameraStage.h"
#include "integrate/kernel/endStage.h"
#include "integrate/kernel/shadeStage.h"
#include "integrate/kernel/traceStage.h"

namespace mbfeat {

/// E: the parts of the closure that surfaces of the scene have (BsdfPart).
template <class T, std::uint32_t E>
class PathKernel final : public PathWorker {
public:
    /// `recordFlags`: what the records have room for.
    PathKernel(int capacity, int branches, bool allFields, std::uint32_t recordFlags)
        : s_(capacity, branches, allFields, recordFlags) {}

    bool trace(const PathContext& context, const PixelSample* samples, int count,
               const StopCheck& stop) override {
        s_.context = &context;
        return (s_.recordFlags() & kPathRecordFlags) != 0 ? follow<true>(samples, count, stop)
                                                          : follow<false>(samples, count, stop);
    }
    int capacity() const override { return s_.capacity; }
    std::size_t stateBytes() const override { return s_.paths.bytes() + s_.shadows.bytes(); }
    std::size_t recordBytes() const override { return s_.recordFloats.size() * sizeof(float); }
    PathRecords records() override { return s_.records; }
    const PathCounts& counts() const override { return s_.counts; }

private:
    template <bool Record>
    bool follow(const PixelSample* samples, int count, const StopCheck& stop) {
        CameraStage<T> camera(s_);
        TraceStage<T> trace(s_);
        EndStage<T> end(s_);
        ShadeStage<T, Record, E> shade(s_);
        camera.start(samples, count);
        for (int vertex = 0; !s_.active.empty(); ++vertex) {
            if (stop && stop()) {
                return false;
            }
            trace.closest(vertex);
            if (vertex == 0) {
                camera.recordArrivals(count);
            }
            end.misses(vertex);
            end.template lights<Record>(vertex);
            materialOrder();
            shade.run(vertex);
            if (vertex == 0) {
                camera.recordEyeNormals();
            }
            trace.template shadows<Record>(vertex);
            s_.active.swap(s_.survivors);
        }
        s_.joinBranches();
        return true;
    }

    /// Paths on the same material come to lie side by side; stable, so that rays that were traced
    /// together stay together.
    void materialOrder() {
        const std::size_t materials = s_.context->accel.bindingCount();
        if (materials < 2 || s_.surfaces.size() < 2) {
            return;
        }
        const std::size_t bins = std::min<std::size_t>(materials, kMaterialBins);
        binStart_.assign(bins + 1, 0);
        binOf_.clear();
        for (const std::int32_t slot : s_.surfaces) {
            const AccelGeometry& geometry =
                *s_.context->accel
                     .geometries()[static_cast<std::size_t>(s_.paths.integer(kHitGeometry, slot))];
            const std::uint32_t number =
                geometry.firstBinding + geometry.mesh->materialSlotOf(static_cast<std::uint32_t>(
                                            s_.paths.integer(kHitTriangle, slot)));
            binOf_.push_back(static_cast<std::uint16_t>(number % bins));
            ++binStart_[binOf_.back() + std::size_t{1}];
        }
        std::partial_sum(binStart_.begin(), binStart_.end(), binStart_.begin());
        ordered_.resize(s_.surfaces.size());
        for (std::size_t i = 0; i < s_.surfaces.size(); ++i) {
            ordered_[binStart_[binOf_[i]]++] = s_.surfaces[i];
        }
        s_.surfaces.swap(ordered_);
    }

    static constexpr std::size_t kMaterialBins = 4096;

    KernelState<T> s_;
    std::vector<std::uint32_t> binStart_;
    std::vector<std::uint16_t> binOf_;
    std::vector<std::int32_t> ordered_;
};

} // namespace mbfeat
