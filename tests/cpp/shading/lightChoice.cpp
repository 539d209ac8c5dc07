#include "shading/lightChoice.h"

#include "shading/lightCases.h"
#include "shading/lightPair.h"
#include "shading/preparedLight.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

/// A light of a random type, place, turn, scale (sheared or mirrored too) and shaping.
Light randomLight(TestRandom& random, bool mayBeInfinite) {
    constexpr LightType kTypes[] = {LightType::kRect,     LightType::kDisk,    LightType::kSphere,
                                    LightType::kCylinder, LightType::kDistant, LightType::kDome};
    Light light;
    light.path = "/light";
    light.type = kTypes[random.bits() % (mayBeInfinite ? 6 : 4)];
    light.radiance = Rgb(0.5F + random.nextFloat());
    const auto axis = [&] {
        return Double3(uniformDirection(random)) * (0.1 + random.nextDouble());
    };
    light.toWorld.x = axis();
    light.toWorld.y = axis();
    light.toWorld.z = axis();
    light.toWorld.t = Double3(uniformPoint(random, 4.0F));
    light.angle = 120.0F * random.nextFloat() * random.nextFloat();
    light.treatAsPoint = random.nextFloat() < 0.3F;
    if (random.nextFloat() < 0.6F) {
        light.shaping.coneAngle = 2.0F + 150.0F * random.nextFloat() * random.nextFloat();
        light.shaping.coneSoftness = random.nextFloat() < 0.5F ? 0.0F : random.nextFloat();
    }
    if (random.nextFloat() < 0.3F) {
        light.shaping.focus = 20.0F * random.nextFloat();
    }
    return light;
}

/// The sampler of one light. It always chooses that one.
LightSampler alone(const Light& light) {
    LightSampler sampler;
    Diagnostics diagnostics;
    sampler.commit({std::make_shared<Light>(light)}, Double3(0.0), 1.0F, {}, diagnostics);
    return sampler;
}

bool lights(const LightSampler& sampler, const LightReceiver& receiver, TestRandom& random) {
    for (int i = 0; i < 16; ++i) {
        if (sampler.sample(receiver, 0.5F, random.nextFloat2()).pdf > 0.0F) {
            return true;
        }
    }
    return false;
}

LightBounds distantLight(const Float3& towards, float degrees, double strength) {
    LightBounds b;
    b.atInfinity = true;
    b.axis = towards;
    b.spread = degrees * kPi / 180.0F;
    b.strength = strength;
    return b;
}

/// Variance of the choice for the estimate of the irradiance from triangles, relative to its
/// square: everything but the place on the triangle.
template <class Probability>
double choiceVariance(const std::vector<EmissiveTriangle>& triangles, const LightReceiver& receiver,
                      const Probability& probability) {
    double sum = 0.0, squares = 0.0;
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        const double e = irradianceFrom(triangles[i], receiver, 1.0F / 3.0F, 1.0F / 3.0F);
        sum += e;
        squares += e > 0.0 ? e * e / probability(i) : 0.0;
    }
    return squares / (sum * sum) - 1.0;
}

} // namespace

TEST_CASE("every light that lights a receiver can be chosen for it") {
    TestRandom random(1);
    int lit = 0, dark = 0;
    for (int scene = 0; scene < 60; ++scene) {
        std::vector<LightBounds> bounds;
        std::vector<LightSampler> samplers;
        while (bounds.size() < 30) {
            const Light light = randomLight(random, scene % 2 == 0);
            Diagnostics diagnostics;
            if (const auto prepared = prepareLight(light, Double3(0.0), diagnostics)) {
                bounds.push_back(boundsOf(*prepared));
                samplers.push_back(alone(light));
            }
        }
        const LightChoice choice(bounds);
        for (int i = 0; i < 100; ++i) {
            const LightReceiver receiver = randomReceiver(4.0F, random);
            checkSum(choice, bounds.size(), receiver);
            for (std::uint32_t k = 0; k < bounds.size(); ++k) {
                const float probability = choice.probability(k, receiver);
                dark += probability == 0.0F ? 1 : 0;
                if (lights(samplers[k], receiver, random)) {
                    ++lit;
                    INFO("light " << k << " of scene " << scene << ", receiver " << i);
                    REQUIRE(probability > 0.0F);
                }
            }
        }
    }
    // The test means something: many lights light, and many are known not to.
    CHECK(lit > 20000);
    CHECK(dark > 20000);
}

