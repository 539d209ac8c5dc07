#include "integrate/pathTracer.h"

#include <limits>

#include "core/frame.h"
#include "core/rayOffset.h"
#include "integrate/dimensions.h"
#include "integrate/surfacePoint.h"
#include "shading/previewSurface.h"

namespace mbfeat {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Start of rays that leave a surface. Where a surface is exactly axis-aligned its error bound, and
/// so the offset, can be zero: a hit at distance zero is the surface itself.
constexpr float kSurfaceNear = std::numeric_limits<float>::min();
/// Cut-out surfaces passed on one segment before the path is given up.
constexpr int kMaxPasses = 256;

/// Power heuristic with exponent 2 (Veach and Guibas 1995); robust for large and zero densities.
float misWeight(float pdf, float otherPdf) {
    if (!(pdf > 0.0F)) {
        return 0.0F;
    }
    const float ratio = otherPdf / pdf;
    return 1.0F / (1.0F + ratio * ratio);
}

Rgb clampTo(const Rgb& value, float limit) {
    const float largest = maxComponent(value);
    return limit > 0.0F && largest > limit ? value * (limit / largest) : value;
}

float hashToUnit(float u, int pass) {
    // Further numbers for surfaces behind the first cut-out of a segment: rotations of the
    // sampler's number by the golden ratio stay uniform and keep its stratification.
    const float rotated = u + static_cast<float>(pass) * 0.61803398875F;
    return min(rotated - floor(rotated), kOneMinusEpsilon);
}

/// What of a path is carried from vertex to vertex.
struct PathState {
    Float3 origin, direction;
    float tNear = 0.0F, tFar = kInfinity;
    Rgb throughput{1.0F};
    float etaScale = 1.0F; ///< undoes the radiance scaling of refraction for roulette
    float distance = 0.0F; ///< of the current segment up to its origin, when cut-outs were passed
    float pathLength = 0.0F;

    // The scattering that made the current segment, for MIS.
    bool delta = true;
    float bsdfPdf = 0.0F;
    LightReceiver receiver;
    Rgb diffuseShare{0.0F}; ///< part of the scattered light that diffuse lobes made

    bool nonDeltaSeen = false;
    Rgb tint{1.0F}; ///< of the delta events so far
};

/// A vertex on a surface, ready for scattering.
struct SurfaceVertex {
    const AccelGeometry& geometry;
    const MaterialBinding& binding;
    SurfacePoint point;
    SurfaceParameters<float> parameters;
    bool outside; ///< the path arrives on the outside
    Float3 ng;    ///< geometric normal, facing the ray
    Frame<float> frame;
    Bsdf<float> bsdf;
    Bsdf<float>::Outgoing out; ///< towards where the path came from, in the shading frame
};

SurfaceVertex makeVertex(const Accel& accel, const RayHit& hit, const Float3& rayDirection) {
    const AccelGeometry& geometry = *accel.geometries()[hit.geometry];
    const MaterialBinding& binding = geometry.bindings[geometry.mesh->materialSlotOf(hit.triangle)];
    const SurfacePoint point = surfacePoint(geometry, hit);
    const SurfaceParameters<float> parameters =
        evaluateMaterial(binding, hit.triangle, hit.b1, hit.b2);
    const Float3 wo = -rayDirection;
    const bool outside = dot(wo, point.ng) >= 0.0F;
    const Float3 ng = outside ? point.ng : -point.ng;
    const Float3 mapped = mappedNormal(geometry, hit, point, parameters);
    const Float3 ns = visibleShadingNormal(outside ? mapped : -mapped, ng, wo);
    const Frame<float> frame = Frame<float>::fromNormal(ns);
    const Bsdf<float> bsdf(parameters, outside);
    return {geometry,   binding, point,
            parameters, outside, ng,
            frame,      bsdf,    bsdf.outgoing(frame.toLocal(wo))};
}

/// True where the geometric and the shading side of wi agree; else light would leak through.
bool sidesAgree(const SurfaceVertex& vertex, const Float3& wiWorld, float wiLocalZ) {
    return dot(wiWorld, vertex.ng) * wiLocalZ > 0.0F;
}

void addContribution(PathRecord& record, int vertex, const Rgb& value) {
    record.radiance += value;
    if (vertex < 0) {
        record.emission += value;
    } else if (vertex < kFeatureVertices) {
        record.contributions[vertex] += value;
    } else {
        record.tail += value;
    }
}

/// One path's progress through the scene. Members in the order in which trace() calls them.
template <bool Record>
struct PathWalk {
    const PathTracer& tracer;
    const Sampler& sampler;
    PathRecord& record;
    PathState path;
    PathCounts counts;

