// The closure of UsdPreviewSurface 2.6.
//
// Layers, from the top:
//   clearcoat   a GGX dielectric reflection of index ior, times the clearcoat weight c
//   interface   a GGX reflection with Fresnel reflectance R, and through it
//   base        opacity * Lambert diffuse + (1 - opacity) * refraction, both times 1 - metallic
// With m = metallic, the interface is a blend of three reflectances at the half vector:
//   R = m * diffuseColor + (1 - m) * (opacity * F_out + (1 - opacity) * F_dir)
// F_out is the interface seen from outside (an opaque body has nothing behind it), F_dir the one
// in the direction of the ray, with total internal reflection. Both are the exact dielectric
// Fresnel term of ior; the specular workflow has m = 0 and Schlick's term from specularColor to
// white, at the cosine on the thinner side. The specification interpolates F0 and F90 by metallic;
// Schlick's term is linear in both, so this is the same blend with the exact term put in.
//
// Refraction carries (1 - m)(1 - opacity)(1 - F_dir) diffuseColor. The specification leaves the
// colour of transmitted light open (the MaterialX graph has none): diffuseColor is its tint here,
// once for each interface crossed, since nothing else in the model could colour glass. Clear
// glass is authored with a white diffuseColor.
//
// Energy. The diffuse lobe is (1 - F(wo)) (1 - F(wi)) / (1 - F_average) times Lambert's, F the
// outside reflectance as roughness leaves it (setDiffuse()); it is reciprocal, never adds to more
// than 1 with the reflection, and is exactly Lambert's where ior = 1. The clearcoat takes
// (1 - c F(w)) from what lies below for each direction that passes it. Rough lobes have single
// scattering only and lose what the masked facets would have scattered further.
// Reciprocity: f(wo, wi) = f(wi, wo) for every reflection, and f(wo, wi) = f'(wi, wo) / eta^2 for
// refraction, f' being the closure on the other side; refraction is not reciprocal in the part
// where a clearcoat lies on a material that is partly opaque (opacity strictly within 0..1).
//
// Lobes are chosen by their estimated contribution at wo. The interface then chooses a visible
// normal h and, by the reflectance at h, reflects or refracts, so that glass has weights near 1.
#pragma once

#include "core/warp.h"
#include "shading/bsdf.h"
#include "shading/fresnel.h"
#include "shading/microfacet.h"

namespace mbfeat {

/// E are the parts of the closure (BsdfPart) that some surface has: the others are left out. A
/// surface that has no more parts than E scatters the same, to the last bit, whatever else E holds.
template <class T, std::uint32_t E = kAllBsdfParts>
class Bsdf {
public:
    static constexpr bool kChoosesLobes = true; ///< whether sample() looks at uLobe

    /// `entering`: wo is on the outside, so that refraction goes from index 1 into ior. Inside
    /// glass (a hit on the back of a face) it is false. Opaque surfaces look the same from both
    /// sides. Parameters must be in range: opacity, metallic, ... in 0..1, ior positive.
    Bsdf(const SurfaceParameters<T>& p, const Mask<T>& entering);

    /// Probabilities of the three lobes; they add to 1.
    struct LobeProbabilities {
        T coat, diffuse, interface;
    };
    /// What depends on the outgoing direction alone, to be shared by the calls of one vertex.
    struct Outgoing {
        Vec3<T> wo; ///< unit, wo.z > 0
        LobeProbabilities choice;
        T coatThrough;          ///< what the clearcoat lets through
        Vec3<T> diffuseThrough; ///< what the interface lets through to the diffuse base
    };
    Outgoing outgoing(const Vec3<T>& wo) const;

    /// All lobes that are not deltas, at unit vectors wo (wo.z > 0) and wi (any).
    BsdfValue<T> evaluate(const Outgoing& out, const Vec3<T>& wi) const;
    BsdfValue<T> evaluate(const Vec3<T>& wo, const Vec3<T>& wi) const {
        return evaluate(outgoing(wo), wi);
    }

