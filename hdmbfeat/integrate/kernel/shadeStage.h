// The stage of surfaces: for every path that met one, its closure, the light that is sampled there
// and where the path goes on. Paths are shaded as many at a time as there are lanes.
#pragma once

#include "integrate/kernel/endStage.h"
#include "integrate/kernel/hitLanes.h"
#include "integrate/kernel/kernelState.h"
#include "integrate/kernel/roulette.h"
#include "integrate/kernel/scatterLimits.h"
#include "integrate/kernel/surfaceLanes.h"
#include "shading/diffuseSurface.h"
#include "shading/lightLanes.h"
#include "shading/lightPair.h"
#include "shading/materialLanes.h"
#include "shading/shadingNormal.h"
#include "shading/shapeLanes.h"

namespace mbfeat {

/// A vertex on a surface, ready for scattering by a closure.
template <class T, class Closure>
struct VertexLanes {
    SurfacePointLanes<T> point;
    Mask<T> outside; ///< the path arrives on the outside
    Vec3<T> ng;      ///< geometric normal, facing the ray
    Frame<T> frame;
    Closure bsdf;
    typename Closure::Outgoing out; ///< towards where the path came from, in the shading frame
    Mask<T> twoSided;               ///< light may arrive from below
};

/// What a path brings to the vertex.
template <class T>
struct ArrivalLanes {
    Vec3<T> direction;
    Vec3<T> throughput;
    T rouletteScale;
    LaneQuad<T> keys; ///< of the sampler, and the flags
    T distance;       ///< from the last vertex
};

/// Record: the features of the path are recorded. E: the parts of the closure that there are.
template <class T, bool Record, std::uint32_t E>
class ShadeStage {
public:
    explicit ShadeStage(KernelState<T>& state) : s_(state), context_(*state.context) {}

    /// Shades s_.surfaces; fills s_.shadows and s_.survivors.
    void run(int vertex) {
        s_.shadows.clear();
        s_.survivors.clear();
        for (std::size_t i = 0; i < s_.surfaces.size(); i += kWidth) {
            shade(s_.group(s_.surfaces.data() + i, s_.surfaces.size() - i), vertex);
        }
    }

private:
    static constexpr int kWidth = LaneTraits<T>::kWidth;
    static constexpr bool kTransmits = (E & kBsdfTransmission) != 0;
    using Group = typename KernelState<T>::Group;
    using Closure = ClosureOf<T, E>;
    using Vertex = VertexLanes<T, Closure>;

    void shade(const Group& g, int vertex) {
        const HitLanes<T> hits(s_, g);
        const ArrivalLanes<T> arrival = arrivals(hits, g);
        const SurfaceParameters<T> parameters = materials(hits);
        const Vertex v = makeVertex(hits, parameters, arrival.direction);

        addEmission(g, vertex, hits, parameters, v, arrival.throughput);
        const bool scatters = vertex < context_.options.maxBounces;
        const Mask<T> lightable = v.bsdf.hasNonDelta();
        constexpr auto kNormalReaders =
            static_cast<std::uint32_t>(kRecordFirstHit | kRecordPrimvars);
        if (vertex == 0 && (s_.recordFlags() & kNormalReaders) != 0) {
            s_.setRecord3(MBFEAT_RECORD_FIELD(normal), g.write, v.frame.n);
        }
        if constexpr (Record) {
            record(g, vertex, v, lightable, arrival);
        }
        if (scatters) {
            const LaneSampler<T> sampler = samplerOf(arrival.keys);
            const ScatterLimits<T> limits = limitsOf(g, arrival, parameters);
            const T branches = branchesOf(arrival, v);
            if (!context_.lights.empty()) {
                sampleLight(g, vertex, v, lightable, arrival.throughput, sampler, limits, branches);
            }
            if (none(branches > T(1))) {
                scatter(g, vertex, v, arrival, sampler, limits, branches);
            } else {
                split(g, vertex, v, arrival, limits, branches);
            }
        }
    }

    ArrivalLanes<T> arrivals(const HitLanes<T>& hits, const Group& g) const {
        const LaneQuad<T> carried = s_.paths.template get<T>(kThroughput, g.read);
        return {s_.paths.template get<T>(kDirection, g.read).xyz(), carried.xyz(), carried.w,
                s_.paths.template get<T>(kKeys, g.read), hits.distance()};
    }

