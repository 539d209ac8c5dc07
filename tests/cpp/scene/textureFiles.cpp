// Files through the texture cache: formats, colour spaces, sharing, and damage.
#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfRgbaFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include "film/imageWriter.h"
#include "film/temporaryDirectory.h"
#include "scene/colorManagement.h"
#include "scene/imageFiles.h"
#include "scene/texture.h"

using namespace mbfeat;

namespace {

using Storage = Image::Storage;
constexpr const char* kPrim = "/World/Looks/wood";

ImageKey key(std::string path, SourceColorSpace space = SourceColorSpace::kAuto,
             std::string name = {}) {
    return {std::move(path), space, std::move(name)};
}

/// A folder, a cache and what it reports.
struct Fixture {
    TemporaryDirectory folder;
    Diagnostics diagnostics;
    TextureCache cache{diagnostics};

    std::shared_ptr<const Image> load(const std::string& name,
                                      SourceColorSpace space = SourceColorSpace::kAuto,
                                      const std::string& spaceName = {}) {
        return cache.get(key(folder.file(name), space, spaceName), kPrim);
    }
    std::shared_ptr<const Image> loadPng(const PngFile& png,
                                         SourceColorSpace space = SourceColorSpace::kAuto,
                                         const std::string& spaceName = {}) {
        const std::string name = "image" + std::to_string(count_++) + ".png";
        writeBytes(folder.file(name), png.encode());
        return load(name, space, spaceName);
    }
    /// The one message, which names the prim and the file.
    std::string message(const std::string& name) const {
        REQUIRE(diagnostics.messages().size() == 1);
        const Message m = diagnostics.messages()[0];
        CHECK(m.subject == kPrim);
        CHECK(m.text.find(folder.file(name)) != std::string::npos);
        return m.text;
    }

private:
    int count_ = 0;
};

Imf::Header header(int width, int height) {
    return Imf::Header(width, height);
}

/// A smooth image with edges of 16 x 12 texels in 0..1.
std::vector<float> picture(int width, int height, int channels) {
    std::vector<float> values;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < channels; ++c) {
                values.push_back(c == 0   ? static_cast<float>(x) / static_cast<float>(width)
                                 : c == 1 ? static_cast<float>(y) / static_cast<float>(height)
                                          : 0.5F);
            }
        }
    }
    return values;
}

void checkTexel(const Image& image, int x, int y, float r, float g, float b, float a = 1.0F,
                float tolerance = 0.0F) {
    const Float4 t = image.texel(x, y);
    CHECK(std::abs(t.x - r) <= tolerance);
    CHECK(std::abs(t.y - g) <= tolerance);
    CHECK(std::abs(t.z - b) <= tolerance);
    CHECK(std::abs(t.w - a) <= tolerance);
}

} // namespace

TEST_CASE_FIXTURE(Fixture, "8-bit PNG: bottom row first, sRGB for colours, linear alpha") {
    const auto image = loadPng({1, 2, 4, 8, {255, 0, 128, 64, 10, 20, 30, 255}});
    REQUIRE(image);
    CHECK(image->storage() == Storage::kSrgb8);
    CHECK(image->bytes() == 8);
    const auto linear = [](int code) { return static_cast<float>(decodeSrgb(code / 255.0)); };
    checkTexel(*image, 0, 0, linear(10), linear(20), linear(30));
    checkTexel(*image, 0, 1, 1.0F, 0.0F, linear(128), 64.0F / 255.0F);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "UsdPreviewSurface's automatic colour space") {
    const std::vector<std::uint16_t> values(4, 128);
    const auto storage = [&](int channels, int bits, bool srgb, std::uint32_t gamma) {
        PngFile png{1, 1, channels, bits, values, srgb, gamma};
        png.values.resize(static_cast<std::size_t>(channels));
        return loadPng(png)->storage();
    };
    CHECK(storage(1, 8, false, 0) == Storage::kUNorm8);
    CHECK(storage(2, 8, false, 0) == Storage::kUNorm8);
    CHECK(storage(3, 8, false, 0) == Storage::kSrgb8);
    CHECK(storage(4, 8, false, 0) == Storage::kSrgb8);
    CHECK(storage(3, 16, false, 0) == Storage::kUNorm16);
    CHECK(storage(1, 8, true, 0) == Storage::kSrgb8);
    CHECK(storage(3, 16, true, 0) == Storage::kSrgb16);
    CHECK(storage(3, 16, false, 45455) == Storage::kSrgb16);
    CHECK(storage(3, 8, false, 100000) == Storage::kUNorm8);
}

