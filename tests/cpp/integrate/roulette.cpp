#include "integrate/kernel/roulette.h"

#include <cmath>

#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

TEST_CASE("roulette compares with the throughput at the first wide scattering") {
    // Past a dark mirror, and scattered by a dark wall: what counts begins there.
    const Rgb dark(0.3F, 0.2F, 0.1F);
    const float scale = rouletteScale<float>(true, dark, 1.0F, 1.0F);
    CHECK(isNear(maxComponent(dark) * scale, 1.0, 1e-6));
    CHECK(survivalProbability<float>(dark, scale) == 0.95F);
    // A second wall takes the light down to a tenth of that.
    const Rgb later = dark * 0.1F;
    CHECK(rouletteScale<float>(false, later, 1.0F, scale) == scale);
    CHECK(isNear(survivalProbability<float>(later, scale), 0.15, 1e-6));
    // Of paths that had scattered nowhere widely the throughput itself counts.
    CHECK(isNear(survivalProbability<float>(later, 1.0F), 1.5 * 0.03, 1e-6));
}

TEST_CASE("roulette keeps no path because its first wide scattering was nearly black") {
    const Rgb black(1e-6F, 1e-7F, 0.0F);
    const float scale = rouletteScale<float>(true, black, 1.0F, 1.0F);
    CHECK(isNear(scale, 10.0, 1e-6));
    CHECK(isNear(survivalProbability<float>(black, scale), 1.5e-5, 1e-6));
    CHECK(survivalProbability<float>(Rgb(0.0F), scale) == 0.0F);
    CHECK(std::isfinite(rouletteScale<float>(true, Rgb(0.0F), 1.0F, 1.0F)));
}

TEST_CASE("roulette treats a branch as the path that it is a part of") {
    // Four branches of what was half: above the tenth, though each is an eighth.
    const float scale = rouletteScale<float>(true, Rgb(0.125F), 0.25F, 4.0F);
    CHECK(isNear(survivalProbability<float>(Rgb(0.125F) * 0.4F, scale), 0.6, 1e-6));
    // And of what was a twentieth: each is as likely to go on as the whole was.
    const float dark = rouletteScale<float>(true, Rgb(0.0125F), 0.25F, 4.0F);
    const float whole = rouletteScale<float>(true, Rgb(0.05F), 1.0F, 1.0F);
    CHECK(isNear(survivalProbability<float>(Rgb(0.0125F), dark),
                 survivalProbability<float>(Rgb(0.05F), whole), 1e-6));
}

TEST_CASE("roulette does not see the radiance that glass concentrates") {
    // In: radiance is divided by the square of the index, which the scale takes back, and out.
    const float eta = 1.5F;
    Rgb carried(0.5F);
    float scale = rouletteScale<float>(true, carried, 1.0F, 1.0F);
    const float before = survivalProbability<float>(carried * 0.4F, scale);
    carried = carried / (eta * eta);
    scale = rouletteScale<float>(false, carried, 1.0F, scale * eta * eta);
    CHECK(isNear(survivalProbability<float>(carried * 0.4F, scale), before, 1e-6));
    carried = carried * (eta * eta);
    scale = rouletteScale<float>(false, carried, 1.0F, scale / (eta * eta));
    CHECK(isNear(survivalProbability<float>(carried * 0.4F, scale), before, 1e-6));
}