    float number(int vertex, VertexDimension dimension) const {
        return sampler.get1D(vertexDimension(vertex) + dimension);
    }
    Float2 pair(int vertex, VertexDimension dimension) const {
        return sampler.get2D(vertexDimension(vertex) + dimension);
    }

    /// Closest hit that is there: cut-outs and lights hidden from the camera are passed.
    RayHit nextHit(int vertex) {
        float u = -1.0F;
        for (int pass = 0; pass < kMaxPasses; ++pass) {
            ++counts.rays;
            const RayHit hit = tracer.accel.intersect(path.origin, path.direction, path.tNear,
                                                      path.tFar, vertex == 0);
            if (hit.kind == RayHit::Kind::kNone) {
                return hit;
            }
            float step = hit.t;
            if (hit.kind == RayHit::Kind::kLight) {
                if (vertex > 0 || tracer.lights.visibleToCamera(hit.light)) {
                    path.distance += hit.t;
                    return hit;
                }
                // Just behind the light: the shape is analytic, so a relative step is enough.
                step = hit.t * (1.0F + 0x1p-18F);
                path.origin = path.origin + path.direction * step;
            } else {
                const AccelGeometry& geometry = *tracer.accel.geometries()[hit.geometry];
                if (!geometry.mayCutOut) {
                    path.distance += hit.t;
                    return hit;
                }
                const MaterialBinding& binding =
                    geometry.bindings[geometry.mesh->materialSlotOf(hit.triangle)];
                const float opacity = evaluateOpacity(binding, hit.triangle, hit.b1, hit.b2);
                u = u < 0.0F ? number(vertex, kDimCutout) : u;
                if (opacity >= 1.0F || hashToUnit(u, pass) < opacity) {
                    path.distance += hit.t;
                    return hit;
                }
                const SurfacePoint point = surfacePoint(geometry, hit);
                path.origin = offsetRayOrigin(point.p, point.pError, point.ng, path.direction);
            }
            path.distance += step;
            path.tFar -= step;
            path.tNear = kSurfaceNear;
        }
        return {};
    }

    void addEmitted(int vertex, const Rgb& value) {
        const int source = vertex - 1;
        const float limit = source <= 0 ? tracer.options.clampDirect : tracer.options.clampIndirect;
        addContribution(record, source, source < 0 ? value : clampTo(value, limit));
    }

    /// Light that the current segment's scattering sees, with the light's own multipliers.
    Rgb scatteredMultiplier(std::uint32_t light) const {
        const float d = tracer.lights.diffuseMultiplier(light);
        const float s = tracer.lights.specularMultiplier(light);
        return d == 1.0F && s == 1.0F ? Rgb(1.0F)
                                      : path.diffuseShare * d + (Rgb(1.0F) - path.diffuseShare) * s;
    }

    void addEnvironments(int vertex) {
        const LightSampler& lights = tracer.lights;
        if (vertex == 0) {
            addEmitted(0, lights.environmentRadiance(path.direction, true));
            return;
        }
        for (std::uint32_t e = 0; e < lights.environmentCount(); ++e) {
            const Rgb radiance = lights.environmentRadiance(e, path.direction);
            if (isBlack(radiance)) {
                continue;
            }
            const float weight =
                path.delta ? 1.0F
                           : misWeight(path.bsdfPdf,
                                       lights.environmentPdf(e, path.receiver, path.direction));
            addEmitted(vertex, path.throughput * scatteredMultiplier(lights.lightOfEnvironment(e)) *
                                   radiance * weight);
        }
    }