TEST_CASE("every triangle that lights a receiver can be chosen for it, near and far") {
    TestRandom random(2);
    for (const float offset : {0.0F, 1000.0F}) {
        auto triangles = scatteredTriangles(400, 10.0F, random);
        for (EmissiveTriangle& t : triangles) {
            for (Float3* p : {&t.p0, &t.p1, &t.p2}) {
                *p = *p + Float3(offset);
            }
        }
        const LightChoice choice(boundsOfAll(triangles));
        for (int i = 0; i < 400; ++i) {
            LightReceiver receiver = randomReceiver(10.0F, random);
            receiver.p = receiver.p + Float3(offset);
            const EmissiveTriangle& near = triangles[i];
            const Float3 middle = (near.p0 + near.p1 + near.p2) / 3.0F;
            if (i % 2 == 0) {
                // Close to one, nearly in its plane and nearly seen edge on.
                receiver.p = middle + (near.p1 - near.p0) * 4.0F + uniformDirection(random) * 1e-3F;
                receiver.n = normalize(cross(near.p1 - near.p0, uniformDirection(random)));
            }
            for (std::uint32_t k = 0; k < triangles.size(); ++k) {
                double most = 0.0;
                for (const Float2 b :
                     {Float2(0.0F, 0.0F), Float2(1.0F, 0.0F), Float2(0.0F, 1.0F)}) {
                    most = std::max(most, irradianceFrom(triangles[k], receiver, b.x, b.y));
                }
                if (most > 0.0) {
                    REQUIRE(choice.probability(k, receiver) > 0.0F);
                }
            }
        }
    }
}

TEST_CASE("lights at infinity and lights in the scene share the samples") {
    TestRandom random(3);
    auto bounds = boundsOfAll(scatteredTriangles(50, 10.0F, random));
    bounds.insert(bounds.begin() + 7, distantLight({0.0F, 0.0F, 1.0F}, 180.0F, 0.2));
    bounds.push_back(distantLight({0.0F, 0.0F, 1.0F}, 0.5F, 0.1));
    const LightChoice choice(bounds);
    for (int i = 0; i < 30; ++i) {
        const LightReceiver receiver = randomReceiver(10.0F, random);
        checkSum(choice, bounds.size(), receiver);
        const float infinite = choice.probability(7, receiver) + choice.probability(51, receiver);
        CHECK(infinite >= 0.0999F);
        CHECK((infinite <= 0.9001F || isNear(static_cast<double>(infinite), 1.0, 1e-6)));
        if (i < 8) {
            checkPassed(pickTest(choice, bounds.size(), receiver, 40000, 300 + i));
        }
    }
    // A single strong lamp next to the receiver, and far from it.
    const LightChoice two(
        {boundsOf(triangleLight({0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, -1.0F}, 0.1F, 100.0F, false)),
         distantLight({0.0F, 0.0F, 1.0F}, 180.0F, 0.1)});
    const Float3 up(0.0F, 0.0F, 1.0F);
    CHECK(two.probability(0, {{0.0F, 0.0F, 0.5F}, up, false}) == doctest::Approx(0.9));
    CHECK(two.probability(0, {{0.0F, 0.0F, -300.0F}, up, false}) == doctest::Approx(0.1));
    // Where the lamp shows its back, the sky has all.
    CHECK(two.probability(0, {{0.0F, 0.0F, 2.0F}, up, false}) == 0.0F);
    CHECK(two.probability(1, {{0.0F, 0.0F, 2.0F}, up, false}) == 1.0F);
    // A lamp without extent, which leaves the tree no size, is no different.
    LightBounds point;
    point.box.add(Float3(0.0F, 0.0F, 1.0F));
    point.spread = kPi;
    point.falloff = 0.5F * kPi;
    point.strength = 1.0;
    const LightChoice bulb({point, distantLight({0.0F, 0.0F, 1.0F}, 180.0F, 0.1)});
    CHECK(bulb.probability(0, {{0.0F, 0.0F, 0.5F}, up, false}) == doctest::Approx(0.9));
    CHECK(bulb.probability(0, {{0.0F, 0.0F, -300.0F}, up, false}) == doctest::Approx(0.1));
}

