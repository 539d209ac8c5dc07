#include "shading/environmentMap.h"

#include "core/frame.h"
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

/// Of the place (x, y), in texels from the bottom left, of an image of that size.
Float3 directionAt(float x, float y, int width, int height) {
    const float latitude = kPi * (y / static_cast<float>(height) - 0.5F);
    const float longitude = kPi * (1.0F - 2.0F * x / static_cast<float>(width));
    return {std::sin(longitude) * std::cos(latitude), std::sin(latitude),
            std::cos(longitude) * std::cos(latitude)};
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
    CHECK(isNear(latLongFromDirection(Float3(0.0F, 1.0F, 0.0F)).y, 1.0, 1e-6));
    CHECK(isNear(latLongFromDirection(Float3(0.0F, -1.0F, 0.0F)).y, 0.0, 0.0, 1e-6));
}

TEST_CASE("angles are exact to rounding in all eight octants") {
    TestRandom random(3);
    double worst = 0.0, worstSmall = 0.0;
    for (int i = 0; i < 200000; ++i) {
        // From a quarter of a turn down to a billionth of one.
        const float small = std::pow(10.0F, -9.0F * random.nextFloat());
        const float signs[2] = {random.nextFloat() < 0.5F ? -1.0F : 1.0F,
                                random.nextFloat() < 0.5F ? -1.0F : 1.0F};
        const bool steep = random.nextFloat() < 0.5F;
        const float y = signs[0] * (steep ? 1.0F : small), x = signs[1] * (steep ? small : 1.0F);
        const double truth = std::atan2(static_cast<double>(y), static_cast<double>(x)) /
                             (2.0 * 3.14159265358979323846);
        const double error = std::abs(static_cast<double>(angleInTurns(y, x)) - truth);
        worst = std::max(worst, error);
        if (std::abs(truth) < 0.125) {
            worstSmall = std::max(worstSmall, error / std::abs(truth));
        }
    }
    CHECK(worst < 4e-8);
    CHECK(worstSmall < 2.5e-7);
    CHECK(angleInTurns(0.0F, 0.0F) == 0.0F);
    CHECK(angleInTurns(0.0F, -2.0F) == 0.5F);
    CHECK(angleInTurns(3.0F, 0.0F) == 0.25F);
    CHECK(angleInTurns(-3.0F, 3.0F) == -0.125F);
    CHECK(angleInTurns(1e-30F, 1e-30F) == 0.125F);
}