    ScatterLimits<T> limitsOf(const Group& g, const ArrivalLanes<T>& arrival,
                              const SurfaceParameters<T>& parameters) const {
        if (!context_.options.limitsKinds()) {
            return {};
        }
        const IntLane<T> scatterings = bitsOf(arrival.keys.w) & IntLane<T>(kScatteringsMask);
        return {context_.options, bitsOf(s_.paths.template get<T>(kReceiverN, g.read).w),
                toFloat(scatterings) > T(0), parameters.roughness};
    }

    /// Material inputs at all hits. Where the whole group has one constant material nothing is
    /// looked up.
    SurfaceParameters<T> materials(const HitLanes<T>& hits) {
        const bool varies = s_.template handles<Effect::kTextures>() ||
                            s_.template handles<Effect::kNormalMaps>() ||
                            s_.template handles<Effect::kPrimvars>();
        if (const MaterialBinding* const binding = hits.oneBinding()) {
            if (!varies || binding->isConstant) {
                return surfaceParameters<T>(binding->constants);
            }
            if constexpr (kWidth > 1) {
                if (binding->onLanes) {
                    SurfaceParameters<T> parameters = surfaceParameters<T>(binding->constants);
                    const MeshPlaces<T> places = hits.places();
                    MaterialLanes<T>(*binding, places).evaluate(parameters);
                    return parameters;
                }
            }
        }
        Transposer<T, MaterialValues> values;
        for (int i = 0; i < kWidth; ++i) {
            const RayHit hit = hits.hit(i);
            const MaterialBinding& binding = bindingAt(hits.geometry(i), hit.triangle);
            values.set(
                i, materialValues(varies ? evaluateMaterial(binding, hit.triangle, hit.b1, hit.b2)
                                         : binding.constants));
        }
        return surfaceParameters<T>(values.lanes());
    }

    Vertex makeVertex(const HitLanes<T>& hits, const SurfaceParameters<T>& parameters,
                      const Vec3<T>& direction) {
        const SurfacePointLanes<T> point = surfacePoint(hits.surfaces());
        const Vec3<T> wo = -direction;
        const Mask<T> outside = dot(wo, point.ng) >= T(0);
        const Vec3<T> ng = select<T>(outside, point.ng, -point.ng);
        const Vec3<T> mapped = mappedNormals(hits, point.ns, parameters.tangentNormal);
        const Vec3<T> ns = visibleShadingNormal(select<T>(outside, mapped, -mapped), ng, wo);
        const Frame<T> frame = Frame<T>::fromNormal(ns);
        const Closure bsdf(parameters, outside);
        return {point,
                outside,
                ng,
                frame,
                bsdf,
                bsdf.outgoing(frame.toLocal(wo)),
                kTransmits ? parameters.opacity < T(1) : Mask<T>(false)};
    }

    Vec3<T> mappedNormals(const HitLanes<T>& hits, const Vec3<T>& ns,
                          const Vec3<T>& tangentNormal) {
        if (!s_.template handles<Effect::kNormalMaps>() ||
            none(tangentNormal.x != T(0) || tangentNormal.y != T(0))) {
            return ns;
        }
        const LaneBuffer3<T> from(ns);
        const LaneBuffer3<T> map(tangentNormal);
        LaneBuffer3<T> bent;
        for (int i = 0; i < kWidth; ++i) {
            bent.set(i, mappedNormal(hits.geometry(i), hits.hit(i), from.get(i), map.get(i)));
        }
        return bent.lanes();
    }