TEST_CASE_FIXTURE(Fixture, "authored colour spaces win over the automatic one") {
    const PngFile png{1, 1, 3, 8, {128, 64, 32}};
    checkTexel(*loadPng(png, SourceColorSpace::kRaw), 0, 0, 128 / 255.0F, 64 / 255.0F, 32 / 255.0F);
    CHECK(loadPng(png, SourceColorSpace::kNamed, "raw")->storage() == Storage::kUNorm8);
    CHECK(loadPng(png, SourceColorSpace::kNamed, "lin_rec709")->storage() == Storage::kUNorm8);
    CHECK(loadPng(png, SourceColorSpace::kNamed, "srgb_texture")->storage() == Storage::kSrgb8);
    CHECK(loadPng(png, SourceColorSpace::kNamed, "auto")->storage() == Storage::kSrgb8);
    CHECK(loadPng({1, 1, 1, 8, {128}}, SourceColorSpace::kSrgb)->storage() == Storage::kSrgb8);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "16-bit PNG keeps its bits") {
    const auto image = loadPng({2, 1, 1, 16, {1, 65534}});
    REQUIRE(image);
    CHECK(image->bytes() == 4);
    CHECK(image->texel(0, 0).x == 1.0F / 65535.0F);
    CHECK(image->texel(1, 0).x == 65534.0F / 65535.0F);
}