TEST_CASE("distant lights below the horizon of a receiver are left out") {
    const Float3 up(0.0F, 0.0F, 1.0F);
    const LightChoice choice({distantLight(up, 1.0F, 3.0), distantLight(-up, 0.0F, 3.0),
                              distantLight({1.0F, 0.0F, 0.0F}, 1.0F, 3.0)});
    LightReceiver receiver{Float3(0.0F), up, false};
    CHECK(choice.probability(0, receiver) == 0.5F);
    CHECK(choice.probability(1, receiver) == 0.0F);
    CHECK(choice.probability(2, receiver) == 0.5F); // half of its disc is above
    receiver.twoSided = true;
    CHECK(isNear(static_cast<double>(choice.probability(1, receiver)), 1.0 / 3.0, 1e-6));
    const LightChoice below({distantLight(-up, 0.0F, 3.0), distantLight(-up, 10.0F, 1.0)});
    receiver.twoSided = false;
    CHECK(below.sample(receiver, 0.5F).probability == 0.0F);
    CHECK(sumOfProbabilities(below, 2, receiver) == 0.0);
}

TEST_CASE("many lights at infinity are chosen by strength") {
    std::vector<LightBounds> bounds;
    TestRandom random(4);
    for (int i = 0; i < 100; ++i) {
        bounds.push_back(distantLight(uniformDirection(random), 1.0F, 1.0 + i));
    }
    for (int i = 0; i < 20; ++i) {
        const LightChoice choice(bounds); // with more and more lamps
        const LightReceiver receiver = randomReceiver(1.0F, random);
        CHECK(isNear(sumOfProbabilities(choice, bounds.size(), receiver), 1.0, 1e-5));
        if (i < 4) {
            checkPassed(pickTest(choice, bounds.size(), receiver, 20000, 400 + i));
        }
        bounds.push_back(boundsOf(
            triangleLight(uniformPoint(random, 1.0F), uniformDirection(random), 0.1F, 1.0F, true)));
    }
}

TEST_CASE("a single light is chosen at no cost, and no light is no choice") {
    const LightChoice none;
    CHECK(none.empty());
    CHECK(LightChoice(std::vector<LightBounds>()).empty());
    const LightChoice one(
        {boundsOf(triangleLight(Float3(0.0F), {0.0F, 0.0F, 1.0F}, 1.0F, 1.0F, false))});
    CHECK(one.sample({}, 0.9F).probability == 1.0F);
    CHECK(one.probability(0, {}) == 1.0F);
}

