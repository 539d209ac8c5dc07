// What a user allows paths to do: so many scatterings of each kind, and no light that sharp
// surfaces throw on wide ones. Where nothing is limited nothing of this runs.
//
// What an exhausted kind would scatter is left out of the closure's value, for light samples and
// for scattered rays alike, so that both go on estimating the same light and can be weighted
// together. A scattering counts as the kind of the lobe that was sampled.
#pragma once

#include <cstdint>

#include "core/laneMemory.h"
#include "core/settings.h"
#include "integrate/kernel/pathStream.h"
#include "shading/bsdf.h"

namespace mbfeat {

template <class T>
class ScatterLimits {
public:
    /// Nothing is limited.
    ScatterLimits() = default;
    /// `counts` are those of arrived(), `roughness` is the surface's. `wide`: the path has been
    /// scattered widely.
    ScatterLimits(const RenderOptions& options, const IntLane<T>& counts, const Mask<T>& wide,
                  const T& roughness)
        : on_(true),
          counts_(counts),
          diffuse_(below(0, options.maxDiffuse)),
          reflection_(below(1, options.maxReflection)),
          transmission_(below(2, options.maxTransmission)),
          delta_(Mask<T>(true)) {
        if (!options.caustics) {
            const Mask<T> shown = !wide || roughness > T(kWideRoughness);
            reflection_ = reflection_ && shown;
            transmission_ = transmission_ && shown;
            delta_ = !wide;
        }
    }

    bool on() const { return on_; }

    /// What is left of the closure's value in direction wi.
    BsdfValue<T> limited(const BsdfValue<T>& value, const Vec3<T>& wi) const {
        const Vec3<T> zero(T(0));
        BsdfValue<T> left = value;
        left.diffuse = select<T>(diffuse_, value.diffuse, zero);
        left.specular = select<T>(specularAt(wi), value.specular, zero);
        return left;
    }

    /// A sample of the closure with what is left of it; `value` is the closure's at sample.wi.
    /// Returns the counts of the path that goes on.
    IntLane<T> limit(const BsdfValue<T>& value, BsdfSample<T>& sample) const {
        const Mask<T> specular = specularAt(sample.wi);
        const Vec3<T> left = limited(value, sample.wi).total() / max(sample.pdf, T(1e-30F));
        const Mask<T> whole = diffuse_ && specular;
        const Mask<T> deltaLeft = specular && delta_;
        const Vec3<T> zero(T(0));
        sample.weight =
            select<T>(sample.delta, select<T>(deltaLeft, sample.weight, zero),
                      select<T>(whole, sample.weight, select<T>(sample.pdf > T(0), left, zero)));
        const Mask<T> asDiffuse = (sample.diffuse && diffuse_) || (!specular && !sample.delta);
        const IntLane<T> kind =
            selectInt(asDiffuse, one(0), selectInt(sample.transmitted, one(2), one(1)));
        // A full count stays: no limit is as high.
        const Mask<T> full = toFloat(counts_ & kind * IntLane<T>(kCountMask)) ==
                             toFloat(kind * IntLane<T>(kCountMask));
        return selectInt(full, counts_, counts_ + kind);
    }

private:
    static constexpr int kCountBits = 10;
    static constexpr std::int32_t kCountMask = (1 << kCountBits) - 1;

    static IntLane<T> one(int kind) { return IntLane<T>(1 << (kind * kCountBits)); }
    Mask<T> below(int kind, int limit) const {
        const IntLane<T> count =
            IntLane<T>(counts_ >> (kind * kCountBits)) & IntLane<T>(kCountMask);
        return toFloat(count) < T(static_cast<float>(limit));
    }
    Mask<T> specularAt(const Vec3<T>& wi) const {
        const Mask<T> above = wi.z > T(0);
        return (above && reflection_) || (!above && transmission_);
    }

    bool on_ = false;
    IntLane<T> counts_{};
    Mask<T> diffuse_{}, reflection_{}, transmission_{}, delta_{};
};

} // namespace mbfeat