TEST_CASE_FIXTURE(Fixture, "JPEG, TGA, BMP and HDR files of our own writer") {
    const int w = 16;
    const int h = 12;
    const std::vector<float> values = picture(w, h, 3);
    for (const char* name : {"a.jpg", "a.tga", "a.bmp", "a.png", "a.hdr"}) {
        CAPTURE(name);
        REQUIRE_FALSE(writeImageFile(folder.file(name), w, h, 3, values.data()));
        const auto image = load(name, SourceColorSpace::kRaw);
        REQUIRE(image);
        CHECK(image->width() == w);
        CHECK(image->height() == h);
        const float tolerance = std::string(name) == "a.jpg" ? 0.05F : 0.005F;
        checkTexel(*image, 0, h - 1, 0.0F, 0.0F, 0.5F, 1.0F, tolerance);
        checkTexel(*image, 8, 0, 0.5F, 11.0F / 12.0F, 0.5F, 1.0F, tolerance);
    }
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "Radiance files: flat, old and new runs, exposure, orientation") {
    const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n";
    // 0x80 with exponent 129 is 128 * 2^(129 - 136) = 1.
    writeText(folder.file("flat.hdr"),
              head + "\n-Y 2 +X 1\n" + "\x80\x40\x20\x81" + std::string("\x80\x80\x80\x82", 4));
    checkTexel(*load("flat.hdr"), 0, 1, 1.0F, 0.5F, 0.25F);
    checkTexel(*load("flat.hdr"), 0, 0, 2.0F, 2.0F, 2.0F);
    writeText(folder.file("up.hdr"), head + "EXPOSURE=2\n\n+Y 2 -X 2\n" +
                                         std::string("\x80\x80\x80\x81\x01\x01\x01\x01", 8) +
                                         std::string("\x80\x40\x20\x81\x80\x80\x80\x82", 8));
    const auto up = load("up.hdr");
    REQUIRE(up);
    checkTexel(*up, 0, 0, 0.5F, 0.5F, 0.5F);
    checkTexel(*up, 1, 0, 0.5F, 0.5F, 0.5F);
    checkTexel(*up, 1, 1, 0.5F, 0.25F, 0.125F);
    checkTexel(*up, 0, 1, 1.0F, 1.0F, 1.0F);
    const std::string runs = std::string("\x02\x02\x00\x08\x88\x80\x88\x40\x88\x20", 10) +
                             std::string("\x04\x81\x81\x82\x82\x84\x81", 7);
    writeText(folder.file("runs.hdr"), head + "\n-Y 1 +X 8\n" + runs);
    const auto image = load("runs.hdr");
    REQUIRE(image);
    checkTexel(*image, 1, 0, 1.0F, 0.5F, 0.25F);
    checkTexel(*image, 2, 0, 2.0F, 1.0F, 0.5F);
    checkTexel(*image, 7, 0, 1.0F, 0.5F, 0.25F);
    CHECK(image->storage() == Storage::kHalf);
    // Brighter than halves can be.
    writeText(folder.file("sun.hdr"), head + "\n-Y 1 +X 1\n" + "\x80\x80\x80\x9c");
    CHECK(load("sun.hdr")->storage() == Storage::kFloat);
    CHECK(load("sun.hdr")->texel(0, 0).x == 134217728.0F);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "EXR: every pixel type, scanlines and tiles") {
    const int w = 37;
    const int h = 21;
    std::vector<float> red;
    for (int i = 0; i < w * h; ++i) {
        red.push_back(static_cast<float>(i));
    }
    for (const bool tiled : {false, true}) {
        for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT, Imf::UINT}) {
            CAPTURE(tiled);
            CAPTURE(static_cast<int>(type));
            Imf::Header head = header(w, h);
            if (tiled) {
                head.setTileDescription(Imf::TileDescription(8, 8));
            }
            const std::vector<float> zero(red.size(), 0.0F);
            const std::string name = "t" + std::to_string(tiled) + std::to_string(type) + ".exr";
            writeExr(folder.file(name), head,
                     {{"R", type, red}, {"G", type, zero}, {"B", type, red}});
            const auto image = load(name);
            REQUIRE(image);
            CHECK(image->channels() == 3);
            CHECK(image->storage() == (type == Imf::HALF ? Storage::kHalf : Storage::kFloat));
            checkTexel(*image, 5, h - 1, 5.0F, 0.0F, 5.0F);
            checkTexel(*image, w - 1, 0, 776.0F, 0.0F, 776.0F);
        }
    }
}

