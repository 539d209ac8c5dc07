// What the stages of a kernel share: the paths of the batch, their records, and who is where.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/effects.h"
#include "core/sampler.h"
#include "integrate/dimensions.h"
#include "integrate/effectParts.h"
#include "integrate/kernel/pathStream.h"
#include "integrate/kernel/raySort.h"
#include "integrate/pathWorker.h"

namespace mbfeat {

/// Start of rays that leave a surface. Where a surface is exactly axis-aligned its error bound, and
/// so the offset, can be zero: a hit at distance zero is the surface itself.
inline constexpr float kSurfaceNear = std::numeric_limits<float>::min();
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Power heuristic with exponent 2 (Veach and Guibas 1995); robust for large and zero densities.
template <class T>
T misWeight(const T& pdf, const T& otherPdf) {
    const Mask<T> sampled = pdf > T(0);
    const T ratio = otherPdf / select(sampled, pdf, T(1));
    return select(sampled, T(1) / (T(1) + ratio * ratio), T(0));
}

/// Scaled down to the limit where a component is above it; a limit of 0 is none.
template <class T>
Vec3<T> clampTo(const Vec3<T>& value, float limit) {
    if (!(limit > 0.0F)) {
        return value;
    }
    const T largest = maxComponent(value);
    const Mask<T> above = largest > T(limit);
    return select<T>(above, value * (T(limit) / select(above, largest, T(1))), value);
}

template <class T>
Mask<T> isLit(const Vec3<T>& c) {
    return c.x != T(0) || c.y != T(0) || c.z != T(0);
}

/// Effects that this translation unit is compiled for: all, but in builds that measure what an
/// effect costs where it is absent (tests/bench).
#if defined(MBFEAT_WITHOUT_EFFECT)
inline constexpr EffectSet kBuiltEffects =
    EffectSet::all() - EffectSet(Effect::MBFEAT_WITHOUT_EFFECT);
#else
inline constexpr EffectSet kBuiltEffects = EffectSet::all();
#endif

/// Whether all of them are taken for granted: in builds that measure what it costs to ask.
#if defined(MBFEAT_ALL_EFFECTS_PRESENT)
inline constexpr bool kAllPresent = true;
#else
inline constexpr bool kAllPresent = false;
#endif

/// Parts of records that can be asked for there.
inline constexpr std::uint32_t kBuiltRecordFlags = recordFlagsOf(kBuiltEffects);

/// Offset of a field of PathRecord in floats.
#define MBFEAT_RECORD_FIELD(field) static_cast<int>(offsetof(PathRecord, field) / sizeof(float))
inline constexpr int kVertexStride = sizeof(VertexFeatures) / sizeof(float);
inline constexpr int kExtendedStride = sizeof(VertexExtended) / sizeof(float);

/// The sampler of each lane from the quad kKeys.
template <class T>
LaneSampler<T> samplerOf(const LaneQuad<T>& keys) {
    const auto word = [](const T& value) {
        if constexpr (kIsBatch<T>) {
            return xsimd::bitwise_cast<UintLane<T>>(value);
        } else {
            return static_cast<std::uint32_t>(bitsOf(value));
        }
    };
    return {word(keys.x), word(keys.y), word(keys.z)};
}

/// The bits of numbers below `count`.
inline int bitsFor(int count) {
    int bits = 0;
    while ((1 << bits) < count) {
        ++bits;
    }
    return bits;
}

template <class T>
struct KernelState {
    static constexpr int kWidth = LaneTraits<T>::kWidth;

    KernelState(int pathCount, int branches, bool allFields, std::uint32_t flags)
        : capacity(pathCount),
          branchCount(branches),
          branchBits(bitsFor(branches)),
          paths(pathCount * branches, kWidth, allFields),
          shadows(pathCount * branches, kWidth),
          recordStride(mbfeat::recordBytes(flags) / sizeof(float)),
          recordFloats(static_cast<std::size_t>(pathCount * branches + kWidth) * recordStride),
          records(reinterpret_cast<PathRecord*>(recordFloats.data()),
                  recordStride * sizeof(float)) {
        for (std::size_t i = 0; i * recordStride < recordFloats.size(); ++i) {
            clearRecord(records[i], records.stride());
        }
        for (std::vector<std::int32_t>* list : {&active, &survivors, &surfaces, &lights, &misses}) {
            list->reserve(static_cast<std::size_t>(paths.capacity()));
        }
    }

