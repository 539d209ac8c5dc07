// The stages of paths that end: at lights, and in the environment.
#pragma once

#include "integrate/kernel/kernelState.h"
#include "shading/lightLanes.h"

namespace mbfeat {

/// Writes the first-non-delta features of a path that has none yet.
template <class T>
void recordFirstNonDelta(KernelState<T>& s, int slot, const Rgb& albedo, const Float3& normal) {
    std::int32_t& flags = s.paths.integer(kFlags, slot);
    if ((flags & kFlagNonDelta) != 0) {
        return;
    }
    flags |= kFlagNonDelta;
    PathRecord& record = s.records[static_cast<std::size_t>(slot)];
    record.nonDeltaAlbedo = albedo;
    record.nonDeltaNormal = normal;
    record.nonDeltaDepth = s.paths.value(kPathLength, slot) + s.paths.value(kDistance, slot);
    record.nonDeltaTint = s.paths.get3(kTint, slot);
}

template <class T>
class EndStage {
public:
    explicit EndStage(KernelState<T>& state) : s_(state), lights_(state.context->lights) {}

    /// Ends the paths that met a light shape.
    template <bool Record>
    void lights(int vertex) {
        for (const std::int32_t slot : s_.lights) {
            const auto light = static_cast<std::uint32_t>(s_.paths.integer(kHitTriangle, slot));
            const Float3 direction = s_.paths.get3(kDirection, slot);
            const LightHit seen = lights_.evaluateHit(light, s_.receiver(slot), direction,
                                                      s_.paths.value(kDistance, slot));
            const float weight = mis(vertex, slot, light, seen.pdf);
            s_.addEmitted(vertex, slot,
                          throughput(slot) * multiplier(vertex, slot, light) * seen.radiance *
                              weight);
            if (Record) {
                recordLight(vertex, slot, seen, direction);
            }
        }
    }

    /// Ends the paths that left the scene.
    void misses(int vertex) {
        if (!s_.template handles<Effect::kEnvironment>()) {
            return;
        }
        const std::uint32_t count = lights_.environmentCount();
        if (count == 0) {
            return;
        }
        for (std::size_t i = 0; i < s_.misses.size(); i += LaneTraits<T>::kWidth) {
            const Group g = s_.group(s_.misses.data() + i, s_.misses.size() - i);
            if (vertex == 0) {
                const Vec3<T> direction = s_.paths.template get<T>(kDirection, g.read).xyz();
                s_.addContribution(-1, g.write,
                                   radianceOfEnvironments<T>(lights_, direction, true));
            } else {
                for (std::uint32_t e = 0; e < count; ++e) {
                    miss(g, vertex, lights_.lightOfEnvironment(e));
                }
            }
        }
    }

private:
    using Group = typename KernelState<T>::Group;

    /// What paths meet of one environment.
    void miss(const Group& g, int vertex, std::uint32_t light) {
        const Vec3<T> direction = s_.paths.template get<T>(kDirection, g.read).xyz();
        const IntLane<T> flags = bitsOf(s_.paths.template get<T>(kKeys, g.read).w);
        static_assert(kFlags == kKeys + 3);
        const auto has = [&](PathFlag flag) { return toFloat(flags & IntLane<T>(flag)) != T(0); };
        const Mask<T> delta = has(kFlagDelta);
        const EnvironmentMap::Seen<T> seen = lookAtEnvironment<T>(
            lights_.prepared(light), direction,
            {s_.paths.template get<T>(kReceiverN, g.read).xyz(), has(kFlagTwoSided)});
        const Mask<T> lit = isLit(seen.value) && maskOfBits<T>(g.bits);
        if (none(lit)) {
            return;
        }
        T probability(1);
        if (lights_.choiceCount() > 1) {
            LaneBuffer<T> chosen(T(0));
            const std::uint32_t weighed = laneBits(lit) & ~laneBits(delta);
            for (int i = 0; i < g.count; ++i) {
                if (((weighed >> static_cast<unsigned>(i)) & 1U) != 0) {
                    chosen[i] = lights_.choiceProbability(light, s_.receiver(g.read[i]));
                }
            }
            probability = chosen.lanes();
        }
        const T pdf = probability * seen.pdf;
        const T scattered = s_.paths.template get<T>(kReceiverP, g.read).w;
        static_assert(kBsdfPdf == kReceiverP + 3);
        T weight = select(delta, T(1), misWeight(scattered, pdf));
        if (s_.template handles<Effect::kShadowlessLights>() && !lights_.castsShadows(light)) {
            weight = select(!delta && pdf > T(0), T(0), weight); // see mis()
        }
        Vec3<T> carried = s_.paths.template get<T>(kThroughput, g.read).xyz();
        if (s_.template handles<Effect::kLightMultipliers>()) {
            carried = carried * multipliers<T>(light, [&] {
                          return s_.paths.template get<T>(kDiffuseShare, g.read).xyz();
                      });
        }
        s_.addEmitted(vertex, g.write, carried * seen.value * weight);
    }