    /// Emission of the surface, weighted against having sampled it as a light.
    void addEmission(const Group& g, int vertex, const HitLanes<T>& hits,
                     const SurfaceParameters<T>& parameters, const Vertex& v,
                     const Vec3<T>& throughput) {
        if (!s_.template handles<Effect::kEmissiveGeometry>()) {
            return;
        }
        const std::uint32_t bits = laneBits(isLit(parameters.emission)) & g.bits;
        if (bits == 0) {
            return;
        }
        const LaneBuffer3<T> emission(parameters.emission);
        const LaneBuffer3<T> weight(throughput);
        const LaneBuffer3<T> p(v.point.p);
        for (int i = 0; i < g.count; ++i) {
            if (((bits >> static_cast<unsigned>(i)) & 1U) == 0) {
                continue;
            }
            const std::int32_t slot = g.read[i];
            float mis = 1.0F;
            const AccelGeometry& geometry = hits.geometry(i);
            const RayHit hit = hits.hit(i);
            if (vertex > 0 && (s_.paths.integer(kFlags, slot) & kFlagDelta) == 0 &&
                geometry.emits) {
                const std::int32_t entry = geometry.emissiveIndex[hit.triangle];
                if (entry >= 0) {
                    const auto id = static_cast<std::uint32_t>(
                        geometry.emissiveBase +
                        static_cast<std::int32_t>(hit.instance) * geometry.emissiveCount + entry);
                    mis = misWeight(s_.paths.value(kBsdfPdf, slot),
                                    context_.lights.pdfTriangle(id, s_.receiver(slot), p.get(i)));
                }
            }
            s_.addEmitted(vertex, slot, weight.get(i) * emission.get(i) * mis);
        }
    }

    void record(const Group& g, int vertex, const Vertex& v, const Mask<T>& nonDelta,
                const ArrivalLanes<T>& arrival) {
        const Vec3<T> albedo = v.bsdf.albedo();
        if (vertex < kFeatureVertices) {
            // Albedo and normal in two quads; direct, which comes later, is behind them.
            static_assert(offsetof(VertexFeatures, normal) == 3 * sizeof(float) &&
                          offsetof(VertexFeatures, direct) == 6 * sizeof(float));
            const int features = MBFEAT_RECORD_FIELD(features[0].albedo) + kVertexStride * vertex;
            const Vec3<T>& n = v.frame.n;
            s_.setRecord(features, g.write, {albedo, n.x});
            s_.setRecord(features + 4, g.write, {n.y, n.z, T(0), T(0)});
            s_.checkFinite(g.write, albedo, n);
            for (int i = 0; i < g.count; ++i) {
                s_.records[static_cast<std::size_t>(g.read[i])].vertexCount =
                    static_cast<std::uint8_t>(vertex + 1);
            }
            if ((s_.recordFlags() & kRecordExtended) != 0) {
                static_assert(offsetof(VertexExtended, throughput) ==
                              offsetof(VertexExtended, distance) + sizeof(float));
                const Vec3<T>& carried = arrival.throughput;
                s_.setRecord(MBFEAT_RECORD_FIELD(extended[0].distance) + kExtendedStride * vertex,
                             g.write, {arrival.distance, carried.x, carried.y, carried.z});
            }
        }
        if ((s_.recordFlags() & kRecordFirstNonDelta) == 0) {
            return;
        }
        const std::uint32_t bits = laneBits(nonDelta) & g.bits;
        const LaneBuffer3<T> albedos(albedo);
        const LaneBuffer3<T> normals(v.frame.n);
        for (int i = 0; i < g.count; ++i) {
            if (((bits >> static_cast<unsigned>(i)) & 1U) != 0) {
                recordFirstNonDelta(s_, g.read[i], albedos.get(i), normals.get(i));
            }
        }
    }