    void addLight(int vertex, const RayHit& hit) {
        const LightHit seen =
            tracer.lights.evaluateHit(hit.light, path.receiver, path.direction, path.distance);
        const bool sampledByBsdfOnly = vertex == 0 || path.delta;
        const float weight = sampledByBsdfOnly ? 1.0F : misWeight(path.bsdfPdf, seen.pdf);
        const Rgb multiplier = vertex == 0 ? Rgb(1.0F) : scatteredMultiplier(hit.light);
        addEmitted(vertex, path.throughput * multiplier * seen.radiance * weight);
        if (Record && vertex < kFeatureVertices) {
            const float largest = maxComponent(seen.radiance);
            const Rgb base = largest > 0.0F ? seen.radiance / largest : Rgb(0.0F);
            const Float3 normal =
                dot(seen.normal, path.direction) > 0.0F ? -seen.normal : seen.normal;
            recordVertex(vertex, base, normal, Rgb(0.0F));
            record.extended[vertex].event = kEventEmission;
            recordNonDelta(base, normal);
        }
    }

    void addSurfaceEmission(int vertex, const SurfaceVertex& surface, const RayHit& hit) {
        const Rgb& emission = surface.parameters.emission;
        if (isBlack(emission)) {
            return;
        }
        float weight = 1.0F;
        if (vertex > 0 && !path.delta && surface.geometry.emits) {
            const AccelGeometry& geometry = surface.geometry;
            const std::int32_t entry = geometry.emissiveIndex[hit.triangle];
            if (entry >= 0) {
                const auto id = static_cast<std::uint32_t>(
                    geometry.emissiveBase +
                    static_cast<std::int32_t>(hit.instance) * geometry.emissiveCount + entry);
                weight = misWeight(path.bsdfPdf,
                                   tracer.lights.pdfTriangle(id, path.receiver, surface.point.p));
            }
        }
        addEmitted(vertex, path.throughput * emission * weight);
    }

    void recordVertex(int vertex, const Rgb& albedo, const Float3& normal, const Rgb& direct) {
        record.vertexCount = vertex + 1;
        record.features[vertex].albedo = albedo;
        record.features[vertex].normal = normal;
        record.features[vertex].direct = direct;
        record.extended[vertex].distance = path.distance;
        record.extended[vertex].throughput = path.throughput;
    }

    void recordNonDelta(const Rgb& albedo, const Float3& normal) {
        if (!path.nonDeltaSeen) {
            path.nonDeltaSeen = true;
            record.nonDeltaAlbedo = albedo;
            record.nonDeltaNormal = normal;
            record.nonDeltaDepth = path.pathLength + path.distance;
            record.nonDeltaTint = path.tint;
        }
    }

    /// Radiance of the sampled light; evaluated at the point where a mesh emits.
    Rgb sampledRadiance(const LightSample& light) const {
        if (light.triangle == kNoLight) {
            return light.radiance;
        }
        const EmissiveTriangleRef& ref = tracer.accel.emissiveTriangles()[light.triangle];
        const AccelGeometry& geometry = *tracer.accel.geometries()[ref.geometry];
        const MaterialBinding& binding =
            geometry.bindings[geometry.mesh->materialSlotOf(ref.triangle)];
        const Rgb emission = evaluateMaterial(binding, ref.triangle, light.b1, light.b2).emission;
        // Where a cut-out is not there it does not shine either.
        return geometry.mayCutOut
                   ? emission * evaluateOpacity(binding, ref.triangle, light.b1, light.b2)
                   : emission;
    }

