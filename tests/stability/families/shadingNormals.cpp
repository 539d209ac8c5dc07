// Normals that maps and interpolation bend past the horizon.
#include "families.h"

#include "core/warp.h"
#include "rendering.h"
#include "shading/shadingNormal.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;
using test::TestScene;

/// wo at the given cosine to ng, ns anywhere.
template <class Use>
void views(float cosine, const Use& use) {
    TestRandom random(6);
    for (int i = 0; i < 20000; ++i) {
        const Float3 ng = uniformSphere(random.nextFloat2());
        const Float3 any = uniformSphere(random.nextFloat2());
        const Float3 flat = normalize(any - ng * dot(any, ng));
        const Float3 wo = normalize(flat * std::sqrt(1.0F - cosine * cosine) + ng * cosine);
        Float3 ns = uniformSphere(random.nextFloat2());
        if (i % 4 == 0) {
            ns = i % 8 == 0 ? -ng : -wo; // the worst that a map can say
        }
        use(ns, ng, wo);
    }
}

std::string place(const Float3& ns, const Float3& ng, const Float3& wo) {
    return Text().add("wo.ng", dot(wo, ng)).add("wo.ns", dot(wo, ns)).add("ns.ng", dot(ns, ng));
}

void checkInvariants(Report& report, float cosine) {
    views(cosine, [&](const Float3& ns, const Float3& ng, const Float3& wo) {
        const Double3 n(visibleShadingNormal(ns, ng, wo));
        report.error(std::abs(length(n) - 1.0), [&] { return place(ns, ng, wo); });
        const double seen = dot(Double3(wo), n);
        const Double3 mirrored = n * (2.0 * seen) - Double3(wo);
        const double above = dot(mirrored, Double3(ng));
        report.require(seen > 0.0 && above > 0.0, [&] {
            return place(ns, ng, wo) + std::string(Text().add("; wo.n", seen)) + ", " +
                   std::string(Text().add("mirrored.ng", above));
        });
    });
}

/// A floor whose normal map is one value, in a white sky.
Estimate renderMapped(const Float3& map, float roughness, float metallic) {
    TestScene test;
    Material material = test::constantMaterial("/M", Rgb(1.0F));
    material.normal = MaterialInput(map);
    material.roughness = MaterialInput(roughness);
    material.metallic = MaterialInput(metallic);
    test.add("/Floor", test::quadMesh({-100, 0, 100}, {200, 0, 0}, {0, 0, -200}), material);
    test.addSky(Rgb(1.0F));
    Camera camera = test::testCamera({0, 0.5, 0}, 1.0F);
    camera.windowMax.y = -0.02F;
    camera.windowMin.y = -1.0F;
    return trace(test, camera, 24, 24, plainOptions(256));
}

void addMap(Catalogue& catalogue, const std::string& name, const Float3& map, float roughness,
            float metallic) {
    catalogue.push_back(
        {"normal/map-" + name,
         "radiance above 1 of a white floor with a bent normal in a white sky, score", kLargestZ,
         kReasonZ, [=](Report& report) {
             const Estimate e = renderMapped(map, roughness, metallic);
             report.error(e.mean() > 1.0 ? score(e, 1.0) : 0.0,
                          [&] { return Text().add("mean", e.mean()); });
             int black = 0;
             for (const double v : e.grey()) {
                 black += v > 0.0 ? 0 : 1;
             }
             report.require(black == 0, [&] { return Text().add("black pixels", black); });
             report.picture(e.picture("floor"));
         }});
}

/// A white mirror shows the sky in whatever direction its normal map bends the view, as long as
/// that is above the floor.
void checkMirror(Report& report) {
    const Estimate e = renderMapped({0.9F, 0.3F, -0.3F}, 0.0F, 1.0F);
    for (const double v : e.grey()) {
        report.error(relativeError(v, 1.0), [&] { return Text().add("radiance", v); });
    }
    report.picture(e.picture("floor"));
}

} // namespace

void addShadingNormals(Catalogue& catalogue) {
    for (const auto& [name, cosine] : {std::pair("0.5", 0.5F), std::pair("1e-2", 1e-2F),
                                       std::pair("1e-4", 1e-4F), std::pair("1e-5", 1e-5F)}) {
        catalogue.push_back(
            {std::string("normal/bent-at-cosine-") + name,
             "length of the bent normal against 1; above the horizon, and so is "
             "the mirrored view",
             4e-7, "three roundings of a normalisation",
             [cosine = cosine](Report& report) { checkInvariants(report, cosine); }});
    }
    addMap(catalogue, "past-horizon-diffuse", {0.9F, 0.3F, -0.3F}, 1.0F, 0.0F);
    catalogue.push_back({"normal/map-past-horizon-mirror",
                         "radiance of a white mirror with a bent normal in a white sky against 1, "
                         "relative",
                         1e-6, "a weight of 1 to some roundings", checkMirror});
    addMap(catalogue, "past-horizon-glossy", {-0.2F, -0.9F, -0.5F}, 0.2F, 1.0F);
    addMap(catalogue, "upside-down", {0.0F, 1e-4F, -1.0F}, 0.4F, 1.0F);
    addMap(catalogue, "in-plane", {1.0F, 0.0F, 0.0F}, 0.4F, 1.0F);
}

} // namespace mbfeat::stability
