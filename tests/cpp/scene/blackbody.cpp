#include <doctest/doctest.h>

#include "scene/blackbody.h"

using mbfeat::blackbodyColor;
using mbfeat::Rgb;

TEST_CASE("black-body colours have the published chromaticities") {
    // Chromaticities x, y of the Planckian locus: Wyszecki and Stiles, Color Science, table
    // 1(6.5.1).
    const struct {
        float kelvin, x, y;
    } cases[] = {
        {2000.0F, 0.5267F, 0.4133F}, {4000.0F, 0.3804F, 0.3767F}, {6500.0F, 0.3135F, 0.3236F}};
    for (const auto& c : cases) {
        const Rgb rgb = blackbodyColor(c.kelvin);
        const float x = 0.4124564F * rgb.x + 0.3575761F * rgb.y + 0.1804375F * rgb.z;
        const float y = 0.2126729F * rgb.x + 0.7151522F * rgb.y + 0.0721750F * rgb.z;
        const float z = 0.0193339F * rgb.x + 0.1191920F * rgb.y + 0.9503041F * rgb.z;
        CHECK(x / (x + y + z) == doctest::Approx(c.x).epsilon(0.02));
        CHECK(y / (x + y + z) == doctest::Approx(c.y).epsilon(0.02));
        CHECK(y == doctest::Approx(1.0).epsilon(0.001));
    }
}

TEST_CASE("temperatures out of range are clamped") {
    CHECK(blackbodyColor(-5.0F).x == blackbodyColor(1000.0F).x);
    CHECK(blackbodyColor(1e9F).z == blackbodyColor(10000.0F).z);
    CHECK(blackbodyColor(1000.0F).z >= 0.0F);
}