    /// Fraction of light that passes from the vertex to the sampled point: 0 or 1, or between
    /// where cut-outs stand.
    float visibility(const SurfaceVertex& surface, const LightSample& light) {
        Float3 origin =
            offsetRayOrigin(surface.point.p, surface.point.pError, surface.ng, light.wi);
        Float3 direction = light.wi;
        float tFar = kInfinity;
        if (light.distance < kInfinity) {
            const RaySegment<float> segment =
                offsetSegment(surface.point.p, surface.point.pError, surface.ng, light.point,
                              light.pointError, light.normal);
            origin = segment.origin;
            direction = segment.direction;
            tFar = segment.length;
        }
        if (!tracer.accel.mayCutOut()) {
            ++counts.shadowRays;
            return tracer.accel.occluded(origin, direction, kSurfaceNear, tFar) ? 0.0F : 1.0F;
        }
        float passed = 1.0F;
        for (int pass = 0; pass < kMaxPasses; ++pass) {
            ++counts.shadowRays;
            const RayHit hit = tracer.accel.intersect(origin, direction, kSurfaceNear, tFar, false);
            if (hit.kind != RayHit::Kind::kSurface) {
                return hit.kind == RayHit::Kind::kNone ? passed : 0.0F;
            }
            const AccelGeometry& geometry = *tracer.accel.geometries()[hit.geometry];
            if (!geometry.mayCutOut) {
                return 0.0F;
            }
            const MaterialBinding& binding =
                geometry.bindings[geometry.mesh->materialSlotOf(hit.triangle)];
            passed *= 1.0F - evaluateOpacity(binding, hit.triangle, hit.b1, hit.b2);
            if (passed <= 0.0F) {
                return 0.0F;
            }
            const SurfacePoint point = surfacePoint(geometry, hit);
            origin = offsetRayOrigin(point.p, point.pError, point.ng, direction);
            tFar -= hit.t;
        }
        return 0.0F;
    }

    /// Next-event estimation. Returns direct:k, before path throughput.
    Rgb sampleDirect(int vertex, const SurfaceVertex& surface) {
        if (tracer.lights.empty() || !surface.bsdf.hasNonDelta()) {
            return Rgb(0.0F);
        }
        const LightReceiver receiver{surface.point.p, surface.frame.n,
                                     surface.parameters.opacity < 1.0F};
        const LightSample light = tracer.lights.sample(receiver, number(vertex, kDimLightChoice),
                                                       pair(vertex, kDimLight));
        if (!(light.pdf > 0.0F)) {
            return Rgb(0.0F);
        }
        const Float3 wi = surface.frame.toLocal(light.wi);
        if (!sidesAgree(surface, light.wi, wi.z)) {
            return Rgb(0.0F);
        }
        const BsdfValue<float> value = surface.bsdf.evaluate(surface.out, wi);
        const Rgb scattered = value.diffuse * light.diffuse + value.specular * light.specular;
        if (isBlack(scattered)) {
            return Rgb(0.0F);
        }
        const float visible = visibility(surface, light);
        if (visible == 0.0F) {
            return Rgb(0.0F);
        }
        const float weight = light.delta ? 1.0F : misWeight(light.pdf, value.pdf);
        return scattered * sampledRadiance(light) * (visible * weight / light.pdf);
    }

