#include "shading/environmentMap.h"

#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

std::shared_ptr<const Image> image(int width, int height, int channels, std::vector<float> values) {
    auto result = makeImage(width, height, channels, std::move(values));
    REQUIRE(static_cast<bool>(result));
    return result.value();
}

std::shared_ptr<const Image> noise(int width, int height) {
    TestRandom random(5);
    std::vector<float> values(static_cast<std::size_t>(width) * height * 3);
    for (float& v : values) {
        const float x = random.nextFloat();
        v = x * x * x;
    }
    values[7 % values.size()] = 8.0F;
    return image(width, height, 3, std::move(values));
}

} // namespace

TEST_CASE("latitude-longitude images are oriented as OpenEXR and UsdLux say") {
    const auto near = [](const Float3& d, float s, float t) {
        const Float2 st = latLongFromDirection(d);
        return isNear(st.x, s, 0.0, 1e-6) && isNear(st.y, t, 0.0, 1e-6);
    };
    CHECK(near({0.0F, 0.0F, 1.0F}, 0.5F, 0.5F));
    CHECK(near({1.0F, 0.0F, 0.0F}, 0.25F, 0.5F));
    CHECK(near({-1.0F, 0.0F, 0.0F}, 0.75F, 0.5F));
    CHECK(isNear(latLongFromDirection({0.0F, 1.0F, 0.0F}).y, 1.0, 1e-6));
    CHECK(isNear(latLongFromDirection({0.0F, -1.0F, 0.0F}).y, 0.0, 0.0, 1e-6));
}

TEST_CASE("an environment shows the texel of the direction") {
    // One bright texel in the upper left quarter: longitudes 90 to 180 degrees, so +x and -z.
    std::vector<float> values(8 * 4, 0.0F);
    values[2 * 8 + 1] = 5.0F;
    const EnvironmentMap map(image(8, 4, 1, values));
    const float latitude = kPi / 8.0F, longitude = kPi * (1.0F - 2.0F * 1.5F / 8.0F);
    const Float3 d{std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                   std::cos(longitude) * std::cos(latitude)};
    CHECK(d.x > 0.0F);
    CHECK(d.z < 0.0F);
    CHECK(isNear(map.value(d).y, 5.0, 1e-4));
    CHECK(map.value(-d).y == 0.0F);
}

TEST_CASE("environment samples follow the pdf, poles included") {
    const Float3 up{0.0F, 1.0F, 0.0F};
    for (const auto& size : {std::pair<int, int>{16, 8}, {7, 5}, {1, 1}, {64, 33}}) {
        const EnvironmentMap map(noise(size.first, size.second));
        INFO("image of " << size.first << " x " << size.second);
        checkPassed(chiSquaredSphere(
            [&](TestRandom& random) {
                const EnvironmentMap::Sample s = map.sample(random.nextFloat2());
                REQUIRE(std::abs(length(s.direction) - 1.0F) < 1e-6F);
                return std::optional<Float3>(s.direction);
            },
            [&](const Float3& d) { return map.pdf(d); }, up, 32, 32, 400000));
        // Right at the pole, where rows of texels shrink to nothing.
        checkPassed(chiSquaredCap(
            [&](TestRandom& random) {
                return std::optional<Float3>(map.sample(random.nextFloat2()).direction);
            },
            [&](const Float3& d) { return map.pdf(d); }, up, 0.99, 8, 8, 400000));
        CHECK(isNear(integrateSphere([&](const Float3& d) { return map.pdf(d); }, up, 1e-4, 96),
                     1.0, 2e-3));
    }
}

TEST_CASE("the sampled pdf is the pdf of the direction") {
    const EnvironmentMap map(noise(64, 32));
    TestRandom random(9);
    int different = 0;
    for (int i = 0; i < 20000; ++i) {
        const EnvironmentMap::Sample s = map.sample(random.nextFloat2());
        REQUIRE(s.pdf > 0.0F);
        // A direction may round into the next cell.
        different += isNear(map.pdf(s.direction), s.pdf, 1e-5) ? 0 : 1;
    }
    CHECK(different < 60);
}

TEST_CASE("a weighted sample of an environment gives its mean") {
    for (const auto& size : {std::pair<int, int>{16, 8}, {64, 32}}) {
        const EnvironmentMap map(noise(size.first, size.second));
        TestRandom random(13);
        Statistics statistics;
        for (int i = 0; i < 200000; ++i) {
            const EnvironmentMap::Sample s = map.sample(random.nextFloat2());
            const Rgb c = map.value(s.direction);
            statistics.add((c.x + c.y + c.z) / 3.0 / s.pdf);
        }
        const double truth = integrateSphere(
            [&](const Float3& d) {
                const Rgb c = map.value(d);
                return (c.x + c.y + c.z) / 3.0;
            },
            {0.0F, 1.0F, 0.0F}, 1e-3, 64);
        checkMean(statistics, truth);
        // mean() treats the image as constant in texels; only the choice of light uses it.
        CHECK(isNear(map.mean() * 4.0 * kPi, truth, 0.05));
        // In place of uniform directions: the density follows the image, so variance is small.
        CHECK(statistics.standardError() * std::sqrt(200000.0) < truth);
    }
}

TEST_CASE("large images are sampled by blocks without losing light") {
    constexpr int kWidth = 2600, kHeight = 1300;
    std::vector<float> values(static_cast<std::size_t>(kWidth) * kHeight, 0.0F);
    values[static_cast<std::size_t>(700) * kWidth + 1234] = 1000.0F;
    const EnvironmentMap map(image(kWidth, kHeight, 1, values));
    TestRandom random(17);
    Statistics statistics;
    for (int i = 0; i < 100000; ++i) {
        const EnvironmentMap::Sample s = map.sample(random.nextFloat2());
        statistics.add(map.value(s.direction).x / s.pdf);
    }
    // The bilinear tent of one texel has the volume of the texel.
    const double latitude = kPi * (700.5 / kHeight - 0.5);
    const double texel = 2.0 * kPi / kWidth * (kPi / kHeight) * std::cos(latitude);
    checkMean(statistics, 1000.0 * texel, 0.02);
}

TEST_CASE("an environment without image is white and uniform") {
    const EnvironmentMap map;
    CHECK(map.value({0.0F, 1.0F, 0.0F}).x == 1.0F);
    CHECK(map.mean() == 1.0);
    checkPassed(chiSquaredSphere(
        [&](TestRandom& random) {
            return std::optional<Float3>(map.sample(random.nextFloat2()).direction);
        },
        [&](const Float3& d) { return map.pdf(d); }));
}