TEST_CASE_FIXTURE(Fixture, "EXR: subsets of channels and layers") {
    const std::vector<float> one = {1.0F};
    const std::vector<float> two = {2.0F};
    const std::vector<float> half = {0.5F};
    const auto write = [&](const char* name, const std::vector<ExrChannel>& channels) {
        writeExr(folder.file(name), header(1, 1), channels);
        return load(name);
    };
    checkTexel(*write("y.exr", {{"Y", Imf::HALF, two}}), 0, 0, 2, 2, 2);
    checkTexel(*write("ya.exr", {{"Y", Imf::HALF, two}, {"A", Imf::HALF, half}}), 0, 0, 2, 2, 2,
               0.5F);
    checkTexel(*write("a.exr", {{"A", Imf::FLOAT, half}}), 0, 0, 0.5F, 0.5F, 0.5F);
    checkTexel(*write("r.exr", {{"R", Imf::FLOAT, two}}), 0, 0, 2, 2, 2);
    checkTexel(*write("rg.exr", {{"R", Imf::FLOAT, two}, {"G", Imf::HALF, one}}), 0, 0, 2, 1, 0);
    checkTexel(*write("rgba.exr", {{"R", Imf::HALF, one},
                                   {"G", Imf::HALF, two},
                                   {"B", Imf::HALF, half},
                                   {"A", Imf::HALF, half},
                                   {"diffuse.R", Imf::HALF, half}}),
               0, 0, 1, 2, 0.5F, 0.5F);
    CHECK(diagnostics.messages().empty());
    checkTexel(*write("layers.exr", {{"alayer.Z", Imf::FLOAT, half},
                                     {"blayer.R", Imf::FLOAT, half},
                                     {"blayer.G", Imf::FLOAT, half},
                                     {"blayer.B", Imf::FLOAT, half},
                                     {"x.Combined.R", Imf::FLOAT, one},
                                     {"x.Combined.G", Imf::FLOAT, two},
                                     {"x.Combined.B", Imf::FLOAT, half}}),
               0, 0, 1, 2, 0.5F);
    CHECK(message("layers.exr").find("its layer 'x.Combined' is used") != std::string::npos);
    CHECK(diagnostics.messages()[0].severity == Severity::kInfo);
    diagnostics.clear();
    checkTexel(*write("z.exr", {{"Z", Imf::FLOAT, two}}), 0, 0, 2, 2, 2);
    CHECK(message("z.exr").find("'Z' is used as a grey image") != std::string::npos);
}

TEST_CASE_FIXTURE(Fixture, "EXR: data windows are placed in the display window") {
    // Data window 2 x 2 at (1, 1) of a 4 x 3 display; rows count from the top.
    const Imath::Box2i display({0, 0}, {3, 2});
    const std::vector<float> four = {1, 2, 3, 4};
    writeExr(folder.file("inside.exr"), Imf::Header(display, Imath::Box2i({1, 1}, {2, 2})),
             {{"Y", Imf::FLOAT, four}});
    const auto inside = load("inside.exr");
    REQUIRE(inside);
    CHECK(inside->width() == 4);
    CHECK(inside->height() == 3);
    checkTexel(*inside, 1, 1, 1, 1, 1);
    checkTexel(*inside, 2, 1, 2, 2, 2);
    checkTexel(*inside, 1, 0, 3, 3, 3);
    checkTexel(*inside, 0, 0, 0, 0, 0);
    checkTexel(*inside, 1, 2, 0, 0, 0);
    // Overscan is cut off; windows may start anywhere.
    std::vector<float> nine = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    writeExr(folder.file("over.exr"),
             Imf::Header(Imath::Box2i({-5, 10}, {-5, 11}), Imath::Box2i({-6, 9}, {-4, 11})),
             {{"Y", Imf::HALF, nine}});
    const auto over = load("over.exr");
    REQUIRE(over);
    CHECK(over->width() == 1);
    CHECK(over->height() == 2);
    checkTexel(*over, 0, 1, 5, 5, 5);
    checkTexel(*over, 0, 0, 8, 8, 8);
    writeExr(folder.file("apart.exr"), Imf::Header(display, Imath::Box2i({10, 10}, {11, 11})),
             {{"Y", Imf::FLOAT, four}});
    checkTexel(*load("apart.exr"), 3, 2, 0, 0, 0);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "EXR: the first part of a multi-part file, luminance and chroma") {
    std::vector<Imf::Header> headers;
    for (const char* name : {"first", "second"}) {
        Imf::Header head = header(1, 1);
        head.setName(name);
        head.setType(Imf::SCANLINEIMAGE);
        head.channels().insert("Y", Imf::Channel(Imf::FLOAT));
        headers.push_back(head);
    }
    {
        Imf::MultiPartOutputFile file(folder.file("parts.exr").c_str(), headers.data(), 2);
        for (int part = 0; part < 2; ++part) {
            auto value = static_cast<float>(part + 1);
            Imf::FrameBuffer frame;
            frame.insert("Y", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&value), 4, 4));
            Imf::OutputPart output(file, part);
            output.setFrameBuffer(frame);
            output.writePixels(1);
        }
    }
    checkTexel(*load("parts.exr"), 0, 0, 1, 1, 1);
    const std::vector<Imf::Rgba> colors(64, Imf::Rgba(0.5F, 0.25F, 0.75F));
    {
        Imf::RgbaOutputFile file(folder.file("yc.exr").c_str(), 8, 8, Imf::WRITE_YC);
        file.setFrameBuffer(colors.data(), 1, 8);
        file.writePixels(8);
    }
    const auto image = load("yc.exr");
    REQUIRE(image);
    checkTexel(*image, 3, 3, 0.5F, 0.25F, 0.75F, 1.0F, 0.01F);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "texels that are not finite become zero, with their number") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
        diagnostics.clear();
        const std::string name = "nan" + std::to_string(type) + ".exr";
        writeExr(folder.file(name), header(4, 1),
                 {{"R", type, {nan, 1, inf, 2}},
                  {"G", type, {0, 0, 0, 0}},
                  {"B", type, {0, 0, -inf, 0}}});
        const auto image = load(name);
        REQUIRE(image);
        checkTexel(*image, 0, 0, 0, 0, 0);
        checkTexel(*image, 1, 0, 1, 0, 0);
        checkTexel(*image, 2, 0, 0, 0, 0);
        CHECK(message(name).find("has 3 values that are not finite") != std::string::npos);
    }
}