    /// Next-event estimation: a shadow ray for every path that has light to gain, weighed against
    /// as many scatterings as the path has branches from here on.
    void sampleLight(const Group& g, int vertex, const Vertex& v, const Mask<T>& lightable,
                     const Vec3<T>& throughput, const LaneSampler<T>& sampler,
                     const ScatterLimits<T>& limits, const T& branches) {
        const std::uint32_t wanted = laneBits(lightable) & g.bits;
        if (wanted == 0) {
            return;
        }
        const LightValues<T> light = lightSamples(wanted, vertex, v, sampler);
        const Vec3<T> wi = v.frame.toLocal(light.wi);
        Mask<T> usable = light.pdf > T(0) && dot(light.wi, v.ng) * wi.z > T(0);
        if (none(usable)) {
            return;
        }
        BsdfValue<T> value = v.bsdf.evaluate(v.out, wi);
        if (limits.on()) {
            value = limits.limited(value, wi);
        }
        const Vec3<T> scattered =
            s_.template handles<Effect::kLightMultipliers>()
                ? value.diffuse * light.diffuse + value.specular * light.specular
                : value.total();
        usable = usable && isLit(scattered);
        if (none(usable)) {
            return;
        }
        const T pdf = select(usable, light.pdf, T(1));
        Mask<T> alone = light.delta > T(0);
        if (s_.template handles<Effect::kShadowlessLights>()) {
            alone = alone || light.castsShadows == T(0); // see EndStage::mis()
        }
        const T weight = select(alone, T(1), misWeight(pdf, value.pdf * branches));
        const Vec3<T> direct = scattered * light.radiance * (weight / pdf);

        Vec3<T> origin = offsetRayOrigin(v.point.p, v.point.pError, v.ng, light.wi);
        Vec3<T> direction = light.wi;
        T tFar(kInfinity);
        const Mask<T> near = light.distance < T(kInfinity);
        if (any(near)) {
            const RaySegment<T> segment = offsetSegment(
                v.point.p, v.point.pError, v.ng, light.point, light.pointError, light.normal);
            origin = select<T>(near, segment.origin, origin);
            direction = select<T>(near, segment.direction, direction);
            tFar = select(near, segment.length, tFar);
        }
        if (s_.template handles<Effect::kShadowlessLights>()) {
            // Nothing is met before the ray's start.
            tFar = select(light.castsShadows == T(0), T(0), tFar);
        }
        s_.shadows.template push<T>(usable, origin, direction, tFar, direct, throughput * direct,
                                    loadIntLanes<T>(g.read));
    }

    /// A light sample for each wanted lane; pdf 0 in the others.
    LightValues<T> lightSamples(std::uint32_t wanted, int vertex, const Vertex& v,
                                const LaneSampler<T>& sampler) {
        const std::uint32_t base = vertexDimension(vertex);
        const Vec2<T> u = sampler.get2D(base + kDimLight);
        if (!s_.template handles<Effect::kSeveralLights>()) {
            const std::uint32_t only = context_.lights.onlyLight();
            if (only != kNoLight && samplesOnLanes(context_.lights.prepared(only))) {
                const T probability = select(maskOfBits<T>(wanted), T(1), T(0));
                return oneLight(context_.lights.prepared(only), v, u, probability);
            }
        }
        if constexpr (kWidth > 1) {
            const LightPair* const pair = context_.lights.pair();
            if (pair != nullptr && samplesOnLanes(context_.lights.prepared(pair->localEntry)) &&
                samplesOnLanes(context_.lights.prepared(pair->infiniteEntry))) {
                return oneOfPair(*pair, wanted, v, sampler.get1D(base + kDimLightChoice), u);
            }
        }
        const LaneBuffer<T> choice(sampler.get1D(base + kDimLightChoice));
        const LaneBuffer<T> ux(u.x), uy(u.y);
        const LaneBuffer3<T> p(v.point.p), n(v.frame.n);
        const std::uint32_t twoSided = laneBits(v.twoSided);
        LightPick picks[kWidth];
        LaneBuffer<T> probability(T(0));
        std::uint32_t left = 0; // lanes whose light is still to be sampled
        LightReceiver receivers[kWidth];
        LightPick picked[kWidth];
        float numbers[kWidth];
        int lanes[kWidth];
        int count = 0;
        for (int i = 0; i < kWidth; ++i) {
            const std::uint32_t bit = std::uint32_t{1} << i;
            if ((wanted & bit) != 0) {
                receivers[count] = {p.get(i), n.get(i), (twoSided & bit) != 0};
                numbers[count] = choice[i];
                lanes[count++] = i;
            }
        }
        context_.lights.pick(receivers, numbers, count, picked);
        for (int k = 0; k < count; ++k) {
            const int i = lanes[k];
            picks[i] = picked[k];
            probability[i] = picks[i].probability;
            left |= picks[i].probability > 0.0F ? std::uint32_t{1} << i : 0U;
        }
        LightValues<T> values{};
        if constexpr (kWidth > 1) {
            const std::uint32_t spheres = severalSpheres(picks, left);
            if (spheres != 0) {
                values = oneSphereEach(picks, spheres, v, u, probability.lanes());
                left &= ~spheres;
            }
        }
        Transposer<T, LightValues> single;
        std::uint32_t singles = 0;
        for (int i = 0; left != 0; ++i) {
            const std::uint32_t bit = std::uint32_t{1} << i;
            if ((left & bit) == 0) {
                continue;
            }
            const std::uint32_t index = picks[i].light;
            if (index == kNoLight || !samplesOnLanes(context_.lights.prepared(index))) {
                const LightReceiver receiver{p.get(i), n.get(i), (twoSided & bit) != 0};
                const LightSample sample =
                    context_.lights.sample(receiver, picks[i], {ux[i], uy[i]});
                single.set(i, lightValues(sample, sampledRadiance(sample)));
                singles |= bit;
                left &= ~bit;
                continue;
            }
            std::uint32_t same = bit; // lanes that chose this light
            for (int k = i + 1; k < kWidth; ++k) {
                const std::uint32_t other = std::uint32_t{1} << k;
                same |= (left & other) != 0 && picks[k].light == index ? other : 0U;
            }
            left &= ~same;
            const LightValues<T> chosen =
                oneLight(context_.lights.prepared(index), v, u, probability.lanes());
            values = same == wanted ? chosen : blend(maskOfBits<T>(same), chosen, values);
        }
        return singles == 0 ? values : blend(maskOfBits<T>(singles), single.lanes(), values);
    }