    /// Draws wi. uLobe and u are in [0, 1).
    BsdfSample<T> sample(const Outgoing& out, const T& uLobe, const Vec2<T>& u) const;
    BsdfSample<T> sample(const Vec3<T>& wo, const T& uLobe, const Vec2<T>& u) const {
        return sample(outgoing(wo), uLobe, u);
    }

    /// True where evaluate() can be different from zero, so that light sampling makes sense.
    Mask<T> hasNonDelta() const;

    /// True where light is scattered diffusely, or by a rough interface or clearcoat.
    Mask<T> spreadsWidely() const {
        const Mask<T> base = maxComponent(diffuse_) > T(0) || p_.roughness > T(kWideRoughness);
        if constexpr (kCoats) {
            return base || (coat_ > T(0) && p_.clearcoatRoughness > T(kWideRoughness));
        }
        return base;
    }

    /// The albedo feature, 0..1: diffuseColor, which is the tint of glass and the
    /// normal-incidence colour of metal too. The specular workflow puts specularColor over it.
    Vec3<T> albedo() const;

private:
    static constexpr bool kTransmits = (E & kBsdfTransmission) != 0;
    static constexpr bool kCoats = (E & kBsdfClearcoat) != 0;
    static constexpr bool kSpecularWorkflow = (E & kBsdfSpecularWorkflow) != 0;

    /// Whether some lane lets light through.
    bool anyTransmits() const { return kTransmits && any(p_.opacity < T(1)); }

    /// What the interface reflects and lets through to refraction at a cosine to its normal.
    struct Interface {
        Vec3<T> reflected, refracted;
    };

    static T mean(const Vec3<T>& c) { return (c.x + c.y + c.z) * T(1.0F / 3.0F); }

    void setDiffuse();
    Interface interfaceAt(const T& c) const;
    Vec3<T> outsideReflectance(const T& c) const;
    Vec3<T> diffuseTransmittance(const T& cosine) const;
    T coatReflectance(const T& c) const {
        return kCoats && any(coat_ > T(0)) ? coat_ * fresnelDielectric(outside_, c) : T(0);
    }
    T coatTransmittance(const Outgoing& out, const Vec3<T>& wi) const;
    T reflectProbability(const T& cosine) const;
    void setDelta(const Outgoing& out, const Mask<T>& coat, const T& reflects,
                  BsdfSample<T>& s) const;
    void addDiffuse(const Outgoing& out, const Vec3<T>& wi, BsdfValue<T>& value) const;
    void addReflection(const Outgoing& out, const Vec3<T>& wi, BsdfValue<T>& value) const;
    void addRefraction(const Outgoing& out, const Vec3<T>& wi, BsdfValue<T>& value) const;

