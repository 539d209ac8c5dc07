// Fresnel terms against the textbook in long double, and at the edges.
#include <doctest/doctest.h>

#include "shading/fresnel.h"
#include "support/chiSquared.h"

namespace mbfeat::test {

namespace {

/// Born & Wolf, section 1.5, as printed; `eta` is n_t / n_i.
long double textbook(long double c, long double eta) {
    const long double sine2 = (1.0L - c * c) / (eta * eta);
    if (sine2 >= 1.0L) {
        return 1.0L;
    }
    const long double t = std::sqrt(1.0L - sine2);
    const long double s = (c - eta * t) / (c + eta * t);
    const long double p = (eta * c - t) / (eta * c + t);
    return 0.5L * (s * s + p * p);
}

} // namespace

TEST_CASE("dielectric reflectance agrees with the textbook in float") {
    for (const float ior : {0.6F, 0.99F, 1.001F, 1.1F, 1.5F, 2.0F, 10.0F}) {
        for (const bool entering : {true, false}) {
            const auto index = RelativeIndex<float>::make(ior, entering);
            const long double eta =
                entering ? static_cast<long double>(ior) : 1.0L / static_cast<long double>(ior);
            for (int i = 1; i <= 1000; ++i) {
                const float c = static_cast<float>(i) / 1000.0F;
                const auto expected = static_cast<double>(textbook(c, eta));
                // Near the critical angle reflectance is a root of the distance to it, steeper
                // the smaller eta, so that the half ulp in c^2 + k counts; nowhere else.
                const double distance = std::abs(static_cast<double>(index.refractedSquared(c)));
                const double steepness = std::max(1.0, 1.0 / static_cast<double>(index.etaSquared));
                const double tolerance = 2e-6 + 6e-8 * steepness / std::sqrt(distance + 1e-7);
                INFO("ior ", ior, ", entering ", entering, ", cosine ", c);
                CHECK(std::abs(static_cast<double>(fresnelDielectric(index, c)) - expected) <
                      tolerance);
            }
        }
    }
}

TEST_CASE("an index near 1 keeps the relative precision of its reflectance") {
    for (const float ior : {1.0F + 1e-6F, 1.0F + 1e-4F, 1.0F - 1e-5F}) {
        const auto index = RelativeIndex<float>::make(ior, true);
        const double expected =
            sqr((static_cast<double>(ior) - 1.0) / (static_cast<double>(ior) + 1.0));
        CHECK(fresnelDielectric(index, 1.0F) == doctest::Approx(expected).epsilon(1e-5));
    }
    const auto none = RelativeIndex<float>::make(1.0F, true);
    for (const float c : {0.0F, 1e-20F, 1e-3F, 0.5F, 1.0F}) {
        CHECK(fresnelDielectric(none, c) == (c == 0.0F ? 1.0F : 0.0F));
    }
}

TEST_CASE("light is reflected totally at and beyond the critical angle") {
    const auto index = RelativeIndex<float>::make(1.5F, false);
    const float critical = std::sqrt(1.0F - 1.0F / (1.5F * 1.5F));
    CHECK(fresnelDielectric(index, critical * 0.999F) == 1.0F);
    CHECK(fresnelDielectric(index, 0.0F) == 1.0F);
    CHECK(fresnelDielectric(index, critical * 1.01F) < 1.0F);
    CHECK(fresnelDielectric(index, critical * 1.000001F) > 0.95F);
}

TEST_CASE("grazing light is reflected") {
    for (const float ior : {1.1F, 1.5F, 4.0F}) {
        CHECK(fresnelDielectric(RelativeIndex<float>::make(ior, true), 0.0F) ==
              doctest::Approx(1.0F));
    }
    CHECK(fresnelSchlick(Vec3<float>(0.04F), 0.0F).x == doctest::Approx(1.0F));
    CHECK(fresnelSchlick(Vec3<float>(0.04F), 1.0F).x == 0.04F);
}

TEST_CASE("the hemispherical mean is that of the integral, and never above it") {
    for (const double ior : {1.0, 1.001, 1.05, 1.2, 1.33, 1.5, 2.0, 3.0, 8.0, 50.0}) {
        const auto index = RelativeIndex<double>::make(ior, true);
        double integral = 0.0;
        constexpr int kSteps = 20000;
        for (int i = 0; i < kSteps; ++i) {
            const double root = (i + 0.5) / kSteps; // c = root^2: dense where F is steep
            integral += fresnelDielectric(index, root * root) * 4.0 * root * root * root / kSteps;
        }
        INFO("ior ", ior);
        const double fit = fresnelDielectricAverage(ior);
        CHECK(fit <= integral + 1e-6);
        CHECK(fit >= integral * 0.975);
    }
    CHECK(fresnelDielectricAverage(1.0F) == 0.0F);
}

} // namespace mbfeat::test
