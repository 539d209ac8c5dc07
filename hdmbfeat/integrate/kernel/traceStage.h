// The stages that ask the acceleration structure: closest hits of all active paths, and which
// shadow rays pass.
#pragma once

#include <numeric>

#include "integrate/kernel/hitLanes.h"
#include "integrate/kernel/kernelState.h"
#include "integrate/surfacePoint.h"
#include "shading/material.h"

namespace mbfeat {

/// Cut-out surfaces passed on one segment before the path is given up.
inline constexpr int kMaxPasses = 256;

/// Rays of packets of `N`, and one at a time where there are fewer lanes than a packet has.
template <class T>
class TraceStage {
public:
    explicit TraceStage(KernelState<T>& state) : s_(state), accel_(state.context->accel) {}

    /// Traces the active paths to vertex number `vertex` and sorts them into surfaces, lights and
    /// misses.
    void closest(int vertex) {
        s_.surfaces.clear();
        s_.lights.clear();
        s_.misses.clear();
        if (vertex > 0 && sorts()) {
            s_.sorter.sort(s_.active, accel_.bounds(), [&](std::int32_t slot) {
                return RayPlace{s_.paths.get3(kOrigin, slot), s_.paths.get3(kDirection, slot)};
            });
        }
        for (std::size_t i = 0; i < s_.active.size(); i += kPacket) {
            closestPacket(s_.active.data() + i, s_.active.size() - i, vertex);
        }
    }

    /// Traces the queue of shadow rays and adds what passes: contributions of `vertex`.
    template <bool Record>
    void shadows(int vertex) {
        const ShadowQueue& queue = s_.shadows;
        std::vector<std::int32_t>& order = s_.shadowOrder;
        order.resize(static_cast<std::size_t>(queue.size()));
        std::iota(order.begin(), order.end(), 0);
        if (s_.template handles<Effect::kCutouts>() && accel_.mayCutOut()) {
            for (const std::int32_t entry : order) {
                addShadowed<Record>(vertex, entry, visibility(entry));
            }
            return;
        }
        if (sorts()) {
            s_.sorter.sort(order, accel_.bounds(), [&](std::int32_t entry) {
                return RayPlace{queue.get3(kShadowOrigin, entry),
                                queue.get3(kShadowDirection, entry)};
            });
        }
        s_.counts.shadowRays += order.size();
        for (std::size_t i = 0; i < order.size(); i += kPacket) {
            occludedPacket<Record>(order.data() + i, order.size() - i, vertex);
        }
    }

private:
    static constexpr int kWidth = LaneTraits<T>::kWidth;
    static constexpr bool kPackets = kWidth == 8 || kWidth == 16;
    static constexpr int kPacket = kPackets ? kWidth : 1;
    /// Below it the acceleration structure lies in the caches and sorting rays gains nothing.
    static constexpr std::size_t kSortFrom = 100000;

    float limitOf(int vertex) const {
        const RenderOptions& options = s_.context->options;
        return vertex == 0 ? options.clampDirect : options.clampIndirect;
    }
    bool sorts() const { return accel_.triangleCount() + accel_.instanceCount() >= kSortFrom; }

    IntLane<T> looseShapes(const Vec3<T>& origin, const Vec3<T>& direction, const T& tNear,
                           T& tFar) const {
        return s_.template handles<Effect::kAreaLights>()
                   ? accel_.template meetLooseShapes<T>(origin, direction, tNear, tFar)
                   : IntLane<T>(-1);
    }

    void closestPacket(const std::int32_t* slots, std::size_t left, int vertex) {
        PathStream& paths = s_.paths;
        if constexpr (kPackets) {
            const auto g = s_.group(slots, left);
            alignas(64) typename EmbreePacket<kPacket>::RayHit query;
            alignas(64) int valid[kPacket];
            const LaneQuad<T> from = paths.template get<T>(kOrigin, g.read);
            const LaneQuad<T> along = paths.template get<T>(kDirection, g.read);
            storeLanes<T>(query.ray.org_x, from.x);
            storeLanes<T>(query.ray.org_y, from.y);
            storeLanes<T>(query.ray.org_z, from.z);
            storeLanes<T>(query.ray.tnear, from.w);
            storeLanes<T>(query.ray.dir_x, along.x);
            storeLanes<T>(query.ray.dir_y, along.y);
            storeLanes<T>(query.ray.dir_z, along.z);
            storeLanes<T>(query.ray.tfar, along.w);
            storeLanes<T>(query.ray.time, T(0));
            for (int i = 0; i < kPacket; ++i) {
                valid[i] = i < g.count ? -1 : 0;
                query.ray.mask[i] = ~0U;
                query.ray.id[i] = 0;
                query.ray.flags[i] = 0;
                query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
                query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
            }
            accel_.template intersectPacket<kPacket>(valid, query, vertex == 0);
            alignas(64) std::int32_t shape[kPacket];
            T tFar = loadLanes<T>(query.ray.tfar);
            storeIntLanes<T>(shape, looseShapes(from.xyz(), along.xyz(), from.w, tFar));
            const LaneBuffer<T> t(tFar);
            for (int i = 0; i < g.count; ++i) {
                take(slots[i], vertex,
                     shape[i] >= 0 ? accel_.lightHit(static_cast<std::uint32_t>(shape[i]), t[i])
                                   : accel_.decode(query.hit.geomID[i], query.hit.instID[0][i],
                                                   query.hit.primID[i], query.ray.tfar[i],
                                                   query.hit.u[i], query.hit.v[i]));
            }
            s_.counts.rays += static_cast<std::uint64_t>(g.count);
        } else {
            const std::int32_t slot = slots[0];
            ++s_.counts.rays;
            take(slot, vertex,
                 accel_.intersect(paths.get3(kOrigin, slot), paths.get3(kDirection, slot),
                                  paths.value(kNear, slot), paths.value(kFar, slot), vertex == 0));
        }
    }

