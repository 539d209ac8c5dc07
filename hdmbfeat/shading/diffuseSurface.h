// The closure of surfaces that reflect nothing: what Bsdf<T> of shading/previewSurface.h is, to the
// last bit, where ior is 1, nothing is metal or has a specular colour, and nothing lets light
// through. What is left of all its lobes is Lambert's, and a clearcoat of index 1 is not seen.
#pragma once

#include <type_traits>

#include "core/warp.h"
#include "shading/previewSurface.h"

namespace mbfeat {

template <class T>
class DiffuseBsdf {
public:
    static constexpr bool kChoosesLobes = false;

    DiffuseBsdf(const SurfaceParameters<T>& p, const Mask<T>& /*entering*/)
        : color_(p.diffuseColor) {}

    struct Outgoing {
        Vec3<T> wo;
        T choice; ///< of the diffuse lobe, to rounding 1
    };
    Outgoing outgoing(const Vec3<T>& wo) const {
        const T sum = (color_.x + color_.y + color_.z) * T(1.0F / 3.0F);
        const Mask<T> lit = sum > T(1e-20F);
        return {wo, select(lit, sum * (T(1) / select(lit, sum, T(1))), T(1))};
    }

    BsdfValue<T> evaluate(const Outgoing& out, const Vec3<T>& wi) const {
        BsdfValue<T> value;
        const Mask<T> valid = wi.z > T(0) && out.wo.z > T(0);
        const T density = max(wi.z, T(0)) * T(kInvPi);
        value.diffuse = select<T>(valid, color_ * density, Vec3<T>(T(0)));
        value.pdf = select(valid, out.choice * density, T(0));
        return value;
    }

    BsdfSample<T> sample(const Outgoing& out, const T& /*uLobe*/, const Vec2<T>& u) const {
        BsdfSample<T> s;
        s.wi = cosineHemisphere(u);
        s.diffuse = Mask<T>(true);
        s.roughness = T(1);
        const BsdfValue<T> value = evaluate(out, s.wi);
        const Mask<T> lit = s.wi.z > T(0) && value.pdf > T(0);
        s.pdf = select(lit, value.pdf, T(0));
        s.weight = select<T>(lit, value.diffuse / max(value.pdf, T(1e-30F)), Vec3<T>(T(0)));
        return s;
    }

    Mask<T> hasNonDelta() const { return maxComponent(color_) > T(0); }
    Mask<T> spreadsWidely() const { return hasNonDelta(); }
    Vec3<T> albedo() const { return color_; }

private:
    Vec3<T> color_;
};

/// The closure that has the parts E.
template <class T, std::uint32_t E>
using ClosureOf = std::conditional_t<E == 0, DiffuseBsdf<T>, Bsdf<T, E>>;

} // namespace mbfeat