TEST_CASE("environments are the same to the bit on lanes") {
    using Batch = xsimd::batch<float>;
    constexpr int kLanes = LaneTraits<Batch>::kWidth;
    const auto half = [] { // texels that are looked up lane by lane
        std::vector<std::uint8_t> data(static_cast<std::size_t>(20) * 10 * 3 * 2);
        TestRandom random(21);
        for (std::size_t i = 1; i < data.size(); i += 2) {
            data[i] = static_cast<std::uint8_t>(0x30 + 8.0F * random.nextFloat());
        }
        return std::make_shared<Image>(20, 10, 3, Image::Storage::kHalf, std::move(data));
    };
    const std::shared_ptr<const Image> images[] = {
        noise(1, 1), noise(7, 5), noise(64, 33), image(2, 1, 1, {0.0F, 3.0F}), half(), nullptr};
    for (const std::shared_ptr<const Image>& texels : images) {
        CAPTURE(texels ? texels->width() : 0);
        const EnvironmentMap map = texels ? EnvironmentMap(texels) : EnvironmentMap();
        TestRandom random(22);
        for (int i = 0; i < 4000; ++i) {
            LaneBuffer<Batch> ux, uy, both;
            LaneBuffer3<Batch> d, n;
            for (int k = 0; k < kLanes; ++k) {
                // The ends of the range of numbers and the poles among them.
                const int kind = i % 16;
                ux[k] = kind == 0 ? 0.0F : kind == 1 ? kOneMinusEpsilon : random.nextFloat();
                uy[k] = kind == 2 ? 0.0F : kind == 3 ? kOneMinusEpsilon : random.nextFloat();
                d.set(k, kind == 4   ? Float3(0.0F, k % 2 == 0 ? 1.0F : -1.0F, 0.0F)
                         : kind == 5 ? Float3(k % 2 == 0 ? -0.0F : 0.0F, 0.0F, -1.0F)
                                     : uniformSphere(random.nextFloat2()));
                // Normals along the axes, too, and surfaces that are lit from both sides.
                n.set(k, kind == 6   ? Float3(0.0F, k % 2 == 0 ? 1.0F : -1.0F, 0.0F)
                         : kind == 7 ? Float3(k % 2 == 0 ? -0.0F : 0.0F, 0.0F, -1.0F)
                                     : uniformSphere(random.nextFloat2()));
                both[k] = kind % 3 == 0 ? 1.0F : 0.0F;
            }
            const Facing<Batch> to{n.lanes(), both.lanes() > Batch(0.0F)};
            const auto samples = map.sample<Batch>({ux.lanes(), uy.lanes()}, to);
            const auto seen = map.look<Batch>(d.lanes(), to);
            const LaneBuffer3<Batch> direction(samples.direction), value(samples.value);
            const LaneBuffer3<Batch> seenValue(seen.value);
            const LaneBuffer<Batch> pdf(samples.pdf), seenPdf(seen.pdf);
            for (int k = 0; k < kLanes; ++k) {
                const Facing<float> own{n.get(k), both[k] > 0.0F};
                const EnvironmentMap::Sample alone = map.sample({ux[k], uy[k]}, own);
                REQUIRE(direction.get(k) == alone.direction);
                REQUIRE(value.get(k) == alone.value);
                REQUIRE(pdf[k] == alone.pdf);
                REQUIRE(seenValue.get(k) == map.value(d.get(k)));
                REQUIRE(seenPdf[k] == map.pdf(d.get(k), own));
            }
        }
    }
}

TEST_CASE("an environment shows the texel of the direction") {
    // One bright texel in the upper left quarter: longitudes 90 to 180 degrees, so +x and -z.
    std::vector<float> values(8 * 4, 0.0F);
    values[2 * 8 + 1] = 5.0F;
    const EnvironmentMap map(image(8, 4, 1, values));
    const Float3 d = directionAt(1.5F, 2.5F, 8, 4);
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
        // The image is that of the direction, up to the slope of its texels.
        const Rgb seen = map.value(s.direction);
        REQUIRE(isNear(s.value.x, seen.x, 1e-4, 1e-3));
        REQUIRE(isNear(s.value.z, seen.z, 1e-4, 1e-3));
        // A direction may round into the next cell.
        different += isNear(map.pdf(s.direction), s.pdf, 1e-5) ? 0 : 1;
    }
    CHECK(different < 60);
}

namespace {

/// Normals in general directions, along axes, and at the seams of the map of normals.
std::vector<Float3> someNormals() {
    return {normalize(Float3(0.3F, 0.8F, -0.5F)), normalize(Float3(-0.6F, -0.3F, 0.7F)),
            Float3(0.0F, 1.0F, 0.0F), Float3(0.0F, 0.0F, -1.0F),
            normalize(Float3(0.5F, -1e-4F, 0.5F))};
}

} // namespace

