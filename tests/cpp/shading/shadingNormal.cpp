#include "shading/shadingNormal.h"

#include <doctest/doctest.h>

#include "shading/bsdfCases.h"
#include "support/chiSquared.h"

namespace mbfeat::test {

namespace {

Float3 randomDirection(TestRandom& random, double cosineMin) {
    return direction(cosineMin + (1.0 - cosineMin) * random.nextDouble(),
                     6.283 * random.nextDouble());
}

} // namespace

TEST_CASE("a shading normal that is already visible is left alone") {
    const Float3 ng(0.0F, 0.0F, 1.0F);
    const Float3 ns = direction(0.95, 1.0);
    CHECK(visibleShadingNormal(ns, ng, direction(0.8, 3.0)) == ns);
    CHECK(visibleShadingNormal(ng, ng, direction(0.01, 3.0)) == ng);
}

TEST_CASE("bent normals see wo, and its mirror direction leaves the surface") {
    TestRandom random(41);
    const Float3 ng(0.0F, 0.0F, 1.0F);
    int bent = 0;
    for (int i = 0; i < 20000; ++i) {
        const Float3 ns = randomDirection(random, -1.0); // any, even from behind
        const Float3 wo = randomDirection(random, i % 2 == 0 ? 0.0 : 0.999 * random.nextDouble());
        if (wo.z < 1e-3F) {
            continue;
        }
        const Float3 n = visibleShadingNormal(ns, ng, wo);
        bent += n == ns ? 0 : 1;
        const Float3 mirrored = n * (2.0F * dot(wo, n)) - wo;
        INFO("ns ", ns.x, " ", ns.y, " ", ns.z, ", wo ", wo.x, " ", wo.y, " ", wo.z);
        REQUIRE(isFinite(n));
        CHECK(std::abs(length(n) - 1.0F) < 1e-5F);
        CHECK(dot(n, wo) > 0.0F);
        CHECK(dot(n, ng) > 0.0F);
        CHECK(mirrored.z > 0.09F * wo.z - 1e-6F);
        // It stays in the plane of ns and ng.
        CHECK(std::abs(dot(cross(ns, ng), n)) < 1e-4F);
    }
    CHECK(bent > 1000);
}

TEST_CASE("normals bent from behind stay visible at grazing views, where the sum cancels") {
    TestRandom random(42);
    for (int i = 0; i < 20000; ++i) {
        const Float3 ng = normalize(randomDirection(random, -1.0));
        const Float3 any = randomDirection(random, -1.0);
        const Float3 flat = normalize(any - ng * dot(any, ng));
        const Float3 wo = normalize(flat + ng * (i % 2 == 0 ? 1e-4F : 1e-5F));
        const Double3 n(visibleShadingNormal(i % 3 == 0 ? -ng : -wo, ng, wo));
        const double seen = dot(Double3(wo), n);
        INFO("ng ", ng.x, " ", ng.y, " ", ng.z, ", wo ", wo.x, " ", wo.y, " ", wo.z);
        REQUIRE(seen > 0.0);
        REQUIRE(dot(n * (2.0 * seen) - Double3(wo), Double3(ng)) > 0.0);
    }
}

TEST_CASE("a grazing or hopeless view falls back to the geometric normal") {
    const Float3 ng(0.0F, 0.0F, 1.0F);
    CHECK(visibleShadingNormal(direction(0.5, 0.0), ng, {1.0F, 0.0F, 0.0F}) == ng);
    CHECK(visibleShadingNormal(-ng, ng, direction(0.5, 0.0)).z > 0.0F);
    const float nan = std::nanf("");
    CHECK(visibleShadingNormal({nan, nan, nan}, ng, direction(0.5, 0.0)) == ng);
}

} // namespace mbfeat::test