    /// Chooses the next segment; false where the path is absorbed.
    bool scatter(int vertex, const SurfaceVertex& surface) {
        const BsdfSample<float> sample =
            surface.bsdf.sample(surface.out, number(vertex, kDimBsdfLobe), pair(vertex, kDimBsdf));
        const Float3 wi = surface.frame.toWorld(sample.wi);
        if (!(sample.pdf > 0.0F) || isBlack(sample.weight) ||
            !sidesAgree(surface, wi, sample.wi.z)) {
            return false;
        }
        if (Record && vertex < kFeatureVertices) {
            VertexExtended& extended = record.extended[vertex];
            extended.roughness = sample.roughness;
            extended.event = (sample.transmitted ? kEventTransmit : kEventReflect) |
                             (sample.delta     ? kEventSpecular
                              : sample.diffuse ? kEventDiffuse
                                               : kEventGlossy);
        }
        path.diffuseShare = Rgb(0.0F);
        if (tracer.lightsHaveMultipliers && !sample.delta) {
            const BsdfValue<float> value = surface.bsdf.evaluate(surface.out, sample.wi);
            const Rgb total = value.total();
            for (int c = 0; c < 3; ++c) {
                path.diffuseShare[c] = total[c] > 0.0F ? value.diffuse[c] / total[c] : 0.0F;
            }
        }
        path.throughput *= sample.weight;
        path.etaScale *= sqr(sample.eta);
        path.delta = sample.delta;
        path.bsdfPdf = sample.pdf;
        path.receiver = {surface.point.p, surface.frame.n, surface.parameters.opacity < 1.0F};
        path.tint = sample.delta ? path.tint * sample.tint : path.tint;
        path.pathLength += path.distance;
        path.distance = 0.0F;
        path.origin = offsetRayOrigin(surface.point.p, surface.point.pError, surface.ng, wi);
        path.direction = wi;
        path.tNear = kSurfaceNear;
        path.tFar = kInfinity;
        return true;
    }

    /// Russian roulette on the expected contribution; false where the path ends.
    bool survive(int vertex) {
        if (vertex < tracer.options.russianRouletteStart) {
            return true;
        }
        constexpr float kMostLikely = 0.95F;
        const float q = min(maxComponent(path.throughput) * path.etaScale, kMostLikely);
        if (number(vertex, kDimRoulette) >= q) {
            return false;
        }
        path.throughput *= 1.0F / q;
        return true;
    }
};

} // namespace

template <bool Record>
PathCounts PathTracer::trace(const CameraRay& camera, const Sampler& sampler, PathRecord& record,
                             RayHit& firstHit) const {
    PathWalk<Record> walk{*this, sampler, record, {}, {}};
    walk.path.origin = camera.origin;
    walk.path.direction = camera.direction;
    walk.path.tNear = camera.tNear;
    walk.path.tFar = camera.tFar;
    walk.path.receiver.p = camera.origin;

    for (int vertex = 0;; ++vertex) {
        const RayHit hit = walk.nextHit(vertex);
        if (vertex == 0) {
            firstHit = hit;
            record.alpha = hit.kind == RayHit::Kind::kNone ? 0.0F : 1.0F;
            record.distance = hit.kind == RayHit::Kind::kNone ? 0.0F : walk.path.distance;
        }
        if (hit.kind == RayHit::Kind::kNone) {
            walk.addEnvironments(vertex);
            break;
        }
        if (hit.kind == RayHit::Kind::kLight) {
            walk.addLight(vertex, hit);
            break;
        }

        const SurfaceVertex surface = makeVertex(accel, hit, walk.path.direction);
        walk.addSurfaceEmission(vertex, surface, hit);
        const bool scatters = vertex < options.maxBounces;
        const Rgb direct = scatters ? walk.sampleDirect(vertex, surface) : Rgb(0.0F);
        const float limit = vertex == 0 ? options.clampDirect : options.clampIndirect;
        addContribution(record, vertex, clampTo(walk.path.throughput * direct, limit));
        if (vertex == 0) {
            record.normal = surface.frame.n;
        }
        if (Record) {
            if (vertex < kFeatureVertices) {
                walk.recordVertex(vertex, surface.bsdf.albedo(), surface.frame.n, direct);
            }
            if (surface.bsdf.hasNonDelta()) {
                walk.recordNonDelta(surface.bsdf.albedo(), surface.frame.n);
            }
        }
        if (!scatters || !walk.scatter(vertex, surface) || !walk.survive(vertex)) {
            break;
        }
    }
    return walk.counts;
}

template PathCounts PathTracer::trace<false>(const CameraRay&, const Sampler&, PathRecord&,
                                             RayHit&) const;
template PathCounts PathTracer::trace<true>(const CameraRay&, const Sampler&, PathRecord&,
                                            RayHit&) const;

} // namespace mbfeat