    /// Files a path under what it met; cut-outs and lights hidden from the camera are passed.
    void take(std::int32_t slot, int vertex, RayHit hit) {
        PathStream& paths = s_.paths;
        float distance = hit.t;
        const bool hidden = hit.kind == RayHit::Kind::kLight && vertex == 0 &&
                            !s_.context->lights.visibleToCamera(hit.light);
        const bool maybeThere = s_.template handles<Effect::kCutouts>() &&
                                hit.kind == RayHit::Kind::kSurface &&
                                accel_.geometries()[hit.geometry]->mayCutOut;
        if (hidden || maybeThere) {
            distance = pass(slot, vertex, hit);
        }
        paths.value(kDistance, slot) = distance;
        switch (hit.kind) {
        case RayHit::Kind::kNone:
            s_.misses.push_back(slot);
            break;
        case RayHit::Kind::kLight:
            paths.integer(kHitTriangle, slot) = static_cast<std::int32_t>(hit.light);
            s_.lights.push_back(slot);
            break;
        case RayHit::Kind::kSurface:
            paths.integer(kHitGeometry, slot) = static_cast<std::int32_t>(hit.geometry);
            paths.integer(kHitInstance, slot) = static_cast<std::int32_t>(hit.instance);
            paths.integer(kHitTriangle, slot) = static_cast<std::int32_t>(hit.triangle);
            paths.value(kHitB1, slot) = hit.b1;
            paths.value(kHitB2, slot) = hit.b2;
            s_.surfaces.push_back(slot);
            break;
        }
    }

    /// Goes on behind `hit` until something is there; returns the distance to that.
    float pass(std::int32_t slot, int vertex, RayHit& hit) {
        const LightSampler& lights = s_.context->lights;
        Float3 origin = s_.paths.get3(kOrigin, slot);
        const Float3 direction = s_.paths.get3(kDirection, slot);
        float tFar = s_.paths.value(kFar, slot);
        float distance = 0.0F;
        float u = -1.0F;
        for (int passes = 0; passes < kMaxPasses; ++passes) {
            if (hit.kind == RayHit::Kind::kNone) {
                return distance;
            }
            float step = hit.t;
            if (hit.kind == RayHit::Kind::kLight) {
                if (vertex > 0 || lights.visibleToCamera(hit.light)) {
                    return distance + hit.t;
                }
                // Just behind the light: the shape is analytic, so a relative step is enough.
                step = hit.t * (1.0F + 0x1p-18F);
                origin = origin + direction * step;
            } else {
                const AccelGeometry& geometry = *accel_.geometries()[hit.geometry];
                if (!geometry.mayCutOut) {
                    return distance + hit.t;
                }
                const float opacity = evaluateOpacity(bindingAt(geometry, hit.triangle),
                                                      hit.triangle, hit.b1, hit.b2);
                if (u < 0.0F) {
                    u = s_.samplerOf(slot).get1D(vertexDimension(vertex) + kDimCutout);
                }
                if (opacity >= 1.0F || u < opacity) {
                    return distance + hit.t;
                }
                // What is left of the number, uniform again, decides the next surface.
                u = min((u - opacity) / (1.0F - opacity), kOneMinusEpsilon);
                const SurfacePoint point = surfacePoint(geometry, hit);
                origin = offsetRayOrigin(point.p, point.pError, point.ng, direction);
            }
            distance += step;
            tFar -= step;
            ++s_.counts.rays;
            hit = accel_.intersect(origin, direction, kSurfaceNear, tFar, vertex == 0);
        }
        hit = RayHit();
        return distance;
    }

