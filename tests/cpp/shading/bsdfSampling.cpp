// Bsdf::sample against Bsdf::evaluate: densities, weights, and the bookkeeping of delta lobes.
// The sampler under test is the float one, its density the double one.
#include <doctest/doctest.h>

#include "shading/bsdfCases.h"
#include "support/chiSquared.h"

namespace mbfeat::test {

namespace {

struct Sampled {
    Bsdf<float> sampler;
    Bsdf<double> oracle;
    Float3 wo;

    Sampled(const BsdfCase& c, const Float3& direction)
        : sampler(c.parameters, c.entering),
          oracle(convert<double>(c.parameters), c.entering),
          wo(direction) {}

    std::optional<Float3> draw(TestRandom& random) const {
        const float choice = random.nextFloat();
        const BsdfSample<float> s = sampler.sample(wo, choice, random.nextFloat2());
        return s.pdf > 0.0F && !s.delta ? std::optional<Float3>(s.wi) : std::nullopt;
    }
    double density(const Float3& wi) const { return oracle.evaluate(Double3(wo), Double3(wi)).pdf; }
};

void checkSphere(const BsdfCase& c, double cosine, std::uint64_t seed) {
    const Sampled sampled(c, direction(cosine, 0.7));
    const ChiSquaredResult result =
        chiSquaredSphere([&](TestRandom& random) { return sampled.draw(random); },
                         [&](const Float3& wi) { return sampled.density(wi); }, {0.0F, 0.0F, 1.0F},
                         32, 32, 150000, seed);
    INFO(c.name, ", cosine ", cosine, ": ", result.message);
    CHECK(result.passed);
}

void checkCap(const BsdfCase& c, double cosine, const Float3& axis, double angle,
              std::uint64_t seed) {
    const Sampled sampled(c, direction(cosine, 0.7));
    const ChiSquaredResult result =
        chiSquaredCap([&](TestRandom& random) { return sampled.draw(random); },
                      [&](const Float3& wi) { return sampled.density(wi); }, axis, std::cos(angle),
                      24, 24, 150000, seed);
    INFO(c.name, ", cosine ", cosine, ": ", result.message);
    CHECK(result.passed);
}

} // namespace

TEST_CASE("sampled directions have the density that evaluate() reports") {
    std::uint64_t seed = 1;
    for (const BsdfCase& c : bsdfCases()) {
        for (const double cosine : {1.0, 0.6, 0.05}) {
            checkSphere(c, cosine, seed++);
        }
    }
}

TEST_CASE("narrow lobes have their density") {
    std::uint64_t seed = 1000;
    for (const float roughness : {0.03F, 0.08F}) {
        const BsdfCase metal = bsdfCase("narrow metal", true, [&](auto& p) {
            p.metallic = 1.0F;
            p.roughness = roughness;
        });
        const double alpha = static_cast<double>(roughness) * static_cast<double>(roughness);
        for (const double cosine : {0.999, 0.5}) {
            checkCap(metal, cosine, direction(cosine, 0.7 + static_cast<double>(kPi)), 8.0 * alpha,
                     seed++);
        }
        const BsdfCase glass = bsdfCase("narrow glass", true, [&](auto& p) {
            p.opacity = 0.0F;
            p.roughness = roughness;
        });
        const double sine = std::sqrt(1.0 - 0.6 * 0.6) / 1.5;
        const Float3 refracted =
            direction(-std::sqrt(1.0 - sine * sine), 0.7 + static_cast<double>(kPi));
        checkCap(glass, 0.6, refracted, 6.0 * alpha, seed++);
    }
    const BsdfCase faint = bsdfCase("glass that hardly bends", true, [](auto& p) {
        p.opacity = 0.0F;
        p.roughness = 0.6F;
        p.ior = 1.05F;
    });
    checkCap(faint, 1.0, {0.0F, 0.0F, -1.0F}, 0.2, seed++);
    checkCap(faint, 0.6, -direction(0.6, 0.7), 0.2, seed++);
}

TEST_CASE("a sample's weight is f cos / pdf of the whole mixture, and never negative") {
    TestRandom random(5);
    for (const BsdfCase& c : bsdfCases()) {
        const Bsdf<float> bsdf(c.parameters, c.entering);
        for (int i = 0; i < 2000; ++i) {
            const Float3 wo =
                direction(0.001 + 0.999 * random.nextDouble(), 6.0 * random.nextDouble());
            const float choice = random.nextFloat();
            const BsdfSample<float> s = bsdf.sample(wo, choice, random.nextFloat2());
            INFO(c.name);
            REQUIRE(isFinite(s.weight));
            REQUIRE(std::isfinite(s.pdf));
            REQUIRE(std::min({s.weight.x, s.weight.y, s.weight.z, s.pdf}) >= 0.0F);
            if (!(s.pdf > 0.0F)) {
                CHECK(isBlack(s.weight));
                continue;
            }
            CHECK(std::abs(length(s.wi) - 1.0F) < 1e-5F);
            CHECK(s.transmitted == (s.wi.z < 0.0F));
            CHECK((s.eta == 1.0F || s.transmitted));
            if (!s.delta) {
                const BsdfValue<float> value = bsdf.evaluate(wo, s.wi);
                CHECK(value.pdf == doctest::Approx(s.pdf).epsilon(1e-5));
                CHECK(value.total().y == doctest::Approx(s.weight.y * s.pdf).epsilon(1e-5));
            }
        }
    }
}

TEST_CASE("light sampling is offered exactly where a lobe is not a delta") {
    const auto hasNonDelta = [](auto edit) {
        SurfaceParameters<float> p;
        edit(p);
        return Bsdf<float>(p, true).hasNonDelta();
    };
    CHECK(hasNonDelta([](auto&) {}));
    CHECK_FALSE(hasNonDelta([](auto& p) { p.opacity = p.roughness = 0.0F; }));
    CHECK(hasNonDelta([](auto& p) { p.opacity = 0.0F; }));
    CHECK(hasNonDelta([](auto& p) { p.opacity = 0.5F, p.roughness = 0.0F; }));
    CHECK_FALSE(hasNonDelta([](auto& p) { p.metallic = 1.0F, p.roughness = 0.0F; }));
    CHECK(hasNonDelta([](auto& p) {
        p.metallic = 1.0F, p.roughness = 0.0F, p.clearcoat = 1.0F, p.clearcoatRoughness = 0.2F;
    }));
}

TEST_CASE("smooth glass reflects and refracts as deltas by Fresnel's and Snell's laws") {
    SurfaceParameters<float> p;
    p.diffuseColor = Float3(0.5F, 1.0F, 0.25F);
    p.opacity = 0.0F;
    p.roughness = 0.0F;
    for (const bool entering : {true, false}) {
        const double eta = entering ? 1.5 : 1.0 / 1.5;
        const Bsdf<float> bsdf(p, entering);
        const Float3 wo = direction(0.8, 1.0);
        const double refractedCosine = std::sqrt(1.0 - (1.0 - 0.64) / (eta * eta));
        const double rs = (0.8 - eta * refractedCosine) / (0.8 + eta * refractedCosine);
        const double rp = (eta * 0.8 - refractedCosine) / (eta * 0.8 + refractedCosine);
        const double reflectance = 0.5 * (rs * rs + rp * rp);

        int reflections = 0;
        for (int i = 0; i < 1000; ++i) {
            const BsdfSample<float> s =
                bsdf.sample(wo, (static_cast<float>(i) + 0.5F) / 1000.0F, {0.3F, 0.6F});
            REQUIRE(s.delta);
            reflections += s.transmitted ? 0 : 1;
            if (s.transmitted) {
                CHECK(s.wi.z == doctest::Approx(-refractedCosine));
                CHECK(s.wi.x == doctest::Approx(-wo.x / eta));
                CHECK(s.wi.y == doctest::Approx(-wo.y / eta));
                CHECK(s.tint == p.diffuseColor);
                CHECK(s.eta == doctest::Approx(eta));
                CHECK(s.weight.x * s.pdf ==
                      doctest::Approx(0.5 * (1.0 - reflectance) / (eta * eta)));
            } else {
                CHECK(s.wi == Float3(-wo.x, -wo.y, wo.z));
                CHECK(s.tint == Float3(1.0F));
                CHECK(s.weight.x * s.pdf == doctest::Approx(reflectance));
            }
        }
        CHECK(reflections > 0);
        CHECK(reflections < 1000);
    }
}

TEST_CASE("the tint of a metal mirror is its colour") {
    SurfaceParameters<float> p;
    p.diffuseColor = Float3(0.9F, 0.6F, 0.2F);
    p.metallic = 1.0F;
    p.roughness = 0.0F;
    const Bsdf<float> metal(p, true);
    const BsdfSample<float> s = metal.sample(direction(0.5, 0.0), 0.5F, {0.5F, 0.5F});
    CHECK(s.delta);
    CHECK(s.tint.x == doctest::Approx(0.9F));
    CHECK(s.tint.z == doctest::Approx(0.2F));
    CHECK(s.weight.y == doctest::Approx(0.6F));
    CHECK(metal.albedo() == p.diffuseColor);
}

TEST_CASE("index 1 passes straight through, whatever the roughness") {
    for (const float roughness : {0.0F, 0.3F, 1.0F}) {
        SurfaceParameters<float> p;
        p.diffuseColor = Float3(1.0F);
        p.opacity = 0.0F;
        p.ior = 1.0F;
        p.roughness = roughness;
        for (const double cosine : {1.0, 0.5, 1e-3}) {
            const Float3 wo = direction(cosine, 2.0);
            for (const bool entering : {true, false}) {
                const BsdfSample<float> s = Bsdf<float>(p, entering).sample(wo, 0.7F, {0.2F, 0.9F});
                CHECK(s.delta);
                CHECK(s.transmitted);
                CHECK(length(s.wi + wo) < 1e-6F);
                CHECK(s.weight.x == doctest::Approx(1.0F));
            }
        }
    }
}

TEST_CASE("directions that leave a dense body are unit vectors") {
    TestRandom random(5);
    for (const float ior : {1.5F, 10.0F, 100.0F}) {
        for (const float roughness : {0.0F, 0.3F}) {
            SurfaceParameters<float> p;
            p.opacity = 0.0F;
            p.ior = ior;
            p.roughness = roughness;
            const Bsdf<float> leaving(p, false);
            for (int i = 0; i < 2000; ++i) {
                const Float3 wo = direction(1.0 - 1e-4 * random.nextDouble(), 1.0);
                const float choice = random.nextFloat();
                const BsdfSample<float> s = leaving.sample(wo, choice, random.nextFloat2());
                INFO("ior ", ior, ", roughness ", roughness, ", wi.z ", s.wi.z);
                REQUIRE(std::abs(length(Double3(s.wi)) - 1.0) < 6e-7);
            }
        }
    }
}

} // namespace mbfeat::test
