// Parameter sets that the tests of the closure share: each lobe alone, then mixtures.
#pragma once

#include <string>
#include <vector>

#include "shading/previewSurface.h"

namespace mbfeat::test {

struct BsdfCase {
    std::string name;
    SurfaceParameters<float> parameters;
    bool entering = true;
};

/// A set with some inputs changed by `edit(parameters)`.
template <class Edit>
BsdfCase bsdfCase(const std::string& name, bool entering, Edit edit) {
    BsdfCase result{name, {}, entering};
    edit(result.parameters);
    return result;
}

inline std::vector<BsdfCase> bsdfCases() {
    using P = SurfaceParameters<float>;
    const auto glass = [](float roughness, float ior) {
        return [=](P& p) {
            p.diffuseColor = Float3(0.9F, 0.7F, 1.0F);
            p.opacity = 0.0F;
            p.roughness = roughness;
            p.ior = ior;
        };
    };
    return {
        bsdfCase("Lambert", true, [](P& p) { p.ior = 1.0F; }),
        bsdfCase("default", true, [](P&) {}),
        bsdfCase("white, rough", true,
                 [](P& p) {
                     p.diffuseColor = Float3(1.0F);
                     p.roughness = 1.0F;
                 }),
        bsdfCase("metal 0.3", true,
                 [](P& p) {
                     p.diffuseColor = Float3(0.9F, 0.6F, 0.2F);
                     p.metallic = 1.0F;
                     p.roughness = 0.3F;
                 }),
        bsdfCase("metal 1", true,
                 [](P& p) {
                     p.diffuseColor = Float3(0.9F, 0.6F, 0.2F);
                     p.metallic = 1.0F;
                     p.roughness = 1.0F;
                 }),
        bsdfCase("half metal", true,
                 [](P& p) {
                     p.diffuseColor = Float3(0.8F, 0.3F, 0.1F);
                     p.metallic = 0.5F;
                     p.roughness = 0.4F;
                 }),
        bsdfCase("specular workflow", true,
                 [](P& p) {
                     p.useSpecularWorkflow = true;
                     p.specularColor = Float3(0.5F, 0.2F, 0.1F);
                     p.roughness = 0.4F;
                     p.metallic = 1.0F; // must be ignored
                 }),
        bsdfCase("clearcoat on black", true,
                 [](P& p) {
                     p.diffuseColor = Float3(0.0F);
                     p.roughness = 0.7F;
                     p.clearcoat = 1.0F;
                     p.clearcoatRoughness = 0.25F;
                 }),
        bsdfCase("clearcoat on metal", true,
                 [](P& p) {
                     p.diffuseColor = Float3(0.7F, 0.4F, 0.3F);
                     p.metallic = 1.0F;
                     p.roughness = 0.5F;
                     p.clearcoat = 0.8F;
                     p.clearcoatRoughness = 0.2F;
                     p.ior = 1.8F;
                 }),
        bsdfCase("smooth clearcoat", true, [](P& p) { p.clearcoat = 1.0F; }),
        bsdfCase("glass 0.3, entering", true, glass(0.3F, 1.5F)),
        bsdfCase("glass 0.3, leaving", false, glass(0.3F, 1.5F)),
        bsdfCase("glass 0.7, entering", true, glass(0.7F, 1.33F)),
        bsdfCase("glass 0.7, leaving", false, glass(0.7F, 1.33F)),
        bsdfCase("glass 1, ior 2.4, entering", true, glass(1.0F, 2.4F)),
        bsdfCase("glass 1, ior 2.4, leaving", false, glass(1.0F, 2.4F)),
        bsdfCase("bubble, entering", true, glass(0.4F, 0.75F)),
        bsdfCase("bubble, leaving", false, glass(0.4F, 0.75F)),
        bsdfCase("glass 0.6, ior 1.2", true, glass(0.6F, 1.2F)),
        bsdfCase("half opaque", true,
                 [](P& p) {
                     p.diffuseColor = Float3(0.8F);
                     p.opacity = 0.5F;
                     p.clearcoat = 0.5F;
                     p.clearcoatRoughness = 0.3F;
                 }),
        bsdfCase("half opaque, leaving", false,
                 [](P& p) {
                     p.diffuseColor = Float3(0.8F);
                     p.opacity = 0.5F;
                     p.clearcoat = 0.5F;
                     p.clearcoatRoughness = 0.3F;
                 }),
        bsdfCase("half opaque, smooth", true,
                 [](P& p) {
                     p.opacity = 0.5F;
                     p.roughness = 0.0F;
                 }),
        bsdfCase("specular workflow glass, leaving", false,
                 [](P& p) {
                     p.useSpecularWorkflow = true;
                     p.specularColor = Float3(0.04F, 0.08F, 0.04F);
                     p.diffuseColor = Float3(1.0F);
                     p.opacity = 0.0F;
                     p.roughness = 0.4F;
                 }),
    };
}

/// A unit direction from its cosine and azimuth.
template <class T = float>
Vec3<T> direction(double cosine, double phi) {
    const double sine = std::sqrt((1.0 - cosine) * (1.0 + cosine));
    return {static_cast<T>(sine * std::cos(phi)), static_cast<T>(sine * std::sin(phi)),
            static_cast<T>(cosine)};
}

/// The same parameters on another lane type.
template <class T>
SurfaceParameters<T> convert(const SurfaceParameters<float>& p) {
    const auto one = [](float v) { return T(static_cast<Scalar<T>>(v)); };
    const auto three = [&](const Float3& v) { return Vec3<T>(one(v.x), one(v.y), one(v.z)); };
    SurfaceParameters<T> r;
    r.diffuseColor = three(p.diffuseColor);
    r.emission = three(p.emission);
    r.specularColor = three(p.specularColor);
    r.useSpecularWorkflow = Mask<T>(p.useSpecularWorkflow);
    r.metallic = one(p.metallic);
    r.roughness = one(p.roughness);
    r.clearcoat = one(p.clearcoat);
    r.clearcoatRoughness = one(p.clearcoatRoughness);
    r.opacity = one(p.opacity);
    r.ior = one(p.ior);
    r.tangentNormal = three(p.tangentNormal);
    return r;
}

} // namespace mbfeat::test