TEST_CASE("between two lights the choice of many receivers is that of each") {
    using Batch = xsimd::batch<float>;
    constexpr int kWidth = LaneTraits<Batch>::kWidth;
    TestRandom random(31);
    Diagnostics diagnostics;
    int pairs = 0, infinite = 0, dark = 0, decidedFar = 0, decidedNear = 0;
    for (int round = 0; round < 600; ++round) {
        LightSampler sampler;
        sampler.commit({std::make_shared<Light>(randomLight(random, false)),
                        std::make_shared<Light>(randomLight(random, true))},
                       Double3(0.0), 1.0F, {}, diagnostics);
        const LightPair* const pair = sampler.pair();
        if (pair == nullptr) {
            continue; // both in the scene, or one cannot light
        }
        ++pairs;
        LaneBuffer3<Batch> p, n;
        LaneBuffer<Batch> u;
        std::uint32_t twoSided = 0;
        for (int i = 0; i < kWidth; ++i) {
            p.set(i, uniformPoint(random, 6.0F));
            n.set(i, uniformDirection(random));
            u[i] = random.nextFloat();
            twoSided |= (random.bits() % 4U == 0 ? 1U : 0U) << static_cast<unsigned>(i);
        }
        // Then with 0, which chooses what is at infinity and tells its share, and with the number
        // of 24 bits next below that, where the bits behind it decide.
        bool isOpen[kWidth] = {};
        for (int pass = 0; pass < 3; ++pass) {
            const LightPairPick<Batch> found =
                pair->pick<Batch>(p.lanes(), n.lanes(), maskOfBits<Batch>(twoSided), u.lanes());
            const std::uint32_t far = laneBits(found.infinite);
            const LaneBuffer<Batch> probability(found.probability);
            for (int i = 0; i < kWidth; ++i) {
                const auto is = [i](std::uint32_t bits) {
                    return ((bits >> static_cast<unsigned>(i)) & 1U) != 0;
                };
                const LightPick expected = sampler.pick({p.get(i), n.get(i), is(twoSided)}, u[i]);
                CHECK(probability[i] == expected.probability);
                if (expected.probability > 0.0F) {
                    CHECK((is(far) ? pair->infiniteEntry : pair->localEntry) == expected.light);
                    infinite += is(far) ? 1 : 0;
                } else {
                    ++dark;
                }
                decidedFar += isOpen[i] && is(far) ? 1 : 0;
                decidedNear += isOpen[i] && !is(far) ? 1 : 0;
                const float share = probability[i];
                u[i] = pass == 0
                           ? 0.0F
                           : std::min(std::floor(share * 0x1p24F) * 0x1p-24F, kOneMinusEpsilon);
                isOpen[i] = pass == 1 && is(far) && u[i] < share && share < 1.0F;
            }
        }
    }
    CHECK(decidedFar > 10);
    CHECK(decidedNear > 10);
    CHECK(pairs > 50);
    CHECK(infinite > 100);
    CHECK(dark > 10);
}

TEST_CASE("many lights together give the sum of what each gives alone") {
    TestRandom random(6);
    std::vector<std::shared_ptr<const Light>> lights;
    for (int i = 0; i < 20; ++i) {
        Light light = randomLight(random, true);
        if (light.type == LightType::kDome) {
            light.toWorld = AffineD(); // sampled evenly, as it is seen
        }
        lights.push_back(std::make_shared<Light>(light));
    }
    const auto triangles = scatteredTriangles(200, 4.0F, random);
    LightSampler all;
    Diagnostics diagnostics;
    all.commit(lights, Double3(0.0), 1.0F, triangles, diagnostics);
    // Shadows left out.
    const auto irradiance = [&](const LightSampler& sampler, const LightReceiver& receiver,
                                int samples) {
        Statistics statistics;
        for (int i = 0; i < samples; ++i) {
            const LightSample s = sampler.sample(receiver, random.nextFloat(), random.nextFloat2());
            statistics.add(s.pdf > 0.0F ? s.radiance.x * std::abs(dot(s.wi, receiver.n)) / s.pdf
                                        : 0.0F);
        }
        return statistics;
    };
    for (int i = 0; i < 6; ++i) {
        LightReceiver receiver = randomReceiver(4.0F, random);
        receiver.twoSided = i % 2 == 0;
        double truth = 0.0, variance = 0.0;
        const auto add = [&](const LightSampler& one, int samples) {
            const Statistics statistics = irradiance(one, receiver, samples);
            truth += statistics.mean();
            variance += statistics.standardError() * statistics.standardError();
        };
        for (const auto& light : lights) {
            add(alone(*light), 30000);
        }
        for (const EmissiveTriangle& triangle : triangles) {
            LightSampler one;
            one.commit({}, Double3(0.0), 1.0F, {triangle}, diagnostics);
            add(one, 1000);
        }
        const Statistics together = irradiance(all, receiver, 300000);
        const double error = std::sqrt(variance + std::pow(together.standardError(), 2.0));
        INFO("together " << together.mean() << ", alone " << truth << " +- " << error);
        // False alarms: 7e-6. A dome of one colour alone has no noise but that of rounding.
        CHECK(std::abs(together.mean() - truth) < 4.5 * error + 1e-6 * truth);
        CHECK(error < 0.01 * truth);
    }
}