    /// Of two lights that lanes have, that which each wanted lane chooses.
    LightValues<T> oneOfPair(const LightPair& pair, std::uint32_t wanted, const Vertex& v,
                             const T& choice, const Vec2<T>& u) const {
        const LightPairPick<T> pick = pair.pick<T>(v.point.p, v.frame.n, v.twoSided, choice);
        const T probability = select(maskOfBits<T>(wanted), pick.probability, T(0));
        const PreparedLight& near = context_.lights.prepared(pair.localEntry);
        const PreparedLight& far = context_.lights.prepared(pair.infiniteEntry);
        if (all(pick.infinite)) {
            return oneLight(far, v, u, probability);
        }
        const LightValues<T> local = oneLight(near, v, u, probability);
        return none(pick.infinite) ? local
                                   : blend(pick.infinite, oneLight(far, v, u, probability), local);
    }

    /// The sphere that a lane chose, where it did and it is no more than sampleOnLanes() makes of
    /// it.
    const EllipsoidShape<float>* plainSphere(const LightPick& pick) const {
        if (pick.light == kNoLight) {
            return nullptr;
        }
        const PreparedLight& light = context_.lights.prepared(pick.light);
        return samplesOnLanes(light) ? std::get_if<EllipsoidShape<float>>(&light.emitter) : nullptr;
    }

    /// Those of the lanes that chose spheres, as bits, unless all chose the same one.
    std::uint32_t severalSpheres(const LightPick* picks, std::uint32_t lanes) const {
        std::uint32_t spheres = 0, first = kNoLight;
        bool several = false;
        for (int i = 0; i < kWidth; ++i) {
            if (((lanes >> static_cast<unsigned>(i)) & 1U) != 0 &&
                plainSphere(picks[i]) != nullptr) {
                first = first == kNoLight ? picks[i].light : first;
                several = several || picks[i].light != first;
                spheres |= std::uint32_t{1} << i;
            }
        }
        return several ? spheres : 0;
    }

