// Energy and reciprocity of the closure, by quadrature of its own samples (double lanes).
#include <doctest/doctest.h>

#include "shading/bsdfCases.h"
#include "support/chiSquared.h"

namespace mbfeat::test {

namespace {

struct Albedo {
    Double3 reflected{0.0}, transmitted{0.0};
    double largest() const { return maxComponent(reflected + transmitted); }
};

/// Light that leaves wo's direction for uniform light from everywhere. Stratified in all three
/// numbers; transmitted light has eta^2 taken out, so that it counts flux, not radiance.
Albedo directionalAlbedo(const SurfaceParameters<double>& p, bool entering, const Double3& wo,
                         int grid) {
    const Bsdf<double> bsdf(p, entering);
    TestRandom random(7);
    Albedo albedo;
    const int count = grid * grid;
    for (int i = 0; i < count; ++i) {
        // The lobe's number is a stratified permutation of the samples (golden ratio).
        const double lobe = std::fmod(i * 0.6180339887498949, 1.0);
        const double x = (i % grid + random.nextDouble()) / grid;
        const double y = (std::floor(i / static_cast<double>(grid)) + random.nextDouble()) / grid;
        const BsdfSample<double> s = bsdf.sample(wo, lobe, {x, std::min(y, 1.0 - 1e-9)});
        const Double3 weight = s.weight * sqr(s.eta);
        (s.transmitted ? albedo.transmitted : albedo.reflected) += weight;
    }
    albedo.reflected *= 1.0 / count;
    albedo.transmitted *= 1.0 / count;
    return albedo;
}

SurfaceParameters<double> white(double ior, double roughness) {
    SurfaceParameters<double> p;
    p.diffuseColor = Double3(1.0);
    p.ior = ior;
    p.roughness = roughness;
    return p;
}

constexpr double kCosines[] = {1.0, 0.8, 0.5, 0.2, 0.05, 0.01};

} // namespace

TEST_CASE("no parameters make a surface that reflects more light than it gets") {
    // The quadrature's own error; the closure is meant to stay at or below 1.
    constexpr double kTolerance = 2e-3;
    double largest = 0.0;
    const auto check = [&](const SurfaceParameters<double>& p, const char* what) {
        for (const bool entering : {true, false}) {
            for (const double cosine : kCosines) {
                const double albedo =
                    directionalAlbedo(p, entering, direction<double>(cosine, 0.3), 64).largest();
                INFO(what, ": ior ", p.ior, ", roughness ", p.roughness, ", opacity ", p.opacity,
                     ", F0 ", p.specularColor.x, ", cosine ", cosine, ", entering ", entering);
                CHECK(albedo <= 1.0 + kTolerance);
                largest = std::max(largest, albedo);
            }
        }
    };
    for (const double roughness : {0.0, 0.05, 0.2, 0.5, 1.0}) {
        for (const double ior : {0.5, 1.0, 1.02, 1.33, 1.5, 2.5, 10.0}) {
            SurfaceParameters<double> p = white(ior, roughness);
            check(p, "dielectric");
            p.clearcoat = 1.0;
            p.clearcoatRoughness = 1.0 - roughness;
            check(p, "clearcoat on a dielectric");
            p.metallic = 1.0;
            check(p, "clearcoat on metal");
            p.metallic = 0.5;
            p.opacity = 0.5;
            check(p, "half of everything");
        }
        for (const double f0 : {0.0, 0.04, 0.5, 1.0}) {
            SurfaceParameters<double> p = white(1.5, roughness);
            p.useSpecularWorkflow = true;
            p.specularColor = Double3(f0);
            check(p, "specular workflow");
            p.opacity = 0.3;
            check(p, "specular workflow, translucent");
        }
    }
    MESSAGE("largest directional albedo: ", largest);
}

TEST_CASE("a white dielectric hardly darkens") {
    // What single scattering and the coupling of diffuse and specular light may lose.
    for (const double roughness : {0.0, 0.3, 0.6, 1.0}) {
        for (const double cosine : kCosines) {
            const double albedo =
                directionalAlbedo(white(1.5, roughness), true, direction<double>(cosine, 0.3), 96)
                    .largest();
            INFO("roughness ", roughness, ", cosine ", cosine);
            CHECK(albedo > (roughness == 0.0 ? 0.995 : 0.87));
        }
    }
}

TEST_CASE("index 1 is exactly Lambert's diffuse reflection") {
    SurfaceParameters<double> p = white(1.0, 0.5);
    p.diffuseColor = Double3(0.5);
    const Bsdf<double> bsdf(p, true);
    for (const double cosine : kCosines) {
        const BsdfValue<double> value =
            bsdf.evaluate(direction<double>(cosine, 0.0), direction<double>(0.4, 2.0));
        CHECK(value.diffuse.x == doctest::Approx(0.5 * 0.4 / 3.14159265358979).epsilon(1e-7));
        CHECK(maxComponent(value.specular) == 0.0);
        CHECK(value.pdf == doctest::Approx(0.4 / 3.14159265358979).epsilon(1e-7));
        const BsdfSample<double> s = bsdf.sample(direction<double>(cosine, 0.0), 0.5, {0.25, 0.75});
        CHECK(s.weight.x == doctest::Approx(0.5).epsilon(1e-12));
        CHECK(s.diffuse);
    }
}

TEST_CASE("smooth glass loses nothing, rough glass only what its facets mask") {
    const auto furnace = [](double ior, double roughness, double cosine, bool entering) {
        SurfaceParameters<double> p = white(ior, roughness);
        p.opacity = 0.0;
        return directionalAlbedo(p, entering, direction<double>(cosine, 0.3), 96).largest();
    };
    for (const double ior : {0.8, 1.0, 1.3, 1.5, 2.4}) {
        for (const bool entering : {true, false}) {
            for (const double cosine : kCosines) {
                INFO("ior ", ior, ", cosine ", cosine, ", entering ", entering);
                CHECK(furnace(ior, 0.0, cosine, entering) == doctest::Approx(1.0).epsilon(1e-9));
            }
        }
    }
    // The loss of single scattering at ior 1.5, over all angles.
    const auto loss = [&](double roughness, bool entering) {
        double worst = 0.0;
        for (const double cosine : {1.0, 0.8, 0.5, 0.2}) {
            worst = std::max(worst, 1.0 - furnace(1.5, roughness, cosine, entering));
        }
        return worst;
    };
    CHECK(loss(0.1, true) < 0.01);
    CHECK(loss(0.3, true) < 0.06);
    CHECK(loss(0.5, true) < 0.10);
    CHECK(loss(1.0, true) < 0.31);
    CHECK(loss(0.1, false) < 0.01);
    CHECK(loss(0.3, false) < 0.11);
    CHECK(loss(0.5, false) < 0.22);
    CHECK(loss(1.0, false) < 0.60);
    for (const double roughness : {0.1, 0.5, 1.0}) {
        MESSAGE("rough glass ", roughness, " loses up to ", loss(roughness, true), " entering, ",
                loss(roughness, false), " leaving");
    }
}

TEST_CASE("reflection is reciprocal") {
    TestRandom random(11);
    for (const BsdfCase& c : bsdfCases()) {
        const Bsdf<double> bsdf(convert<double>(c.parameters), c.entering);
        for (int i = 0; i < 200; ++i) {
            const Double3 a =
                direction<double>(0.01 + 0.99 * random.nextDouble(), 6.0 * random.nextDouble());
            const Double3 b =
                direction<double>(0.01 + 0.99 * random.nextDouble(), 6.0 * random.nextDouble());
            const Double3 forth = bsdf.evaluate(a, b).total() * a.z;
            const Double3 back = bsdf.evaluate(b, a).total() * b.z;
            INFO(c.name);
            CHECK(forth.x == doctest::Approx(back.x).epsilon(1e-9));
            CHECK(forth.z == doctest::Approx(back.z).epsilon(1e-9));
        }
    }
}

TEST_CASE("float reflection is reciprocal where both directions graze the surface") {
    for (const BsdfCase& c : bsdfCases()) {
        const Bsdf<float> bsdf(c.parameters, c.entering);
        for (int i = 0; i < 200; ++i) {
            const Float3 a = direction(1e-6, 0.03 * i), b = direction(1e-5, 3.1);
            const float forth = bsdf.evaluate(a, b).total().x * a.z;
            const float back = bsdf.evaluate(b, a).total().x * b.z;
            INFO(c.name, ", azimuth ", 0.03 * i);
            CHECK(std::abs(forth - back) <= 2e-6F * std::max(forth, back) + 1e-30F);
        }
    }
}

TEST_CASE("refraction is reciprocal up to eta squared") {
    TestRandom random(12);
    int compared = 0;
    for (const double clearcoat : {0.0, 0.7}) {
        for (const double ior : {1.5, 0.8}) {
            SurfaceParameters<double> p = white(ior, 0.6);
            p.opacity = 0.0;
            p.clearcoat = clearcoat;
            p.clearcoatRoughness = 0.4;
            const Bsdf<double> entering(p, true);
            const Bsdf<double> leaving(p, false);
            for (int i = 0; i < 2000; ++i) {
                const Double3 out =
                    direction<double>(0.05 + 0.95 * random.nextDouble(), 6.0 * random.nextDouble());
                const Double3 in = -direction<double>(0.05 + 0.95 * random.nextDouble(),
                                                      6.0 * random.nextDouble());
                // f = (f cos) / cos; leaving is seen from inside, where +z is inwards.
                const double forth = entering.evaluate(out, in).specular.x / -in.z;
                const double back =
                    leaving.evaluate({in.x, in.y, -in.z}, {out.x, out.y, -out.z}).specular.x /
                    out.z;
                CHECK(forth * ior * ior == doctest::Approx(back).epsilon(1e-9));
                compared += forth > 0.0 ? 1 : 0;
            }
        }
    }
    CHECK(compared > 1000);
}

} // namespace mbfeat::test
