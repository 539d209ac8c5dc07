#include "shading/lightTree.h"

#include <limits>

#include "shading/lightCases.h"
#include "shading/lightImportance.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

constexpr float kHuge = std::numeric_limits<float>::max();

/// Light equally strong in all directions.
LightBounds roundLight(const Float3& center, double strength, float radius = 0.0F) {
    LightBounds b;
    b.box.add(center - Float3(radius));
    b.box.add(center + Float3(radius));
    b.radius = radius;
    b.spread = kPi;
    b.falloff = 0.5F * kPi;
    b.strength = strength;
    return b;
}

/// Sums, and that samples are what they say they are, from many places.
void checkChoice(const std::vector<LightBounds>& lights, float size, int receivers = 50) {
    const LightChoice choice(lights);
    CHECK(choice.tree().depth() <= LightTree::kMaxDepth);
    TestRandom random(11);
    for (int i = 0; i < receivers; ++i) {
        LightReceiver receiver = randomReceiver(size, random);
        if (i % 4 == 0) {
            receiver.p = lights[i % lights.size()].box.lower; // at a light
        }
        checkSum(choice, lights.size(), receiver);
        for (int j = 0; j < 20; ++j) {
            const LightChoice::Pick pick = choice.sample(receiver, random.nextFloat());
            REQUIRE(pick.entry < lights.size());
            REQUIRE(pick.probability == choice.probability(pick.entry, receiver));
        }
    }
}

} // namespace

TEST_CASE("probabilities of all lights of a tree sum to one at every receiver") {
    TestRandom random(1);
    for (const int count : {1, 2, 3, 7, 8, 9, 17, 64, 65, 300, 3000}) {
        INFO(count << " lights");
        checkChoice(boundsOfAll(scatteredTriangles(count, 10.0F, random)), 10.0F);
    }
}

TEST_CASE("lights are picked as often as their probability says") {
    TestRandom random(2);
    for (const int count : {2, 8, 40, 2000, 30000}) {
        INFO(count << " lights");
        const auto triangles = scatteredTriangles(count, 10.0F, random);
        const LightChoice choice(boundsOfAll(triangles));
        for (int i = 0; i < 5; ++i) {
            const LightReceiver receiver = randomReceiver(10.0F, random);
            checkPassed(pickTest(choice, triangles.size(), receiver, 100000, 100 + i));
        }
    }
}

TEST_CASE("a random number of 24 bits reaches lights of a smaller probability than its steps") {
    // A thousandth of a step: it is found within the last or the first, with that probability.
    std::vector<LightBounds> lights{roundLight({0.0F, 0.0F, 0.0F}, 1.0),
                                    roundLight({1.0F, 0.0F, 0.0F}, 1e-9)};
    const LightChoice choice(lights);
    double expected = 0.0;
    int found = 0;
    for (int i = 0; i < 40000; ++i) {
        const LightReceiver receiver{{0.5F, 10.0F + 1e-4F * static_cast<float>(i), 0.0F}};
        expected += static_cast<double>(choice.probability(1, receiver)) * 0x1p24;
        for (const float u : {0.0F, kOneMinusEpsilon}) {
            found += choice.sample(receiver, u).entry == 1 ? 1 : 0;
        }
    }
    // 4.5 standard deviations: a false alarm in 1e5.
    INFO("found " << found << " times, expected " << expected);
    CHECK(std::abs(found - expected) < 4.5 * std::sqrt(expected));
}

TEST_CASE("the depth of a tree grows with the logarithm of its lights") {
    TestRandom random(4);
    for (const int count : {10, 100, 1000, 10000, 100000}) {
        const LightTree tree(boundsOfAll(scatteredTriangles(count, 10.0F, random)));
        INFO(count << " lights, depth " << tree.depth() << ", nodes " << tree.nodeCount());
        CHECK(tree.depth() <= 2 + std::log2(static_cast<double>(count)) / 2.0);
        CHECK(tree.nodeCount() <= 1 + static_cast<std::size_t>(count) / 3);
    }
    // Each light ten times as far as the one before: every split wants to cut off one.
    std::vector<LightBounds> chain;
    for (int i = 0; i < 20000; ++i) {
        chain.push_back(roundLight({std::pow(10.0F, static_cast<float>(i % 60) - 30.0F), 0.0F,
                                    static_cast<float>(i) * 1e-5F},
                                   std::pow(10.0, i % 60 - 30)));
    }
    CHECK(LightTree(chain).depth() <= LightTree::kMaxDepth);
    checkChoice(chain, 10.0F, 10);
}

TEST_CASE("lights without extent, at one place, on a line or in a plane make a tree") {
    std::vector<LightBounds> lights;
    SUBCASE("at one place") {
        for (int i = 0; i < 500; ++i) {
            lights.push_back(roundLight({1.0F, 2.0F, 3.0F}, 1.0));
        }
    }
    SUBCASE("at the origin") {
        for (int i = 0; i < 20; ++i) {
            lights.push_back(roundLight(Float3(0.0F), 1.0));
        }
    }
    SUBCASE("on a line") {
        for (int i = 0; i < 500; ++i) {
            lights.push_back(roundLight({0.01F * static_cast<float>(i), 2.0F, 3.0F}, 1.0 + i % 7));
        }
    }
    SUBCASE("in a plane, facing both ways") {
        for (int i = 0; i < 500; ++i) {
            const Float3 center(static_cast<float>(i % 20), 4.0F,
                                0.05F * static_cast<float>(i - i % 20));
            const Float3 n(0.0F, i % 3 == 0 ? 1.0F : -1.0F, 0.0F);
            lights.push_back(boundsOf(triangleLight(center, n, 0.1F, 1.0F, false)));
        }
    }
    checkChoice(lights, 5.0F);
}