    /// A sphere of its own for each of these lanes: all are sampled at once. What the others get is
    /// to be replaced; where their probability is 0, so is the density.
    LightValues<T> oneSphereEach(const LightPick* picks, std::uint32_t lanes, const Vertex& v,
                                 const Vec2<T>& u, const T& probability) const {
        const EllipsoidShape<float>* spheres[kWidth];
        LaneBuffer3<T> radiance, pointError;
        LaneBuffer<T> castsShadows, diffuse, specular;
        int some = 0;
        while (((lanes >> static_cast<unsigned>(some)) & 1U) == 0) {
            ++some;
        }
        for (int i = 0; i < kWidth; ++i) {
            const bool own = ((lanes >> static_cast<unsigned>(i)) & 1U) != 0;
            const PreparedLight& light = context_.lights.prepared(picks[own ? i : some].light);
            spheres[i] = std::get_if<EllipsoidShape<float>>(&light.emitter);
            radiance.set(i, light.radiance);
            pointError.set(i, light.pointError);
            castsShadows[i] = light.castsShadows ? 1.0F : 0.0F;
            diffuse[i] = light.diffuse;
            specular[i] = light.specular;
        }
        const EllipsoidShape<T> shapes = shapeLanes<EllipsoidShape, T>(
            [&](int i) -> const EllipsoidShape<float>& { return *spheres[i]; });
        const ShapeSample<T> s = sampleOutside(shapes, v.point.p, u);
        LightValues<T> values;
        values.wi = s.wi;
        values.distance = s.distance;
        values.radiance = radiance.lanes();
        values.pdf =
            usablePdf<T>(s.pdf * probability, s.wi, values.radiance, v.frame.n, v.twoSided);
        values.delta = T(0);
        values.castsShadows = castsShadows.lanes();
        values.diffuse = diffuse.lanes();
        values.specular = specular.lanes();
        values.point = s.point;
        values.pointError = pointError.lanes();
        values.normal = s.normal;
        return values;
    }

    /// The same light for all lanes.
    static LightValues<T> oneLight(const PreparedLight& light, const Vertex& v, const Vec2<T>& u,
                                   const T& probability) {
        const LightLanes<T> s = sampleOnLanes<T>(light, v.point.p, {v.frame.n, v.twoSided}, u);
        LightValues<T> values;
        values.wi = s.wi;
        values.distance = s.distance;
        values.radiance = s.radiance;
        values.pdf = usablePdf<T>(s.pdf * probability, s.wi, s.radiance, v.frame.n, v.twoSided);
        values.delta = T(light.isDelta() ? 1.0F : 0.0F);
        values.castsShadows = T(light.castsShadows ? 1.0F : 0.0F);
        values.diffuse = T(light.diffuse);
        values.specular = T(light.specular);
        values.point = s.point;
        values.pointError = Vec3<T>(light.pointError);
        values.normal = s.normal;
        return values;
    }

    /// Radiance of the sampled light; evaluated at the point where a mesh emits.
    Rgb sampledRadiance(const LightSample& light) const {
        if (light.triangle == kNoLight || !(light.pdf > 0.0F)) {
            return light.radiance;
        }
        const EmissiveTriangleRef& ref = context_.accel.emissiveTriangles()[light.triangle];
        const AccelGeometry& geometry = *context_.accel.geometries()[ref.geometry];
        const MaterialBinding& binding = bindingAt(geometry, ref.triangle);
        const Rgb emission = evaluateMaterial(binding, ref.triangle, light.b1, light.b2).emission;
        // Where a cut-out is not there it does not shine either.
        return s_.template handles<Effect::kCutouts>() && geometry.mayCutOut
                   ? emission * evaluateOpacity(binding, ref.triangle, light.b1, light.b2)
                   : emission;
    }

    /// How many paths go on from the vertex: several at the first that spreads light widely. All
    /// that was done for the path before serves each of them (Arvo and Kirk 1990, "Particle
    /// transport and image synthesis"). A branch that leaves by a mirror-like lobe has not
    /// scattered widely yet, but has no slots for branches of its own.
    T branchesOf(const ArrivalLanes<T>& arrival, const Vertex& v) const {
        if (s_.branchCount == 1) {
            return T(1);
        }
        const Mask<T> splits = v.bsdf.spreadsWidely() && !isBranch(arrival);
        return select(splits, T(static_cast<float>(s_.branchCount)), T(1));
    }

    /// Whether a path is one of several already.
    static Mask<T> isBranch(const ArrivalLanes<T>& arrival) {
        return toFloat(bitsOf(arrival.keys.w) & IntLane<T>(kFlagBranch)) > T(0);
    }

