// One closure, three kinds of number: float against double, SIMD lanes against float, and the
// limits of every parameter.
#include <doctest/doctest.h>

#include <array>

#include "shading/bsdfCases.h"
#include "support/chiSquared.h"

namespace mbfeat::test {

namespace {

using Batch = xsimd::batch<float>;
constexpr int kLanes = LaneTraits<Batch>::kWidth;
using Lanes = std::array<float, static_cast<std::size_t>(kLanes)>;

/// Builds a batch from a value for each lane.
template <class F>
Batch gather(F value) {
    alignas(64) Lanes lanes;
    for (int i = 0; i < kLanes; ++i) {
        lanes[static_cast<std::size_t>(i)] = value(i);
    }
    return Batch::load_unaligned(lanes.data());
}

template <class F>
Vec3<Batch> gather3(F value) {
    return {gather([&](int i) { return value(i).x; }), gather([&](int i) { return value(i).y; }),
            gather([&](int i) { return value(i).z; })};
}

float lane(const Batch& batch, int i) {
    alignas(64) Lanes lanes;
    batch.store_unaligned(lanes.data());
    return lanes[static_cast<std::size_t>(i)];
}

Float3 lane(const Vec3<Batch>& v, int i) {
    return {lane(v.x, i), lane(v.y, i), lane(v.z, i)};
}

bool lane(const Mask<Batch>& mask, int i) {
    return lane(select(mask, Batch(1.0F), Batch(0.0F)), i) != 0.0F;
}

/// The cases first .. first + kLanes - 1, one a lane, in one parameter set.
SurfaceParameters<Batch> gatherParameters(const std::vector<BsdfCase>& cases, std::size_t first,
                                          Mask<Batch>& entering) {
    const auto at = [&](int i) -> const BsdfCase& {
        return cases[(first + static_cast<std::size_t>(i)) % cases.size()];
    };
    SurfaceParameters<Batch> p;
    p.diffuseColor = gather3([&](int i) { return at(i).parameters.diffuseColor; });
    p.specularColor = gather3([&](int i) { return at(i).parameters.specularColor; });
    p.useSpecularWorkflow = gather([&](int i) {
                                return at(i).parameters.useSpecularWorkflow ? 1.0F : 0.0F;
                            }) > Batch(0.5F);
    p.metallic = gather([&](int i) { return at(i).parameters.metallic; });
    p.roughness = gather([&](int i) { return at(i).parameters.roughness; });
    p.clearcoat = gather([&](int i) { return at(i).parameters.clearcoat; });
    p.clearcoatRoughness = gather([&](int i) { return at(i).parameters.clearcoatRoughness; });
    p.opacity = gather([&](int i) { return at(i).parameters.opacity; });
    p.ior = gather([&](int i) { return at(i).parameters.ior; });
    entering = gather([&](int i) { return at(i).entering ? 1.0F : 0.0F; }) > Batch(0.5F);
    return p;
}

} // namespace

TEST_CASE("each SIMD lane evaluates bit for bit what the scalar code does") {
    const std::vector<BsdfCase> cases = bsdfCases();
    TestRandom random(21);
    for (std::size_t first = 0; first < cases.size(); ++first) {
        Mask<Batch> entering(true);
        const SurfaceParameters<Batch> p = gatherParameters(cases, first, entering);
        const Bsdf<Batch> bsdf(p, entering);
        for (int repeat = 0; repeat < 50; ++repeat) {
            std::array<Float3, 64> wo;
            std::array<Float3, 64> wi;
            for (std::size_t i = 0; i < 64; ++i) {
                wo[i] = direction(0.01 + 0.99 * random.nextDouble(), 6.0 * random.nextDouble());
                wi[i] = direction(2.0 * random.nextDouble() - 1.0, 6.0 * random.nextDouble());
            }
            const BsdfValue<Batch> value =
                bsdf.evaluate(gather3([&](int i) { return wo[static_cast<std::size_t>(i)]; }),
                              gather3([&](int i) { return wi[static_cast<std::size_t>(i)]; }));
            for (int i = 0; i < kLanes; ++i) {
                const auto index = static_cast<std::size_t>(i);
                const BsdfCase& c = cases[(first + index) % cases.size()];
                const BsdfValue<float> expected =
                    Bsdf<float>(c.parameters, c.entering).evaluate(wo[index], wi[index]);
                INFO(c.name);
                CHECK(lane(value.pdf, i) == expected.pdf);
                CHECK(lane(value.diffuse, i) == expected.diffuse);
                CHECK(lane(value.specular, i) == expected.specular);
            }
        }
    }
}

TEST_CASE("each SIMD lane samples what the scalar code does") {
    // Sine and cosine are not the C library's in SIMD, so directions differ by a few ulp.
    const std::vector<BsdfCase> cases = bsdfCases();
    TestRandom random(22);
    for (std::size_t first = 0; first < cases.size(); ++first) {
        Mask<Batch> entering(true);
        const SurfaceParameters<Batch> p = gatherParameters(cases, first, entering);
        const Bsdf<Batch> bsdf(p, entering);
        for (int repeat = 0; repeat < 50; ++repeat) {
            const Float3 wo = direction(0.05 + 0.95 * random.nextDouble(), 1.0);
            const float choice = random.nextFloat();
            const Float2 u = random.nextFloat2();
            const BsdfSample<Batch> s = bsdf.sample(gather3([&](int) { return wo; }), Batch(choice),
                                                    {Batch(u.x), Batch(u.y)});
            for (int i = 0; i < kLanes; ++i) {
                const BsdfCase& c = cases[(first + static_cast<std::size_t>(i)) % cases.size()];
                const BsdfSample<float> expected =
                    Bsdf<float>(c.parameters, c.entering).sample(wo, choice, u);
                INFO(c.name);
                CHECK(lane(s.delta, i) == expected.delta);
                CHECK(lane(s.diffuse, i) == expected.diffuse);
                CHECK(lane(s.transmitted, i) == expected.transmitted);
                CHECK(lane(s.eta, i) == expected.eta);
                CHECK(lane(s.roughness, i) == expected.roughness);
                CHECK(lane(s.tint, i) == expected.tint);
                CHECK(length(lane(s.wi, i) - expected.wi) < 5e-6F);
                CHECK(lane(s.pdf, i) == doctest::Approx(expected.pdf).epsilon(1e-3));
                CHECK(lane(s.weight, i).y == doctest::Approx(expected.weight.y).epsilon(1e-4));
            }
        }
    }
}

TEST_CASE("float keeps to double within its rounding budget") {
    // Half vectors are off by about 1e-7 each way, which a lobe of width alpha magnifies.
    TestRandom random(23);
    double worst = 0.0;
    for (const BsdfCase& c : bsdfCases()) {
        const Bsdf<float> bsdf(c.parameters, c.entering);
        const Bsdf<double> oracle(convert<double>(c.parameters), c.entering);
        const double alpha = static_cast<double>(sqr(c.parameters.roughness));
        const double budget = 5e-5 + 2e-6 / std::max(alpha, static_cast<double>(kDeltaAlpha));
        for (int i = 0; i < 3000; ++i) {
            const Float3 wo =
                direction(0.01 + 0.99 * random.nextDouble(), 6.0 * random.nextDouble());
            // Where the lobes are: what double samples.
            const BsdfSample<double> s = oracle.sample(Double3(wo), random.nextDouble(),
                                                       {random.nextDouble(), random.nextDouble()});
            if (s.delta || !(s.pdf > 0.0) || std::abs(s.wi.z) < 1e-3) {
                continue;
            }
            const Float3 wi(s.wi);
            const BsdfValue<double> expected = oracle.evaluate(Double3(wo), Double3(wi));
            const BsdfValue<float> value = bsdf.evaluate(wo, wi);
            const double pdfError =
                std::abs(static_cast<double>(value.pdf) - expected.pdf) / (expected.pdf + 1e-6);
            const double valueError =
                std::abs(static_cast<double>(value.total().x) - expected.total().x) /
                (expected.total().x + 1e-6);
            INFO(c.name, ", wo.z ", wo.z, ", wi.z ", wi.z, ", pdf ", expected.pdf);
            CHECK(pdfError < budget);
            CHECK(valueError < budget);
            worst = std::max(worst, std::max(pdfError, valueError) / budget);
        }
    }
    MESSAGE("largest share of the budget used: ", worst);
}

TEST_CASE("no limit of any parameter gives a value that is not finite") {
    const float units[] = {0.0F, 1e-6F, 0.0141F, 0.0142F, 0.5F, 1.0F};
    const float iors[] = {0.01F, 0.5F, 1.0F - 1e-6F, 1.0F, 1.0F + 1e-6F, 1.5F, 10.0F, 100.0F};
    const Float3 directions[] = {{0.0F, 0.0F, 1.0F},
                                 {1.0F, 0.0F, 1e-30F},
                                 {0.0F, 1.0F, 1e-10F},
                                 direction(1e-4, 3.0),
                                 direction(std::sqrt(1.0 - 1.0 / 2.25), 1.0),
                                 direction(0.7, 5.0)};
    const float numbers[] = {0.0F, 0x1p-24F, 0.5F, kOneMinusEpsilon};
    TestRandom random(31);
    const auto pick = [&](const auto& list) { return list[random.bits() % std::size(list)]; };
    for (int i = 0; i < 40000; ++i) {
        SurfaceParameters<float> p;
        p.diffuseColor = Float3(pick(units), pick(units), pick(units));
        p.specularColor = Float3(pick(units), pick(units), pick(units));
        p.useSpecularWorkflow = random.bits() % 2 == 0;
        p.metallic = pick(units);
        p.roughness = pick(units);
        p.clearcoat = pick(units);
        p.clearcoatRoughness = pick(units);
        p.opacity = pick(units);
        p.ior = pick(iors);
        const bool entering = random.bits() % 2 == 0;
        const Bsdf<float> bsdf(p, entering);
        const Float3 wo = pick(directions);
        const BsdfSample<float> s = bsdf.sample(wo, pick(numbers), {pick(numbers), pick(numbers)});
        INFO("ior ", p.ior, ", roughness ", p.roughness, ", metallic ", p.metallic, ", opacity ",
             p.opacity, ", clearcoat ", p.clearcoat, " ", p.clearcoatRoughness, ", specular ",
             p.useSpecularWorkflow, ", entering ", entering, ", wo.z ", wo.z);
        REQUIRE(isFinite(s.wi));
        REQUIRE(isFinite(s.weight));
        REQUIRE(std::isfinite(s.pdf));
        REQUIRE(s.pdf >= 0.0F);
        CHECK(maxComponent(s.weight) < 1e5F);
        Float3 wi = pick(directions);
        wi.z = random.bits() % 2 == 0 ? wi.z : -wi.z;
        for (const Float3& other : {wi, wo, -wo, Float3(-wo.x, -wo.y, wo.z)}) {
            const BsdfValue<float> value = bsdf.evaluate(wo, other);
            REQUIRE(isFinite(value.total()));
            REQUIRE(std::isfinite(value.pdf));
            REQUIRE(std::min({value.total().x, value.total().y, value.total().z, value.pdf}) >=
                    0.0F);
        }
        CHECK(maxComponent(bsdf.albedo()) <= 1.0F);
    }
}

TEST_CASE("black surfaces absorb, and directions below the surface see nothing") {
    SurfaceParameters<float> p;
    p.diffuseColor = Float3(0.0F);
    p.metallic = 1.0F;
    const Bsdf<float> black(p, true);
    const Float3 wo = direction(0.6, 0.0);
    CHECK(isBlack(black.sample(wo, 0.3F, {0.4F, 0.5F}).weight));
    CHECK(isBlack(black.evaluate(wo, direction(0.5, 2.0)).total()));

    const Bsdf<float> grey(SurfaceParameters<float>{}, true);
    CHECK(isBlack(grey.evaluate(wo, -direction(0.5, 2.0)).total()));
    CHECK(grey.evaluate(wo, -direction(0.5, 2.0)).pdf == 0.0F);
    CHECK(isBlack(grey.evaluate(-wo, direction(0.5, 2.0)).total()));
}

} // namespace mbfeat::test