TEST_CASE_FIXTURE(Fixture, "named spaces and file metadata are taken to the rendering space") {
    const std::vector<ExrChannel> red = {
        {"R", Imf::HALF, {1}}, {"G", Imf::HALF, {0}}, {"B", Imf::HALF, {0}}};
    const float expected[] = {1.70505F, -0.130256F, -0.0240034F};
    writeExr(folder.file("plain.exr"), header(1, 1), red);
    checkTexel(*load("plain.exr"), 0, 0, 1, 0, 0);
    checkTexel(*load("plain.exr", SourceColorSpace::kNamed, "ACEScg"), 0, 0, expected[0],
               expected[1], expected[2], 1.0F, 1e-3F);
    Imf::Header head = header(1, 1);
    Imf::addChromaticities(head, Imf::Chromaticities({0.713F, 0.293F}, {0.165F, 0.83F},
                                                     {0.128F, 0.044F}, {0.32168F, 0.33767F}));
    writeExr(folder.file("chroma.exr"), head, red);
    checkTexel(*load("chroma.exr"), 0, 0, expected[0], expected[1], expected[2], 1.0F, 1e-3F);
    checkTexel(*load("chroma.exr", SourceColorSpace::kRaw), 0, 0, 1, 0, 0);
    head = header(1, 1);
    head.insert("colorInteropID", Imf::StringAttribute("lin_ap1_scene"));
    writeExr(folder.file("id.exr"), head, red);
    checkTexel(*load("id.exr"), 0, 0, expected[0], expected[1], expected[2], 1.0F, 1e-3F);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "colour textures are converted to another rendering space, data not") {
    cache.setRenderingColorSpace("ACEScg");
    const PngFile white{1, 1, 4, 8, {255, 255, 255, 128}};
    const PngFile red{1, 1, 3, 8, {255, 0, 0}};
    const auto image = loadPng(white);
    REQUIRE(image);
    CHECK(image->storage() == Storage::kHalf);
    checkTexel(*image, 0, 0, 1, 1, 1, 128 / 255.0F, 2e-3F);
    // Rec.709 red in AP1 (the inverse of the matrix above).
    checkTexel(*loadPng(red), 0, 0, 0.613097F, 0.070194F, 0.020616F, 1.0F, 1e-3F);
    CHECK(loadPng(red, SourceColorSpace::kRaw)->storage() == Storage::kUNorm8);
    checkTexel(*loadPng(red, SourceColorSpace::kNamed, "ACEScg"), 0, 0, 1, 0, 0);
    writeText(folder.file("a.hdr"),
              "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n" + std::string("\x80\0\0\x81", 4));
    checkTexel(*load("a.hdr"), 0, 0, 0.613097F, 0.070194F, 0.020616F, 1.0F, 1e-3F);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "unknown colour spaces are reported, and the values are kept") {
    checkTexel(*loadPng({1, 1, 3, 8, {255, 0, 51}}, SourceColorSpace::kNamed, "Kodak Dream"), 0, 0,
               1.0F, 0.0F, 0.2F);
    CHECK(message("image0.png").find("'Kodak Dream' is not a colour space") != std::string::npos);
}

