// Look-ups of images: wrap modes, bilinear interpolation, storage.
#include "scene/texture.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include <Imath/half.h>

#include "scene/colorManagement.h"

using namespace mbfeat;

namespace {

std::shared_ptr<const Image> image(int width, int height, int channels, std::vector<float> values) {
    auto result = makeImage(width, height, channels, std::move(values));
    REQUIRE(result);
    return result.value();
}

/// 4 x 1 grey texels 0, 1, 2, 3.
std::shared_ptr<const Image> ramp() {
    return image(4, 1, 1, {0, 1, 2, 3});
}

float at(const Image& image, float s, Wrap wrap) {
    return image.sample({s, 0.5F}, wrap, wrap).x;
}

constexpr float kCentre0 = 0.125F; // of the first of four texels

} // namespace

TEST_CASE("texel centres give the texel in every wrap mode") {
    const auto texels = ramp();
    for (const Wrap wrap : {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror}) {
        for (int i = 0; i < 4; ++i) {
            CHECK(at(*texels, kCentre0 + 0.25F * static_cast<float>(i), wrap) ==
                  static_cast<float>(i));
        }
    }
}

TEST_CASE("look-ups between texels are exactly bilinear") {
    // Bottom row 0, 1; top row 10, 21.
    const auto texels = image(2, 2, 1, {0, 1, 10, 21});
    for (float v = 0.0F; v <= 1.0F; v += 0.125F) {
        for (float u = 0.0F; u <= 1.0F; u += 0.125F) {
            const float value =
                texels->sample({0.25F + 0.5F * u, 0.25F + 0.5F * v}, Wrap::kClamp, Wrap::kClamp).x;
            const float expected = (1 - v) * u + v * (10 + 11 * u);
            CHECK(value == doctest::Approx(expected).epsilon(1e-6));
        }
    }
}

TEST_CASE("repeat joins the edges") {
    const auto texels = ramp();
    CHECK(at(*texels, 0.0F, Wrap::kRepeat) == 1.5F);
    CHECK(at(*texels, 1.0F, Wrap::kRepeat) == 1.5F);
    CHECK(at(*texels, kCentre0 + 3.0F, Wrap::kRepeat) == 0.0F);
    CHECK(at(*texels, kCentre0 - 1.0F, Wrap::kRepeat) == 0.0F);
    CHECK(at(*texels, kCentre0 - 0.25F, Wrap::kRepeat) == 3.0F);
    CHECK(at(*texels, -1e-9F, Wrap::kRepeat) == doctest::Approx(1.5F).epsilon(1e-5));
}

TEST_CASE("mirror reflects at every integer") {
    const auto texels = ramp();
    for (int i = 0; i < 4; ++i) {
        const float s = kCentre0 + 0.25F * static_cast<float>(i);
        const auto value = static_cast<float>(i);
        CHECK(at(*texels, -s, Wrap::kMirror) == value);
        CHECK(at(*texels, 2.0F - s, Wrap::kMirror) == value);
        CHECK(at(*texels, 2.0F + s, Wrap::kMirror) == value);
        CHECK(at(*texels, -2.0F - s, Wrap::kMirror) == value);
    }
    CHECK(at(*texels, 1.0F, Wrap::kMirror) == 3.0F);
    CHECK(at(*texels, 0.0F, Wrap::kMirror) == 0.0F);
}

TEST_CASE("clamp extends the edge texels") {
    const auto texels = ramp();
    CHECK(at(*texels, -5.0F, Wrap::kClamp) == 0.0F);
    CHECK(at(*texels, 0.0F, Wrap::kClamp) == 0.0F);
    CHECK(at(*texels, 1.0F, Wrap::kClamp) == 3.0F);
    CHECK(at(*texels, 1e30F, Wrap::kClamp) == 3.0F);
}

TEST_CASE("black is black outside and has no seam inside") {
    const auto texels = image(1, 1, 4, {1, 1, 1, 1});
    for (const float s : {0.0F, 0.5F, 1.0F}) {
        CHECK(at(*texels, s, Wrap::kBlack) == 1.0F);
    }
    for (const float s : {-1e-6F, 1.000001F, 7.0F, -1e30F}) {
        const Float4 value = texels->sample({s, 0.5F}, Wrap::kBlack, Wrap::kRepeat);
        CHECK(value.x == 0.0F);
        CHECK(value.w == 0.0F);
        CHECK(texels->sample({0.5F, s}, Wrap::kRepeat, Wrap::kBlack).w == 0.0F);
    }
}