    /// Scatters paths of which some have several branches.
    void split(const Group& g, int vertex, const Vertex& v, const ArrivalLanes<T>& arrival,
               const ScatterLimits<T>& limits, const T& branches) {
        const Mask<T> splits = branches > T(1);
        ArrivalLanes<T> own = arrival;
        own.keys.z = select(splits, branchIndex(arrival.keys.z, 0), arrival.keys.z);
        scatter(g, vertex, v, own, samplerOf(own.keys), limits, branches);

        Group branch = g;
        branch.bits = laneBits(splits) & g.bits;
        if (branch.bits == 0) {
            return;
        }
        for (int b = 1; b < s_.branchCount; ++b) {
            for (int i = 0; i < g.count; ++i) {
                const bool is = ((branch.bits >> static_cast<unsigned>(i)) & 1U) != 0;
                branch.write[i] = is ? g.read[i] + b * s_.capacity : s_.paths.capacity() + i;
                if (is) {
                    s_.startBranch(branch.write[i]);
                }
            }
            own.keys.z = branchIndex(arrival.keys.z, b);
            scatter(branch, vertex, v, own, samplerOf(own.keys), limits, branches);
        }
    }

    /// The index of a branch's random numbers, bits reversed as its path's: where all paths split,
    /// into a power of two, those of all branches are one sequence, and so together as even as
    /// those of paths are.
    T branchIndex(const T& index, int branch) const {
        const int bits = s_.branchBits;
        const auto own =
            static_cast<std::int32_t>(static_cast<std::uint32_t>(branch) << (32 - bits));
        const auto kept = static_cast<std::int32_t>(0xFFFFFFFFU >> bits);
        return valueOfBits((IntLane<T>(bitsOf(index) >> bits) & IntLane<T>(kept)) |
                           IntLane<T>(own));
    }

    /// Chooses the next segment of each path, and whether it goes on. Each is one of `branches`.
    void scatter(const Group& g, int vertex, const Vertex& v, const ArrivalLanes<T>& arrival,
                 const LaneSampler<T>& sampler, const ScatterLimits<T>& limits, const T& branches) {
        const std::uint32_t base = vertexDimension(vertex);
        const T lobe = Closure::kChoosesLobes ? sampler.get1D(base + kDimBsdfLobe) : T(0);
        BsdfSample<T> sample = v.bsdf.sample(v.out, lobe, sampler.get2D(base + kDimBsdf));
        T counts(0);
        if (limits.on()) {
            counts = valueOfBits(limits.limit(v.bsdf.evaluate(v.out, sample.wi), sample));
        }
        const Vec3<T> wi = v.frame.toWorld(sample.wi);
        // Where the geometric and the shading side of wi differ, light would leak through.
        Mask<T> on = maskOfBits<T>(g.bits) && sample.pdf > T(0) && isLit(sample.weight) &&
                     dot(wi, v.ng) * sample.wi.z > T(0);
        if constexpr (Record) {
            recordEvent(g, vertex, sample, on);
        }
        Vec3<T> carried = arrival.throughput * sample.weight;
        const IntLane<T> before = bitsOf(arrival.keys.w) & IntLane<T>(kScatteringsMask);
        const IntLane<T> scatterings = countScatterings(before, sample);
        const Mask<T> first =
            scatteringCount(before) < T(1) && scatteringCount(scatterings) == T(1);
        const T share =
            select(isBranch(arrival), T(1.0F / static_cast<float>(s_.branchCount)), T(1));
        const T scale =
            rouletteScale<T>(first, carried, share, arrival.rouletteScale * sqr(sample.eta));
        if (vertex >= context_.options.russianRouletteStart) {
            const Mask<T> mayEnd = scatteringCount(scatterings) >
                                   T(static_cast<float>(context_.options.russianRouletteStart));
            const T q = select(mayEnd, survivalProbability<T>(carried, scale), T(1));
            on = on && sampler.get1D(base + kDimRoulette) < q;
            carried = carried * (T(1) / select(on, q, T(1)));
        }
        carried = carried * (T(1) / branches);
        const std::uint32_t left = laneBits(on) & g.bits;
        if (left == 0) {
            return;
        }
        PathStream& paths = s_.paths;
        const IntLane<T> zero(0);
        const IntLane<T> flags =
            scatterings | (bitsOf(arrival.keys.w) & IntLane<T>(kFlagNonDelta | kFlagBranch)) |
            selectInt(branches > T(1), IntLane<T>(kFlagBranch), zero) |
            selectInt(v.bsdf.hasNonDelta(), IntLane<T>(kFlagNonDelta), zero) |
            selectInt(sample.delta, IntLane<T>(kFlagDelta), zero) |
            selectInt(v.twoSided, IntLane<T>(kFlagTwoSided), zero);
        paths.template set<T>(
            kOrigin, g.write,
            {offsetRayOrigin(v.point.p, v.point.pError, v.ng, wi), T(kSurfaceNear)});
        paths.template set<T>(kDirection, g.write, {wi, T(kInfinity)});
        paths.template set<T>(kThroughput, g.write, {carried, scale * branches});
        paths.template set<T>(kReceiverP, g.write, {v.point.p, sample.pdf * branches});
        paths.template set<T>(kReceiverN, g.write, {v.frame.n, counts});
        paths.template set<T>(kKeys, g.write,
                              {arrival.keys.x, arrival.keys.y, arrival.keys.z, valueOfBits(flags)});
        if constexpr (Record) {
            keepForRecord(g, sample, arrival.distance);
        }
        if (s_.template handles<Effect::kLightMultipliers>()) {
            keepDiffuseShare(g, v, sample);
        }
        for (int i = 0; i < g.count; ++i) {
            if (((left >> static_cast<unsigned>(i)) & 1U) != 0) {
                s_.survivors.push_back(g.write[i]);
            }
        }
    }