TEST_CASE_FIXTURE(Fixture, "missing, empty and foreign files give null and one message") {
    writeText(folder.file("empty.png"), "");
    writeText(folder.file("text.png"), "This is not an image, only its name says so.");
    struct Case {
        const char* name;
        const char* text;
    };
    const Case cases[] = {{"missing.png", "No such file"},
                          {"empty.png", "is empty"},
                          {"text.png", "is not a PNG, JPEG"},
                          {"tiles.<UDIM>.png", "UDIM"},
                          {".", "is not a file"}};
    for (const Case& one : cases) {
        diagnostics.clear();
        CHECK(load(one.name) == nullptr);
        CHECK(load(one.name) == nullptr);
        CHECK_MESSAGE(message(one.name).find(one.text) != std::string::npos, message(one.name));
        CHECK(message(one.name).find("fallback value is used") != std::string::npos);
    }
}

TEST_CASE_FIXTURE(Fixture, "files that are cut off or damaged anywhere never crash") {
    const int w = 24;
    const int h = 20;
    const std::vector<float> values = picture(w, h, 3);
    for (const char* name : {"a.jpg", "a.tga", "a.bmp", "a.png", "a.hdr"}) {
        REQUIRE_FALSE(writeImageFile(folder.file(name), w, h, 3, values.data()));
    }
    std::vector<float> channel(static_cast<std::size_t>(w * h));
    for (std::size_t i = 0; i < channel.size(); ++i) {
        channel[i] = std::sin(static_cast<float>(i));
    }
    Imf::Header head = header(w, h);
    writeExr(folder.file("a.exr"), head, {{"R", Imf::HALF, channel}, {"G", Imf::HALF, channel}});
    head.setTileDescription(Imf::TileDescription(8, 8));
    writeExr(folder.file("b.exr"), head, {{"R", Imf::FLOAT, channel}});
    for (const std::string name : {"a.jpg", "a.tga", "a.bmp", "a.png", "a.hdr", "a.exr", "b.exr"}) {
        CAPTURE(name);
        const std::vector<std::uint8_t> bytes = readBytes(folder.file(name));
        // Footers that carry no texels may be missing: PNG's end chunk, TGA's footer.
        const std::size_t needed = bytes.size() - (name == "a.png" ? 12 : name == "a.tga" ? 26 : 0);
        const std::string damaged = "damaged." + name;
        for (std::size_t length = 1; length < needed; length += 1 + length / 24) {
            CAPTURE(length);
            diagnostics.clear();
            cache.clear();
            writeBytes(folder.file(damaged),
                       {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length)});
            CHECK(load(damaged) == nullptr);
            message(damaged);
        }
        for (std::size_t at = 0; at < bytes.size(); at += 1 + at / 32) {
            for (const int value : {0, 255, 127}) {
                std::vector<std::uint8_t> changed = bytes;
                changed[at] = static_cast<std::uint8_t>(value);
                writeBytes(folder.file(damaged), changed);
                cache.clear();
                const auto image = load(damaged);
                if (image) {
                    const Float4 t = image->texel(image->width() - 1, image->height() - 1);
                    CHECK(std::isfinite(t.x + t.y + t.z + t.w));
                }
            }
        }
    }
}