    const PathContext* context = nullptr;
    int capacity;    ///< samples of a batch
    int branchCount; ///< paths that each may become, see ShadeStage::split()
    int branchBits;  ///< that number them
    /// Branch b of the path in slot i is in slot i + b capacity, and so is its record.
    PathStream paths;
    ShadowQueue shadows;
    std::size_t recordStride; ///< floats from record to record
    LaneArray<float> recordFloats;
    PathRecords records; ///< the same, by name

    // Slots of paths, by what is to be done with them.
    std::vector<std::int32_t> active;    ///< have a ray to be traced
    std::vector<std::int32_t> survivors; ///< will have, at the next vertex
    std::vector<std::int32_t> surfaces, lights, misses;
    std::vector<std::int32_t> branches;    ///< slots of the batch's branches but the first ones
    std::vector<std::int32_t> shadowOrder; ///< entries of the shadow queue, as they are traced
    RaySorter sorter;

    PathCounts counts;

    /// Whether paths are handled for the effect.
    template <Effect effect>
    bool handles() const {
        return kBuiltEffects.has(effect) && (kAllPresent || context->effects.has(effect));
    }

    /// What of the records somebody reads.
    std::uint32_t recordFlags() const {
        return kAllPresent ? kBuiltRecordFlags : context->recordFlags & kBuiltRecordFlags;
    }

    /// A batch of slots from a list: to read from, and to write to. Past the end of the list the
    /// first slot is read again and scratch slots are written.
    struct Group {
        std::int32_t read[kWidth], write[kWidth];
        std::uint32_t bits; ///< lanes that hold a path
        int count;
    };
    Group group(const std::int32_t* list, std::size_t left) const {
        Group g;
        g.count = static_cast<int>(std::min<std::size_t>(left, kWidth));
        for (int i = 0; i < kWidth; ++i) {
            g.read[i] = list[i < g.count ? i : 0];
            g.write[i] = i < g.count ? list[i] : paths.capacity() + i;
        }
        g.bits = static_cast<std::uint32_t>((std::uint64_t{1} << g.count) - 1U);
        return g;
    }
    /// Where lanes without m write to.
    IntLane<T> writeIf(const Mask<T>& m, const IntLane<T>& slot) const {
        alignas(64) std::int32_t scratch[kWidth];
        for (int i = 0; i < kWidth; ++i) {
            scratch[i] = paths.capacity() + i;
        }
        return selectInt(m, slot, loadIntLanes<T>(scratch));
    }

    Sampler samplerOf(int slot) const {
        return Sampler(SamplerKey{static_cast<std::uint32_t>(paths.integer(kKeyLow, slot)),
                                  static_cast<std::uint32_t>(paths.integer(kKeyHigh, slot)),
                                  static_cast<std::uint32_t>(paths.integer(kKeyIndex, slot))});
    }

    RayHit hit(int slot) const {
        RayHit h;
        h.kind = RayHit::Kind::kSurface;
        h.geometry = static_cast<std::uint32_t>(paths.integer(kHitGeometry, slot));
        h.instance = static_cast<std::uint32_t>(paths.integer(kHitInstance, slot));
        h.triangle = static_cast<std::uint32_t>(paths.integer(kHitTriangle, slot));
        h.b1 = paths.value(kHitB1, slot);
        h.b2 = paths.value(kHitB2, slot);
        return h;
    }
    LightReceiver receiver(int slot) const {
        return {paths.get3(kReceiverP, slot), paths.get3(kReceiverN, slot),
                (paths.integer(kFlags, slot) & kFlagTwoSided) != 0};
    }