    /// The number of scatterings, in its place in the flags, with `sample`. Mirrors and glass
    /// hardly take a path nearer to its end: what counts is what spreads light widely.
    static IntLane<T> countScatterings(const IntLane<T>& before, const BsdfSample<T>& sample) {
        const Mask<T> wide = sample.diffuse || sample.roughness > T(kWideRoughness);
        return before + selectInt(wide, IntLane<T>(1 << kScatteringsShift), IntLane<T>(0));
    }

    static T scatteringCount(const IntLane<T>& scatterings) {
        return toFloat(IntLane<T>(scatterings >> kScatteringsShift));
    }

    void recordEvent(const Group& g, int vertex, const BsdfSample<T>& sample, const Mask<T>& on) {
        if (vertex >= kFeatureVertices || (s_.recordFlags() & kRecordExtended) == 0) {
            return;
        }
        const LaneBuffer<T> roughness(sample.roughness);
        const std::uint32_t bits = laneBits(on);
        const std::uint32_t transmitted = laneBits(sample.transmitted);
        const std::uint32_t delta = laneBits(sample.delta);
        const std::uint32_t diffuse = laneBits(sample.diffuse);
        for (int i = 0; i < g.count; ++i) {
            const auto is = [i](std::uint32_t lanes) {
                return ((lanes >> static_cast<unsigned>(i)) & 1U) != 0;
            };
            if (is(bits)) {
                VertexExtended& extended =
                    s_.records[static_cast<std::size_t>(g.read[i])].extended[vertex];
                extended.roughness = roughness[i];
                const auto side = is(transmitted) ? kEventTransmit : kEventReflect;
                const auto lobe = is(delta)     ? kEventSpecular
                                  : is(diffuse) ? kEventDiffuse
                                                : kEventGlossy;
                extended.event = static_cast<std::int32_t>(side | lobe);
            }
        }
    }

    void keepForRecord(const Group& g, const BsdfSample<T>& sample, const T& distance) {
        if ((s_.recordFlags() & kRecordFirstNonDelta) == 0) {
            return;
        }
        const LaneQuad<T> before = s_.paths.template get<T>(kTint, g.read);
        const Vec3<T> tint = before.xyz();
        s_.paths.template set<T>(
            kTint, g.write,
            {select<T>(sample.delta, tint * sample.tint, tint), before.w + distance});
    }

    /// Part of the scattered light that diffuse lobes made, for lights with multipliers.
    void keepDiffuseShare(const Group& g, const Vertex& v, const BsdfSample<T>& sample) {
        const BsdfValue<T> value = v.bsdf.evaluate(v.out, sample.wi);
        const Vec3<T> total = value.total();
        Vec3<T> share;
        for (int c = 0; c < 3; ++c) {
            const Mask<T> scattered = total[c] > T(0) && !sample.delta;
            share[c] =
                select(scattered, value.diffuse[c] / select(scattered, total[c], T(1)), T(0));
        }
        s_.paths.template set<T>(kDiffuseShare, g.write, {share, T(0)});
    }

    KernelState<T>& s_;
    const PathContext& context_;
};

} // namespace mbfeat