TEST_CASE("coordinates of any size or kind are safe") {
    const auto texels = ramp();
    const float inf = std::numeric_limits<float>::infinity();
    for (const Wrap wrap : {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror}) {
        for (const float s : {std::numeric_limits<float>::quiet_NaN(), inf, -inf}) {
            CHECK(texels->sample({s, 0.5F}, wrap, wrap).w == 0.0F);
            CHECK(texels->sample({0.5F, s}, wrap, wrap).w == 0.0F);
        }
        for (const float s : {3e38F, -3e38F, 1e-40F, -1e-40F, 16777217.0F, -8388607.5F}) {
            const float value = at(*texels, s, wrap);
            CHECK(value >= 0.0F);
            CHECK(value <= 3.0F);
        }
    }
}

TEST_CASE("fewer channels are filled up") {
    const Float4 grey = image(1, 1, 1, {0.25F})->texel(0, 0);
    CHECK((grey.x == 0.25F && grey.y == 0.25F && grey.z == 0.25F && grey.w == 1.0F));
    const Float4 greyAlpha = image(1, 1, 2, {0.25F, 0.5F})->texel(0, 0);
    CHECK((greyAlpha.z == 0.25F && greyAlpha.w == 0.5F));
    const Float4 rgb = image(1, 1, 3, {1, 2, 3})->texel(0, 0);
    CHECK((rgb.x == 1.0F && rgb.y == 2.0F && rgb.z == 3.0F && rgb.w == 1.0F));
    const Float4 rgba = image(1, 1, 4, {1, 2, 3, 4})->texel(0, 0);
    CHECK(rgba.w == 4.0F);
}

TEST_CASE("eight-bit codes decode exactly, sRGB through its curve and alpha without") {
    for (int code = 0; code < 256; ++code) {
        const auto byte = static_cast<std::uint8_t>(code);
        const double c = code / 255.0;
        const double linear = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
        const Image srgb(1, 1, 4, Image::Storage::kSrgb8, {byte, byte, byte, byte});
        CHECK(srgb.texel(0, 0).x == static_cast<float>(linear));
        CHECK(srgb.texel(0, 0).z == static_cast<float>(linear));
        CHECK(srgb.texel(0, 0).w == static_cast<float>(c));
        const Image raw(1, 1, 1, Image::Storage::kUNorm8, {byte});
        CHECK(raw.texel(0, 0).x == static_cast<float>(c));
    }
}

TEST_CASE("sixteen-bit and half texels decode exactly") {
    for (const int code : {0, 1, 1000, 32768, 65534, 65535}) {
        const auto value = static_cast<std::uint16_t>(code);
        std::vector<std::uint8_t> data(4);
        std::memcpy(data.data(), &value, 2);
        std::memcpy(data.data() + 2, &value, 2);
        const Image raw(1, 1, 2, Image::Storage::kUNorm16, data);
        CHECK(raw.texel(0, 0).x == static_cast<float>(code / 65535.0));
        const Image srgb(1, 1, 2, Image::Storage::kSrgb16, data);
        CHECK(srgb.texel(0, 0).x == static_cast<float>(decodeSrgb(code / 65535.0)));
        CHECK(srgb.texel(0, 0).w == static_cast<float>(code / 65535.0));
    }
    const Imath::half half(0.333F);
    std::vector<std::uint8_t> data(2);
    std::memcpy(data.data(), &half, 2);
    CHECK(Image(1, 1, 1, Image::Storage::kHalf, data).texel(0, 0).x == static_cast<float>(half));
}

TEST_CASE("makeImage refuses what is no image") {
    CHECK_FALSE(makeImage(0, 1, 3, {}));
    CHECK_FALSE(makeImage(1, -1, 3, {}));
    CHECK_FALSE(makeImage(1, 1, 5, {1, 2, 3, 4, 5}));
    CHECK_FALSE(makeImage(2, 1, 1, {1}));
    CHECK_FALSE(makeImage(1, 1, 1, {std::numeric_limits<float>::quiet_NaN()}));
    CHECK(makeImage(1, 1, 1, {1}).value()->bytes() == sizeof(float));
}