    /// A light's own multipliers, for what the segment's scattering, of which share() is diffuse,
    /// makes of it.
    template <class L, class Share>
    Vec3<L> multipliers(std::uint32_t light, const Share& share) const {
        const float d = lights_.diffuseMultiplier(light);
        const float s = lights_.specularMultiplier(light);
        if (d == 1.0F && s == 1.0F) {
            return Vec3<L>(L(1));
        }
        const Vec3<L> diffuse = share();
        return diffuse * L(d) + (Vec3<L>(L(1)) - diffuse) * L(s);
    }

    Rgb throughput(int slot) const { return s_.paths.get3(kThroughput, slot); }
    bool isDelta(int slot) const { return (s_.paths.integer(kFlags, slot) & kFlagDelta) != 0; }
    /// Weight of light that a segment met, against that of sampling the light. A light without
    /// shadows lights what it is hidden from too, which scattering cannot find: all that sampling
    /// can find is left to sampling.
    float mis(int vertex, int slot, std::uint32_t light, float lightPdf) const {
        if (vertex == 0 || isDelta(slot)) {
            return 1.0F;
        }
        if (s_.template handles<Effect::kShadowlessLights>() && lightPdf > 0.0F &&
            !lights_.castsShadows(light)) {
            return 0.0F;
        }
        return misWeight(s_.paths.value(kBsdfPdf, slot), lightPdf);
    }
    Rgb multiplier(int vertex, int slot, std::uint32_t light) const {
        if (!s_.template handles<Effect::kLightMultipliers>() || vertex == 0) {
            return Rgb(1.0F);
        }
        return multipliers<float>(light, [&] { return s_.paths.get3(kDiffuseShare, slot); });
    }

    void recordLight(int vertex, int slot, const LightHit& seen, const Float3& direction) {
        if (vertex >= kFeatureVertices) {
            return;
        }
        const float largest = maxComponent(seen.radiance);
        const Rgb base = largest > 0.0F ? seen.radiance / largest : Rgb(0.0F);
        const Float3 normal = dot(seen.normal, direction) > 0.0F ? -seen.normal : seen.normal;
        PathRecord& record = s_.records[static_cast<std::size_t>(slot)];
        record.vertexCount = static_cast<std::uint8_t>(vertex + 1);
        record.features[vertex] = {base, normal, Rgb(0.0F)};
        record.nonFinite = record.nonFinite || !isFinite(base) || !isFinite(normal);
        const std::uint32_t flags = s_.recordFlags();
        if ((flags & kRecordExtended) != 0) {
            record.extended[vertex].distance = s_.paths.value(kDistance, slot);
            record.extended[vertex].throughput = throughput(slot);
            record.extended[vertex].event = kEventEmission;
        }
        if ((flags & kRecordFirstNonDelta) != 0) {
            recordFirstNonDelta(s_, slot, base, normal);
        }
    }

    KernelState<T>& s_;
    const LightSampler& lights_;
};

} // namespace mbfeat