// Measured, in squares of the irradiance: panels 7.3 by power and 0.18 by the tree, lamps 15 and
// 0.57; factors of 40 and 27.
TEST_CASE("in a hall with a hundred small lights the choice has a tenth of the variance by power") {
    TestRandom random(5);
    for (const bool lamps : {true, false}) {
        // Panels in the ceiling, or lamps everywhere that face anywhere.
        std::vector<EmissiveTriangle> triangles;
        std::vector<double> power;
        for (int i = 0; i < 100; ++i) {
            const Float3 panel(2.0F * static_cast<float>(i % 10) + 1.0F,
                               0.2F * static_cast<float>(i - i % 10) + 1.0F, 2.9F);
            const Float3 anywhere = uniformPoint(random, 20.0F) * Float3(1.0F, 1.0F, 0.15F);
            const Float3 n = lamps ? uniformDirection(random) : Float3(0.0F, 0.0F, -1.0F);
            triangles.push_back(
                triangleLight(lamps ? anywhere : panel, n, 0.1F, 0.2F + random.nextFloat(), lamps));
            power.push_back(boundsOf(triangles.back()).strength);
        }
        const LightChoice choice(boundsOfAll(triangles));
        const AliasTable byPower(power);
        Statistics tree, table;
        for (int i = 0; i < 500; ++i) {
            LightReceiver receiver;
            receiver.p = uniformPoint(random, 20.0F) * Float3(1.0F, 1.0F, 0.0F);
            receiver.n = {0.0F, 0.0F, 1.0F};
            receiver.twoSided = false;
            tree.add(choiceVariance(triangles, receiver, [&](std::uint32_t k) {
                return choice.probability(k, receiver);
            }));
            table.add(choiceVariance(triangles, receiver,
                                     [&](std::uint32_t k) { return byPower.probability(k); }));
        }
        INFO("by the tree " << tree.mean() << ", by power " << table.mean());
        CHECK(tree.mean() < 0.1 * table.mean());
        CHECK(tree.mean() < 1.0);
    }
}

TEST_CASE("choices that are made together are those of each receiver alone") {
    TestRandom random(33);
    Diagnostics diagnostics;
    std::vector<std::shared_ptr<const Light>> lights;
    for (int i = 0; i < 120; ++i) {
        Light light = randomLight(random, false);
        light.toWorld.t = Double3(uniformPoint(random, 12.0F));
        lights.push_back(std::make_shared<Light>(light));
    }
    for (int withSky = 0; withSky < 2; ++withSky) {
        if (withSky == 1) {
            Light sky;
            sky.path = "/sky";
            sky.type = LightType::kDome;
            lights.push_back(std::make_shared<Light>(sky));
        }
        LightSampler sampler;
        sampler.commit(lights, Double3(0.0), 1.0F, {}, diagnostics);
        int different = 0, sky = 0;
        for (int round = 0; round < 500; ++round) {
            constexpr int kMost = LightChoice::kMostAtOnce;
            const int count = 1 + round % kMost;
            LightReceiver receivers[kMost];
            float u[kMost];
            LightPick together[kMost];
            for (int i = 0; i < count; ++i) {
                receivers[i] = {uniformPoint(random, 14.0F), uniformDirection(random),
                                random.bits() % 4U == 0};
                u[i] = random.nextFloat();
            }
            sampler.pick(receivers, u, count, together);
            for (int i = 0; i < count; ++i) {
                const LightPick alone = sampler.pick(receivers[i], u[i]);
                REQUIRE(together[i].light == alone.light);
                REQUIRE(together[i].triangle == kNoLight);
                REQUIRE(together[i].probability == alone.probability);
                different += alone.light != together[0].light ? 1 : 0;
                sky += alone.light + 1 == lights.size() ? 1 : 0;
                if (alone.probability > 0.0F) {
                    REQUIRE(sampler.choiceProbability(alone.light, receivers[i]) ==
                            alone.probability);
                }
            }
        }
        CHECK(different > 500);
        CHECK((sky > 100) == (withSky == 1));
    }
}