TEST_CASE("environment samples for a surface follow the pdf for it") {
    const Float3 up{0.0F, 1.0F, 0.0F};
    const std::shared_ptr<const Image> images[] = {noise(1, 1), noise(7, 5), noise(64, 33),
                                                   nullptr};
    for (const std::shared_ptr<const Image>& texels : images) {
        CAPTURE(texels ? texels->width() : 0);
        const EnvironmentMap map = texels ? EnvironmentMap(texels) : EnvironmentMap();
        for (const Float3& n : someNormals()) {
            CAPTURE(n.x);
            CAPTURE(n.y);
            const Facing<float> to{n, false};
            checkPassed(chiSquaredSphere(
                [&](TestRandom& random) {
                    return std::optional<Float3>(map.sample(random.nextFloat2(), to).direction);
                },
                [&](const Float3& d) { return map.pdf(d, to); }, texels ? up : n, 32, 32, 200000));
        }
    }
}

TEST_CASE("no light that a surface faces has density zero") {
    // Black images but for one texel, at poles, seams and the borders of parts; directions within
    // the texel and normals that see it by a hair, many of them at the borders of cones.
    struct Case {
        int width, height, x, y;
    };
    for (const Case& c : {Case{64, 32, 0, 20},
                          {64, 32, 63, 31},
                          {64, 32, 40, 0},
                          {64, 32, 15, 16},
                          {16, 1, 3, 0},
                          {1, 16, 0, 12},
                          {3, 2, 2, 1},
                          {17, 9, 16, 4},
                          {1, 1, 0, 0},
                          {100, 50, 50, 25},
                          {1000, 500, 437, 300},
                          {1021, 509, 1020, 77}}) {
        CAPTURE(c.width);
        CAPTURE(c.x);
        std::vector<float> values(static_cast<std::size_t>(c.width) * c.height, 0.0F);
        values[static_cast<std::size_t>(c.y) * c.width + c.x] = 1000.0F;
        const EnvironmentMap map(image(c.width, c.height, 1, values));
        TestRandom random(31);
        for (int i = 0; i < 100000; ++i) {
            const float x = static_cast<float>(c.x) + random.nextFloat();
            const float y = static_cast<float>(c.y) + random.nextFloat();
            const Float3 d = directionAt(x, y, c.width, c.height);
            const Float3 side = Frame<float>::fromNormal(d).toWorld(
                {std::cos(6.3F * random.nextFloat()), std::sin(6.3F * random.nextFloat()), 0.0F});
            Float3 n = normalize(side + d * (0.02F * random.nextFloat() + 1e-4F));
            if (i % 4 == 0) { // a border of cones: an octahedral coordinate that is a whole eighth
                const float sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
                n.x = std::round(8.0F * n.x / sum) / 8.0F * sum;
                n = normalize(n);
            }
            if (dot(n, d) > 0.0F && map.value(d).x > 0.0F) {
                REQUIRE(map.pdf(d, {n, false}) > 0.0F);
            }
        }
    }
}

TEST_CASE("images of any size are sampled as finely as they are") {
    // Of one bright texel samples differ by its bilinear tent alone, whatever divides the size.
    for (const auto& size : {std::pair<int, int>{1000, 500}, {600, 300}, {31, 15}, {1440, 720}}) {
        const int width = size.first, height = size.second;
        CAPTURE(width);
        for (const int x : {width / 3, width / 2 + 1}) {
            std::vector<float> values(static_cast<std::size_t>(width) * height, 0.0F);
            values[static_cast<std::size_t>(height / 2) * width + x] = 1.0F;
            const EnvironmentMap map(image(width, height, 1, values));
            TestRandom random(35);
            Statistics statistics;
            for (int i = 0; i < 20000; ++i) {
                const EnvironmentMap::Sample s = map.sample(random.nextFloat2());
                statistics.add(s.value.x / s.pdf);
            }
            const double deviation = statistics.standardError() * std::sqrt(20000.0);
            CHECK(deviation < 1.15 * statistics.mean());
        }
    }
}