TEST_CASE("huge ratios of strength and size lose no light") {
    TestRandom random(5);
    std::vector<LightBounds> lights;
    for (int i = 0; i < 300; ++i) {
        const double strength = std::pow(10.0, 60.0 * random.nextDouble() - 30.0);
        const float radius = std::pow(10.0F, 8.0F * random.nextFloat() - 7.0F);
        lights.push_back(roundLight(uniformPoint(random, 1.0F), strength, radius));
    }
    checkChoice(lights, 1.0F);
    // Each of two lights of the greatest ratio is found close to it.
    const LightChoice pair(
        {roundLight({0.0F, 0.0F, 0.0F}, 1e-12), roundLight({1.0F, 0.0F, 0.0F}, 1.0)});
    CHECK(pair.probability(0, {{1e-8F, 0.0F, 0.0F}}) > 0.5F);
    CHECK(pair.probability(1, {{0.5F, 0.0F, 0.0F}}) > 0.5F);
    // The whole at the scales of atoms and of stars.
    for (const float scale : {1e-12F, 1e-6F, 1e6F, 1e12F}) {
        std::vector<LightBounds> scaled;
        for (int i = 0; i < 40; ++i) {
            scaled.push_back(roundLight(uniformPoint(random, scale), 1.0 + i));
        }
        checkChoice(scaled, scale);
        const LightChoice choice(scaled);
        LightReceiver far = randomReceiver(scale, random);
        far.twoSided = true;
        for (const float distance : {1e3F, 1e9F, 1e15F}) {
            far.p = Float3(distance * scale, 0.0F, 0.0F);
            checkSum(choice, scaled.size(), far);
            // From afar all are equally far, so that strength decides.
            CHECK(isNear(static_cast<double>(choice.probability(39, far)), 40.0 / 820.0, 0.01));
        }
    }
}

TEST_CASE("receivers that are not finite get no light and do no harm") {
    TestRandom random(6);
    const auto triangles = scatteredTriangles(100, 10.0F, random);
    const LightChoice choice(boundsOfAll(triangles));
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), kHuge}) {
        for (int axis = 0; axis < 3; ++axis) {
            LightReceiver receiver = randomReceiver(10.0F, random);
            receiver.p[axis] = bad;
            const LightChoice::Pick pick = choice.sample(receiver, 0.7F);
            CHECK(pick.entry < triangles.size());
            CHECK_FALSE(std::isnan(pick.probability));
            receiver = randomReceiver(10.0F, random);
            receiver.n[axis] = bad;
            CHECK(choice.sample(receiver, 0.7F).entry < triangles.size());
        }
    }
}

TEST_CASE("the weights of SIMD lanes are those of the scalar reference, bit for bit") {
    constexpr int kWidth = LaneTraits<ClusterBatch>::kWidth;
    TestRandom random(7);
    int lit = 0, all = 0;
    for (int i = 0; i < 10000; ++i) {
        alignas(64) float columns[11][kWidth], weights[kWidth];
        for (int k = 0; k < kWidth; ++k) {
            const Float3 center = uniformPoint(random, 4.0F), axis = uniformDirection(random);
            const float spread = random.nextFloat() < 0.3F ? 0.0F : kPi * random.nextFloat();
            const float radius = random.nextFloat() * random.nextFloat() + 1e-6F;
            const float falloff = 0.5F * kPi * random.nextFloat();
            const float column[11] = {center.x,
                                      center.y,
                                      center.z,
                                      radius,
                                      axis.x,
                                      axis.y,
                                      axis.z,
                                      std::cos(spread),
                                      std::sin(spread),
                                      std::cos(falloff),
                                      random.nextFloat() - 0.5F};
            for (int c = 0; c < 11; ++c) {
                columns[c][k] = column[c];
            }
        }
        const auto clusters = [&](const auto& load) {
            using T = std::decay_t<decltype(load(0))>;
            return ClusterLanes<T>{{load(0), load(1), load(2)},
                                   load(3),
                                   {load(4), load(5), load(6)},
                                   load(7),
                                   load(8),
                                   load(9),
                                   load(10)};
        };
        const LightReceiver r = randomReceiver(4.0F, random);
        importance(clusters([&](int c) { return ClusterBatch::load_aligned(columns[c]); }), r.p,
                   r.n, r.twoSided, 1e-20F)
            .store_aligned(weights);
        for (int k = 0; k < kWidth; ++k) {
            const float reference = importance(clusters([&](int c) { return columns[c][k]; }), r.p,
                                               r.n, r.twoSided, 1e-20F);
            // Four lanes are those of machines whose multiply-adds are not fused.
            if (kWidth == 8) {
                REQUIRE(reference == weights[k]);
            }
            ++all;
            lit += reference > 0.0F ? 1 : 0;
        }
    }
    CHECK(lit > all / 5);
    CHECK(lit < all * 9 / 10);
}