    /// A slot's record, as that of a path that has met nothing yet.
    void startBranch(std::int32_t slot) {
        PathRecord& record = records[static_cast<std::size_t>(slot)];
        record.radiance = Rgb(0.0F);
        record.nonFinite = false;
        branches.push_back(slot);
    }
    /// Adds what branches found to the records of the paths that they left.
    void joinBranches() {
        for (const std::int32_t slot : branches) {
            const PathRecord& of = records[static_cast<std::size_t>(slot)];
            PathRecord& record = records[static_cast<std::size_t>(slot % capacity)];
            record.radiance += of.radiance;
            record.nonFinite = record.nonFinite || of.nonFinite;
        }
    }

    // Records as rows of floats, for lanes; slots as in Group.
    void setRecord(int field, const std::int32_t* slots, const LaneQuad<T>& quad) {
        storeQuads<T>(recordFloats.data() + field, slots, recordStride, quad);
    }
    /// Leaves the value behind as it is.
    void setRecord3(int field, const std::int32_t* slots, const Vec3<T>& v) {
        const LaneQuad<T> there = loadQuads<T>(recordFloats.data() + field, slots, recordStride);
        setRecord(field, slots, {v, there.w});
    }

    /// Marks the records of those lanes of which a value is infinite or NaN.
    void checkFinite(const std::int32_t* slots, const Vec3<T>& a, const Vec3<T>& b) {
        // Zero times anything finite is zero.
        const Vec3<T> zeros = a * T(0) + b * T(0);
        const Mask<T> finite = zeros.x + zeros.y + zeros.z == T(0);
        if (all(finite)) {
            return;
        }
        const std::uint32_t bits = laneBits(finite);
        for (int i = 0; i < kWidth; ++i) {
            if (((bits >> static_cast<unsigned>(i)) & 1U) == 0) {
                records[static_cast<std::size_t>(slots[i])].nonFinite = true;
            }
        }
    }

    /// Adds to the radiance, and to the part of it that `vertex` makes: -1 is seen by the camera
    /// itself, those beyond the features are the tail.
    void addContribution(int vertex, const std::int32_t* slots, const Vec3<T>& value) {
        add3(MBFEAT_RECORD_FIELD(radiance), slots, value);
        if ((recordFlags() & kRecordContributions) != 0) {
            const int part = vertex < 0 ? MBFEAT_RECORD_FIELD(emission)
                             : vertex < kFeatureVertices
                                 ? MBFEAT_RECORD_FIELD(contributions) + 3 * vertex
                                 : MBFEAT_RECORD_FIELD(tail);
            add3(part, slots, value);
        }
    }
    void addContributionOf(int slot, int vertex, const Rgb& value) {
        PathRecord& record = records[static_cast<std::size_t>(slot)];
        record.radiance += value;
        if ((recordFlags() & kRecordContributions) == 0) {
            return;
        }
        if (vertex < 0) {
            record.emission += value;
        } else if (vertex < kFeatureVertices) {
            record.contributions[vertex] += value;
        } else {
            record.tail += value;
        }
    }
    /// Emission that the ray towards `vertex` reached: it counts as the vertex before's.
    void addEmitted(int vertex, int slot, const Rgb& value) {
        const int source = vertex - 1;
        addContributionOf(slot, source,
                          source < 0 ? value : clampTo(value, limitOfEmitted(source)));
    }
    /// The same for lanes that arrived at a vertex behind the first.
    void addEmitted(int vertex, const std::int32_t* slots, const Vec3<T>& value) {
        const int source = vertex - 1;
        addContribution(source, slots, clampTo<T>(value, limitOfEmitted(source)));
    }

private:
    float limitOfEmitted(int source) const {
        const RenderOptions& options = context->options;
        return source <= 0 ? options.clampDirect : options.clampIndirect;
    }
    void add3(int field, const std::int32_t* slots, const Vec3<T>& v) {
        const LaneQuad<T> there = loadQuads<T>(recordFloats.data() + field, slots, recordStride);
        setRecord(field, slots, {there.xyz() + v, there.w});
    }
};

} // namespace mbfeat