    template <bool Record>
    void occludedPacket(const std::int32_t* entries, std::size_t left, int vertex) {
        const ShadowQueue& queue = s_.shadows;
        if constexpr (kPackets) {
            alignas(64) typename EmbreePacket<kPacket>::Ray query;
            alignas(64) int valid[kPacket];
            std::int32_t rows[kPacket];
            const int count = static_cast<int>(std::min<std::size_t>(left, kPacket));
            for (int i = 0; i < kPacket; ++i) {
                rows[i] = entries[i < count ? i : 0];
                valid[i] = i < count ? -1 : 0;
                query.mask[i] = ~0U;
                query.id[i] = 0;
                query.flags[i] = 0;
            }
            const LaneQuad<T> from = queue.get<T>(kShadowOrigin, rows);
            const LaneQuad<T> along = queue.get<T>(kShadowDirection, rows);
            storeLanes<T>(query.org_x, from.x);
            storeLanes<T>(query.org_y, from.y);
            storeLanes<T>(query.org_z, from.z);
            storeLanes<T>(query.dir_x, along.x);
            storeLanes<T>(query.dir_y, along.y);
            storeLanes<T>(query.dir_z, along.z);
            storeLanes<T>(query.tfar, from.w);
            storeLanes<T>(query.tnear, T(kSurfaceNear));
            storeLanes<T>(query.time, T(0));
            accel_.template occludedPacket<kPacket>(valid, query);

            const std::uint32_t bits = (std::uint32_t{1} << count) - 1U;
            T tFar = from.w;
            const IntLane<T> shape = looseShapes(from.xyz(), along.xyz(), T(kSurfaceNear), tFar);
            const Mask<T> passed =
                loadLanes<T>(query.tfar) >= T(0) && maskOfBits<T>(bits) && toFloat(shape) < T(0);
            if (none(passed)) {
                return;
            }
            alignas(64) std::int32_t slots[kPacket];
            storeIntLanes<T>(slots, s_.writeIf(passed, bitsOf(along.w)));
            s_.addContribution(
                vertex, slots,
                clampTo<T>(queue.get<T>(kShadowContribution, rows).xyz(), limitOf(vertex)));
            if (Record && vertex < kFeatureVertices) {
                const Vec3<T> direct = queue.get<T>(kShadowDirect, rows).xyz();
                const int field = MBFEAT_RECORD_FIELD(features[0].direct) + kVertexStride * vertex;
                if (vertex + 1 < kFeatureVertices) {
                    // What lies behind is the next vertex's, which is not there yet.
                    s_.setRecord(field, slots, {direct, T(0)});
                } else {
                    s_.setRecord3(field, slots, direct);
                }
                s_.checkFinite(slots, direct, direct);
            }
        } else {
            const std::int32_t entry = entries[0];
            const bool blocked = accel_.occluded(queue.get3(kShadowOrigin, entry),
                                                 queue.get3(kShadowDirection, entry), kSurfaceNear,
                                                 queue.value(kShadowFar, entry));
            addShadowed<Record>(vertex, entry, blocked ? 0.0F : 1.0F);
        }
    }

    template <bool Record>
    void addShadowed(int vertex, std::int32_t entry, float visible) {
        if (visible == 0.0F) {
            return;
        }
        const ShadowQueue& queue = s_.shadows;
        const std::int32_t slot = queue.slot(entry);
        s_.addContributionOf(
            slot, vertex,
            clampTo(queue.get3(kShadowContribution, entry) * visible, limitOf(vertex)));
        if (Record && vertex < kFeatureVertices) {
            PathRecord& record = s_.records[static_cast<std::size_t>(slot)];
            record.features[vertex].direct = queue.get3(kShadowDirect, entry) * visible;
            record.nonFinite = record.nonFinite || !isFinite(record.features[vertex].direct);
        }
    }

    /// Fraction of light that passes along a shadow ray where cut-outs stand.
    float visibility(std::int32_t entry) {
        Float3 origin = s_.shadows.get3(kShadowOrigin, entry);
        const Float3 direction = s_.shadows.get3(kShadowDirection, entry);
        float tFar = s_.shadows.value(kShadowFar, entry);
        float passed = 1.0F;
        for (int pass = 0; pass < kMaxPasses; ++pass) {
            ++s_.counts.shadowRays;
            const RayHit hit = accel_.intersect(origin, direction, kSurfaceNear, tFar, false);
            if (hit.kind != RayHit::Kind::kSurface) {
                return hit.kind == RayHit::Kind::kNone ? passed : 0.0F;
            }
            const AccelGeometry& geometry = *accel_.geometries()[hit.geometry];
            if (!geometry.mayCutOut) {
                return 0.0F;
            }
            passed *= 1.0F - evaluateOpacity(bindingAt(geometry, hit.triangle), hit.triangle,
                                             hit.b1, hit.b2);
            if (passed <= 0.0F) {
                return 0.0F;
            }
            const SurfacePoint point = surfacePoint(geometry, hit);
            origin = offsetRayOrigin(point.p, point.pError, point.ng, direction);
            tFar -= hit.t;
        }
        return 0.0F;
    }

    KernelState<T>& s_;
    const Accel& accel_;
};

} // namespace mbfeat