TEST_CASE("light samples for a surface do not go to a sun behind it") {
    constexpr int kWidth = 128, kHeight = 64, kSunX = 80, kSunY = 50;
    std::vector<float> values(static_cast<std::size_t>(kWidth) * kHeight, 1.0F);
    values[static_cast<std::size_t>(kSunY) * kWidth + kSunX] = 20000.0F;
    const EnvironmentMap map(image(kWidth, kHeight, 1, values));
    const Float3 sun = directionAt(kSunX + 0.5F, kSunY + 0.5F, kWidth, kHeight);
    const Float3 aside = normalize(cross(sun, Float3(1.0F, 0.0F, 0.0F)));
    for (const Float3& n :
         {-sun, sun, normalize(aside - sun * 0.4F), normalize(aside - sun * 0.1F)}) {
        const Facing<float> to{n, false};
        TestRandom random(33);
        Statistics plain, aimed;
        int towards = 0;
        constexpr int kCount = 100000;
        for (int i = 0; i < kCount; ++i) {
            const Float2 u = random.nextFloat2();
            const auto irradiance = [&](const EnvironmentMap::Sample& s) {
                return s.value.x * std::max(dot(s.direction, n), 0.0F) / s.pdf;
            };
            const EnvironmentMap::Sample s = map.sample(u, to);
            plain.add(irradiance(map.sample(u)));
            aimed.add(irradiance(s));
            towards += dot(s.direction, sun) > 0.99F ? 1 : 0;
        }
        // The sun's bilinear tent has the volume of its texel.
        const double texel =
            2.0 * kPi / kWidth * (kPi / kHeight) * std::cos(kPi * ((kSunY + 0.5) / kHeight - 0.5));
        const double truth = kPi + std::max(dot(n, sun), 0.0F) * 19999.0 * texel;
        checkMean(aimed, truth, 0.01);
        CHECK(aimed.standardError() < plain.standardError());
        if (dot(n, sun) < -0.3F) {
            CHECK(towards == 0);
            CHECK(aimed.standardError() < 0.3 * plain.standardError());
        } else if (dot(n, sun) < 0.0F) { // what shares a part with the sun can be seen
            CHECK(towards < kCount / 4);
        }
    }
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

TEST_CASE("the concentration of an environment tells suns from skies") {
    constexpr int kWidth = 64, kHeight = 32;
    const auto concentration = [](float sun, float upper, float lower) {
        std::vector<float> values;
        for (int i = 0; i < kWidth * kHeight; ++i) {
            values.push_back(i < kWidth * kHeight / 2 ? lower : upper);
        }
        values[24 * kWidth + 10] += sun;
        return EnvironmentMap(image(kWidth, kHeight, 1, values)).concentration();
    };
    CHECK(concentration(0.0F, 1.0F, 1.0F) == 0.0);
    CHECK(concentration(0.0F, 1.0F, 0.0F) < 0.02); // but for the blurred horizon
    CHECK(concentration(1e6F, 1.0F, 1.0F) > 0.97);
    CHECK(concentration(1e6F, 0.0F, 0.0F) > 0.97);
    CHECK(concentration(0.0F, 0.0F, 0.0F) == 0.0);
    // The sun's share of the light, less what scattering finds there.
    const double texel =
        2.0 * kPi / kWidth * (kPi / kHeight) * std::cos(kPi * (24.5 / kHeight - 0.5));
    const double share = 1000.0 * texel / (1000.0 * texel + 4.0 * kPi);
    CHECK(concentration(1000.0F, 1.0F, 1.0F) < share);
    CHECK(concentration(1000.0F, 1.0F, 1.0F) > share - 9.0 * texel / kPi - 0.01);
}

TEST_CASE("an environment without image is white and uniform") {
    const EnvironmentMap map;
    CHECK(map.concentration() == 0.0);
    CHECK(map.value({0.0F, 1.0F, 0.0F}).x == 1.0F);
    CHECK(map.mean() == 1.0);
    checkPassed(chiSquaredSphere(
        [&](TestRandom& random) {
            return std::optional<Float3>(map.sample(random.nextFloat2()).direction);
        },
        [&](const Float3& d) { return map.pdf(d); }));
}