TEST_CASE_FIXTURE(Fixture, "absurd sizes in headers are refused without taking memory") {
    PngFile png{1, 1, 3, 8, {1, 2, 3}};
    png.width = 16000000;
    png.height = 16000000;
    writeBytes(folder.file("a.png"), png.encode());
    CHECK(load("a.png") == nullptr);
    message("a.png");
    diagnostics.clear();
    for (const char* size : {"-Y 2000000000 +X 2000000000", "-Y -4 +X 4", "-Y 0 +X 9",
                             "-Y 1000000 +X 1000000", "-Y 9999999999999 +X 1"}) {
        writeText(folder.file("a.hdr"),
                  std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n") + size + "\n1234");
        cache.clear();
        diagnostics.clear();
        CHECK(load("a.hdr") == nullptr);
        message("a.hdr");
    }
    diagnostics.clear();
    const Imath::Box2i window({0, 0}, {0, 0});
    writeExr(folder.file("a.exr"), Imf::Header(Imath::Box2i({0, 0}, {1000000, 1000000}), window),
             {{"Y", Imf::HALF, {1}}});
    CHECK(load("a.exr") == nullptr);
    CHECK(message("a.exr").find("1000001 x 1000001 texels") != std::string::npos);
    diagnostics.clear();
    writeExr(folder.file("a.exr"),
             Imf::Header(Imath::Box2i({-1000000000, 0}, {1000000000, 0}), window),
             {{"Y", Imf::HALF, {1}}});
    CHECK(load("a.exr") == nullptr);
    CHECK(message("a.exr").find("2000000001 x 1 texels") != std::string::npos);
    diagnostics.clear();
    std::vector<std::uint8_t> tga(18, 0);
    tga[2] = 2;
    tga[12] = tga[13] = tga[14] = tga[15] = 0xff;
    tga[16] = 32;
    writeBytes(folder.file("a.tga"), tga);
    CHECK(load("a.tga") == nullptr);
    message("a.tga");
}

TEST_CASE_FIXTURE(Fixture, "an image is loaded once and kept while somebody holds it") {
    writeBytes(folder.file("a.png"), PngFile{2, 2, 1, 8, {1, 2, 3, 4}}.encode());
    auto first = load("a.png");
    CHECK(first == load("a.png"));
    CHECK(first != load("a.png", SourceColorSpace::kSrgb));
    CHECK(cache.count() == 1);
    CHECK(cache.bytes() == 4);
    first.reset();
    CHECK(cache.count() == 0);
    CHECK(cache.bytes() == 0);
    CHECK(load("a.png") != nullptr);
}

TEST_CASE_FIXTURE(Fixture, "a file that failed is read again once it has changed") {
    CHECK(load("late.png") == nullptr);
    writeBytes(folder.file("late.png"), PngFile{1, 1, 1, 8, {7}}.encode());
    CHECK(load("late.png") != nullptr);
}

TEST_CASE_FIXTURE(Fixture, "threads that ask at once share one image") {
    PngFile png{512, 512, 3, 8, {}};
    png.values.assign(512 * 512 * 3, 9);
    writeBytes(folder.file("a.png"), png.encode());
    std::vector<std::shared_ptr<const Image>> images(8);
    std::vector<std::thread> threads;
    std::atomic<int> failures{0};
    for (std::size_t i = 0; i < images.size(); ++i) {
        threads.emplace_back([&, i] {
            images[i] = load("a.png");
            failures += cache.get(key(folder.file("missing.png")), kPrim) ? 1 : 0;
        });
    }
    for (std::thread& thread : threads) {
        thread.join();
    }
    for (const auto& image : images) {
        CHECK(image == images[0]);
    }
    CHECK(images[0] != nullptr);
    CHECK(failures == 0);
    CHECK(diagnostics.messages().size() == 1);
    CHECK(cache.count() == 1);
}