    SurfaceParameters<T> p_;
    RelativeIndex<T> outside_;  ///< from index 1 into ior
    RelativeIndex<T> index_;    ///< from wo's side to the other
    T metal_, dielectric_;      ///< metallic and 1 - metallic; 0 and 1 in the specular workflow
    T coat_, coatBehind_;       ///< clearcoat weight on wo's side, and on the other
    Vec3<T> normalReflectance_; ///< of the interface from outside, at normal incidence
    T spread_;                  ///< see setDiffuse()
    Vec3<T> diffuse_;           ///< diffuse reflectance under the interface, normalised
    Vec3<T> tint_;              ///< colour of refraction with its weight
    T alpha_, coatAlpha_;
    Mask<T> deltaReflection_, deltaRefraction_, deltaCoat_;
};

template <class T, std::uint32_t E>
Bsdf<T, E>::Bsdf(const SurfaceParameters<T>& p, const Mask<T>& entering) : p_(p) {
    // Without an inside there is no total reflection: only F0, the same for ior and 1 / ior.
    outside_ = RelativeIndex<T>::make(max(p.ior, T(1) / p.ior), Mask<T>(true));
    if constexpr (kTransmits) {
        index_ = RelativeIndex<T>::make(p.ior, entering);
    } else {
        p_.opacity = T(1);
    }
    metal_ = kSpecularWorkflow ? select(p.useSpecularWorkflow, T(0), p.metallic) : p.metallic;
    dielectric_ = T(1) - metal_;
    // From inside glass the coat lies behind the interface. An opaque body has it on both sides.
    if constexpr (kCoats) {
        coat_ = p.clearcoat * select(entering, T(1), p_.opacity);
        coatBehind_ = select(entering, T(0), p.clearcoat);
    }

    if constexpr (kTransmits) {
        tint_ = p.diffuseColor * (dielectric_ * (T(1) - p.opacity));
    }

    alpha_ = p.roughness * p.roughness;
    setDiffuse();
    deltaReflection_ = alpha_ < T(kDeltaAlpha);
    if constexpr (kCoats) {
        coatAlpha_ = p.clearcoatRoughness * p.clearcoatRoughness;
        deltaCoat_ = coatAlpha_ < T(kDeltaAlpha);
    }
    if constexpr (kTransmits) {
        // A facet tilted by t turns the refracted ray by about (1 - 1/eta) t, and the half vector
        // is recovered from a difference of that length: the same limit applies to the product.
        const T bend = abs(index_.k) / ((index_.eta + T(1)) * max(index_.eta, T(1)));
        deltaRefraction_ = alpha_ * bend < T(kDeltaAlpha);
    }
}

/// The diffuse lobe under a rough interface.
///
/// At grazing angles rough facets reflect less than F at the angle to the normal: F is taken at a
/// cosine c' with c'^2 = c^2 + k alpha sin^2 alpha^2 / (alpha^2 + 0.2 c^2). The constant k and the
/// factor below on the average are fitted so that diffuse and reflected light of a white surface
/// never add to more than 1 (quadrature over roughness, angle, ior and F0), nor lose more than
/// 13 % at the worst angle. No less than the reflectance at normal incidence is taken away, since
/// at a high index F has a minimum at Brewster's angle that rough facets average out.
template <class T, std::uint32_t E>
void Bsdf<T, E>::setDiffuse() {
    const T x = (outside_.eta - T(1)) / (outside_.eta + T(1));
    T shape = min(min(T(8) * x, T(1.5F) * (T(1) - x)), T(1));
    Vec3<T> average(fresnelDielectricAverage(outside_.eta));
    if constexpr (kSpecularWorkflow) {
        shape = select(p_.useSpecularWorkflow, T(0.6F), shape);
        const Vec3<T> schlick =
            p_.specularColor + (Vec3<T>(T(1)) - p_.specularColor) * T(1.0F / 21.0F);
        average = select<T>(p_.useSpecularWorkflow, schlick, average);
    }
    const T strength = shape * min(fma(T(1.4F), alpha_, T(0.14F)), T(0.2F));
    spread_ = strength * alpha_ * alpha_ * alpha_;

    normalReflectance_ = outsideReflectance(T(1));
    const Vec3<T> edge = (average - normalReflectance_) * fma(T(-0.75F), p_.roughness, T(1));
    for (int channel = 0; channel < 3; ++channel) {
        const T reflected = min(average[channel], normalReflectance_[channel] + edge[channel]);
        diffuse_[channel] =
            p_.diffuseColor[channel] * dielectric_ * p_.opacity / max(T(1) - reflected, T(1e-3F));
    }
}

template <class T, std::uint32_t E>
Vec3<T> Bsdf<T, E>::outsideReflectance(const T& c) const {
    if (!kSpecularWorkflow || none(p_.useSpecularWorkflow)) {
        return Vec3<T>(fresnelDielectric(outside_, c));
    }
    return select<T>(p_.useSpecularWorkflow, fresnelSchlick(p_.specularColor, c),
                     Vec3<T>(fresnelDielectric(outside_, c)));
}

template <class T, std::uint32_t E>
typename Bsdf<T, E>::Interface Bsdf<T, E>::interfaceAt(const T& c) const {
    const Vec3<T> out = outsideReflectance(c);
    if constexpr (!kTransmits) {
        return {p_.diffuseColor * metal_ + out * dielectric_, Vec3<T>(T(0))};
    }
    Vec3<T> directed = out;
    // Without opacity there is no inside; lanes that do not need it must not change by its being
    // computed for others.
    const Mask<T> towardsThinner = index_.eta < outside_.eta && p_.opacity < T(1);
    if (any(towardsThinner)) {
        directed = Vec3<T>(fresnelDielectric(index_, c));
        if constexpr (kSpecularWorkflow) {
            const T gSquared = index_.refractedSquared(c);
            const T cosineThinner = safeSqrt(gSquared) / index_.eta;
            const Vec3<T> schlick = select<T>(
                gSquared > T(0), fresnelSchlick(p_.specularColor, cosineThinner), Vec3<T>(T(1)));
            directed = select<T>(p_.useSpecularWorkflow, schlick, directed);
        }
        directed = select<T>(towardsThinner, directed, out);
    }
    const Vec3<T> body = lerp(p_.opacity, directed, out);
    return {p_.diffuseColor * metal_ + body * dielectric_, tint_ * (Vec3<T>(T(1)) - directed)};
}

/// What the interface lets through to the diffuse base, per direction.
template <class T, std::uint32_t E>
Vec3<T> Bsdf<T, E>::diffuseTransmittance(const T& cosine) const {
    const T squared = cosine * cosine;
    const T tilt =
        spread_ * (T(1) - squared) / max(fma(T(0.2F), squared, alpha_ * alpha_), T(1e-20F));
    const Vec3<T> reflected = outsideReflectance(sqrt(max(squared + tilt, T(0))));
    return Vec3<T>(T(1) - max(reflected.x, normalReflectance_.x),
                   T(1) - max(reflected.y, normalReflectance_.y),
                   T(1) - max(reflected.z, normalReflectance_.z));
}

template <class T, std::uint32_t E>
T Bsdf<T, E>::coatTransmittance(const Outgoing& out, const Vec3<T>& wi) const {
    if (!kCoats || !any(p_.clearcoat > T(0))) {
        return T(1);
    }
    const T fresnel = fresnelDielectric(outside_, abs(wi.z));
    const T weight = select(wi.z > T(0), coat_, coatBehind_);
    return out.coatThrough * (T(1) - weight * fresnel);
}

template <class T, std::uint32_t E>
typename Bsdf<T, E>::Outgoing Bsdf<T, E>::outgoing(const Vec3<T>& wo) const {
    Outgoing out;
    out.wo = wo;
    const Interface interface = interfaceAt(wo.z);
    const T coat = coatReflectance(wo.z);
    out.coatThrough = T(1) - coat;
    out.diffuseThrough =
        any(maxComponent(diffuse_) > T(0)) ? diffuseTransmittance(wo.z) : Vec3<T>(T(0));
    const T diffuse = out.coatThrough * mean(diffuse_ * out.diffuseThrough);
    const T below = out.coatThrough * mean(interface.reflected + interface.refracted);
    const T sum = coat + diffuse + below;
    const Mask<T> lit = sum > T(1e-20F);
    const T scale = T(1) / select(lit, sum, T(1));
    // A black surface absorbs; which lobe does it is all the same.
    out.choice = {select(lit, coat * scale, T(0)), select(lit, diffuse * scale, T(1)),
                  select(lit, below * scale, T(0))};
    return out;
}

/// Probability that the interface reflects, given the cosine to the facet it hit.
template <class T, std::uint32_t E>
T Bsdf<T, E>::reflectProbability(const T& cosine) const {
    if (!anyTransmits()) {
        return T(1);
    }
    const Interface interface = interfaceAt(cosine);
    const T reflected = mean(interface.reflected);
    const T sum = reflected + mean(interface.refracted);
    return select(sum > T(1e-20F), reflected / max(sum, T(1e-20F)), T(1));
}

template <class T, std::uint32_t E>
void Bsdf<T, E>::addDiffuse(const Outgoing& out, const Vec3<T>& wi, BsdfValue<T>& value) const {
    const Mask<T> valid = wi.z > T(0);
    const T density = max(wi.z, T(0)) * T(kInvPi);
    value.pdf += out.choice.diffuse * density;
    if (!any(maxComponent(diffuse_) > T(0))) {
        return;
    }
    const Vec3<T> f = diffuse_ * out.diffuseThrough * diffuseTransmittance(max(wi.z, T(0))) *
                      (density * coatTransmittance(out, wi));
    value.diffuse = select<T>(valid, f, Vec3<T>(T(0)));
}

template <class T, std::uint32_t E>
void Bsdf<T, E>::addReflection(const Outgoing& out, const Vec3<T>& wi, BsdfValue<T>& value) const {
    const Vec3<T>& wo = out.wo;
    const Vec3<T> sum = wo + wi;
    const T norm = lengthSquared(sum);
    const Mask<T> valid = wi.z > T(0) && norm > T(1e-20F);
    const T width = sqrt(max(norm, T(1e-20F)));
    const Vec3<T> h = sum / width;
    // wo.h = wi.h = |wo + wi| / 2, which does not cancel at grazing angles.
    const T c = min(T(0.5F) * width, T(1));

    const Ggx<T> ggx(alpha_);
    const Interface interface = interfaceAt(c);
    T reflects(1);
    if constexpr (kTransmits) {
        const T reflected = mean(interface.reflected);
        const T refracted = mean(interface.refracted);
        const T both = reflected + refracted;
        reflects = select(both > T(1e-20F), reflected / max(both, T(1e-20F)), T(1));
        if (any(deltaRefraction_ && p_.opacity < T(1))) {
            reflects = select(deltaRefraction_, reflectProbability(wo.z), reflects);
        }
    }
    const Mask<T> base = valid && !deltaReflection_;
    const T scale = ggx.density(h) * ggx.visibility(wo, wi) * wi.z * coatTransmittance(out, wi);
    value.specular += select<T>(base, interface.reflected * scale, Vec3<T>(T(0)));
    value.pdf +=
        select(base, out.choice.interface * reflects * T(0.25F) * ggx.visibleDensity(wo, h), T(0));

    if constexpr (kCoats) {
        const Mask<T> coat = valid && !deltaCoat_ && coat_ > T(0);
        if (any(coat)) {
            const Ggx<T> coatGgx(coatAlpha_);
            const T f = coatReflectance(c) * coatGgx.density(h) * coatGgx.visibility(wo, wi) * wi.z;
            value.specular += select<T>(coat, Vec3<T>(f), Vec3<T>(T(0)));
            value.pdf +=
                select(coat, out.choice.coat * T(0.25F) * coatGgx.visibleDensity(wo, h), T(0));
        }
    }
}

/// Walter et al. 2007, equations 16, 17 and 21, for radiance: the density of refracted radiance
/// changes by 1 / eta^2. With l = |wo + eta wi|, eta^2 |wi.h| / l^2 is the Jacobian of h to wi.
template <class T, std::uint32_t E>
void Bsdf<T, E>::addRefraction(const Outgoing& out, const Vec3<T>& wi, BsdfValue<T>& value) const {
    const Vec3<T>& wo = out.wo;
    const Vec3<T> sum(fma(index_.eta, wi.x, wo.x), fma(index_.eta, wi.y, wo.y),
                      fma(index_.eta, wi.z, wo.z));
    const T norm = max(lengthSquared(sum), T(1e-20F));
    const Vec3<T> h = sum * (copysign(T(1), sum.z) / sqrt(norm));
    const T co = dot(wo, h);
    const T ci = dot(wi, h);
    const Mask<T> valid = wi.z < T(0) && !deltaRefraction_ && co > T(0) && ci < T(0);
    if (none(valid)) {
        return;
    }
    const T c = clamp(co, T(0), T(1));
    const Ggx<T> ggx(alpha_);
    const Interface interface = interfaceAt(c);
    const T refracted = mean(interface.refracted);
    const T both = mean(interface.reflected) + refracted;
    const T refracts = select(both > T(1e-20F), refracted / max(both, T(1e-20F)), T(0));

    const T jacobian = abs(ci) / norm;
    const T scale = T(4) * c * ggx.density(h) * ggx.visibility(wo, wi) * abs(wi.z) * jacobian *
                    coatTransmittance(out, wi);
    value.specular += select<T>(valid, interface.refracted * scale, Vec3<T>(T(0)));
    value.pdf += select(valid,
                        out.choice.interface * refracts * c * ggx.visibleDensity(wo, h) *
                            index_.etaSquared * jacobian,
                        T(0));
}

template <class T, std::uint32_t E>
BsdfValue<T> Bsdf<T, E>::evaluate(const Outgoing& out, const Vec3<T>& wi) const {
    BsdfValue<T> value;
    if (any(wi.z > T(0))) {
        addDiffuse(out, wi, value);
        addReflection(out, wi, value);
    }
    if constexpr (kTransmits) {
        if (any(wi.z < T(0) && p_.opacity < T(1))) {
            addRefraction(out, wi, value);
        }
    }
    const Mask<T> valid = out.wo.z > T(0);
    value.diffuse = select<T>(valid, value.diffuse, Vec3<T>(T(0)));
    value.specular = select<T>(valid, value.specular, Vec3<T>(T(0)));
    value.pdf = select(valid, value.pdf, T(0));
    return value;
}

template <class T, std::uint32_t E>
BsdfSample<T> Bsdf<T, E>::sample(const Outgoing& out, const T& uLobe, const Vec2<T>& u) const {
    const Vec3<T>& wo = out.wo;
    const LobeProbabilities& choice = out.choice;
    const Mask<T> coat = uLobe < choice.coat;
    // Rounding must not choose a lobe of probability zero: nothing would be known of it.
    const Mask<T> diffuse =
        !coat && (uLobe < choice.coat + choice.diffuse || choice.interface == T(0));
    const Mask<T> interface = !coat && !diffuse;

    // The facet, and what the interface does there.
    Mask<T> mirror = !coat && deltaReflection_;
    T alpha = alpha_;
    if constexpr (kCoats) {
        mirror = mirror || (coat && deltaCoat_);
        alpha = select(coat, coatAlpha_, alpha_);
    }
    const Vec3<T> up(T(0), T(0), T(1));
    const Vec3<T> rough = Ggx<T>(alpha).sampleVisible(wo, u);
    const Vec3<T> facet = select<T>(mirror, up, rough);
    T reflects(1);
    Mask<T> refracted(false);
    Vec3<T> h = facet;
    if constexpr (kTransmits) {
        const T decision = select(deltaRefraction_, wo.z, clamp(dot(wo, facet), T(0), T(1)));
        reflects = reflectProbability(decision);
        const T uInterface =
            min((uLobe - choice.coat - choice.diffuse) / max(choice.interface, T(1e-20F)),
                T(kOneMinusEpsilon));
        refracted = interface && !(uInterface < reflects);
        h = select<T>(refracted && deltaRefraction_, up, facet);
    }
    const T c = clamp(dot(wo, h), T(0), T(1));
    const Vec3<T> mirrored = h * (T(2) * c) - wo;

    BsdfSample<T> s;
    s.wi = select<T>(diffuse, cosineHemisphere(u), mirrored);
    s.delta = !diffuse && !refracted && mirror;
    s.transmitted = refracted;
    s.diffuse = diffuse;
    s.roughness = select(diffuse, T(1), p_.roughness);
    if constexpr (kCoats) {
        s.roughness = select(coat, p_.clearcoatRoughness, s.roughness);
    }
    if constexpr (kTransmits) {
        // Refraction: t = (-wo + (c - g) h) / eta with c - g = -k / (c + g).
        const T g = safeSqrt(index_.refractedSquared(c));
        const Vec3<T> bent = -wo - h * (index_.k / max(c + g, T(1e-20F)));
        // Its length is eta. Leaving a dense body what wo's rounding adds to it would be multiplied
        // by 1 / eta^2, so that the length is taken as it is.
        const Vec3<T> through = bent * (T(1) / sqrt(select(refracted, lengthSquared(bent), T(1))));
        s.wi = select<T>(refracted, through, s.wi);
        s.delta = s.delta || (refracted && deltaRefraction_);
        s.eta = select(refracted, index_.eta, T(1));
    }

    const BsdfValue<T> value = evaluate(out, s.wi);
    Mask<T> sided = !refracted && s.wi.z > T(0);
    if constexpr (kTransmits) {
        sided = sided || (refracted && s.wi.z < T(0));
    }
    const Mask<T> lit = sided && value.pdf > T(0);
    s.pdf = select(lit, value.pdf, T(0));
    s.weight = select<T>(lit, value.total() / max(value.pdf, T(1e-30F)), Vec3<T>(T(0)));
    if (any(s.delta)) {
        setDelta(out, coat, reflects, s);
    }
    return s;
}

/// Weight, probability and tint of the lanes that chose a delta lobe. `reflects` is the
/// probability of reflection at the interface, which is flat there.
template <class T, std::uint32_t E>
void Bsdf<T, E>::setDelta(const Outgoing& out, const Mask<T>& coat, const T& reflects,
                          BsdfSample<T>& s) const {
    const Vec3<T>& wo = out.wo;
    const LobeProbabilities& choice = out.choice;
    const Interface interface = interfaceAt(wo.z);
    const T through = coatTransmittance(out, s.wi);
    Vec3<T> value = interface.reflected * through;
    T probability = choice.interface;
    if constexpr (kTransmits) {
        const Vec3<T> refraction = interface.refracted * (through / index_.etaSquared);
        value = select<T>(s.transmitted, refraction, value);
        probability = choice.interface * select(s.transmitted, T(1) - reflects, reflects);
    }
    if constexpr (kCoats) {
        value = select<T>(coat, Vec3<T>(coatReflectance(wo.z)), value);
        probability = select(coat, choice.coat, probability);
    }
    const Mask<T> valid = s.delta && probability > T(0) && wo.z > T(0);
    const Vec3<T> weight = value / max(probability, T(1e-30F));
    s.weight = select<T>(s.delta, select<T>(valid, weight, Vec3<T>(T(0))), s.weight);
    s.pdf = select(s.delta, select(valid, probability, T(0)), s.pdf);

    Vec3<T> tint = lerp(metal_, Vec3<T>(T(1)), p_.diffuseColor);
    if constexpr (kSpecularWorkflow) {
        const T strongest = maxComponent(p_.specularColor);
        const Vec3<T> specularTint = select<T>(
            strongest > T(0), p_.specularColor / max(strongest, T(1e-20F)), Vec3<T>(T(1)));
        tint = select<T>(p_.useSpecularWorkflow, specularTint, tint);
    }
    if constexpr (kTransmits) {
        tint = select<T>(s.transmitted, p_.diffuseColor, tint);
    }
    if constexpr (kCoats) {
        tint = select<T>(coat, Vec3<T>(T(1)), tint);
    }
    s.tint = select<T>(s.delta, tint, Vec3<T>(T(1)));
}

template <class T, std::uint32_t E>
Mask<T> Bsdf<T, E>::hasNonDelta() const {
    Mask<T> reflects = outside_.k != T(0) || maxComponent(p_.diffuseColor) * metal_ > T(0);
    if constexpr (kSpecularWorkflow) {
        reflects = reflects || p_.useSpecularWorkflow;
    }
    Mask<T> found = maxComponent(diffuse_) > T(0) || (!deltaReflection_ && reflects);
    if constexpr (kCoats) {
        found = found || (!deltaCoat_ && coat_ > T(0) && outside_.k != T(0));
    }
    if constexpr (kTransmits) {
        found = found || (!deltaRefraction_ && maxComponent(tint_) > T(0));
    }
    return found;
}

template <class T, std::uint32_t E>
Vec3<T> Bsdf<T, E>::albedo() const {
    if constexpr (!kSpecularWorkflow) {
        return p_.diffuseColor;
    }
    const Vec3<T> under = p_.diffuseColor * (Vec3<T>(T(1)) - p_.specularColor);
    return select<T>(p_.useSpecularWorkflow, under + p_.specularColor, p_.diffuseColor);
}

} // namespace mbfeat
