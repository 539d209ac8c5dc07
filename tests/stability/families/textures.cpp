// Textures and primvars of NaN, infinity, negative and very large values, and coordinates of any
// size: what shading gets of them.
#include "families.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "core/floatTraps.h"
#include "film/temporaryDirectory.h"
#include "rendering.h"
#include "scene/imageFiles.h"
#include "scene/texture.h"
#include "shading/material.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;
using test::TestScene;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// A file of three equal channels. OpenEXR and the conversions to its types may do what they like.
void writeHard(const std::string& path, const std::vector<float>& grey, Imf::PixelType type) {
    const FloatTrapsMasked foreignCode;
    writeExr(path, Imf::Header(static_cast<int>(grey.size()), 1),
             {{"R", type, grey}, {"G", type, grey}, {"B", type, grey}});
}

/// A file of these values, read as a texture.
std::shared_ptr<const Image> readBack(const std::vector<float>& red, Imf::PixelType type) {
    const TemporaryDirectory folder;
    const std::string path = folder.file("hard.exr");
    writeHard(path, red, type);
    Diagnostics diagnostics;
    TextureCache cache(diagnostics);
    ImageKey key;
    key.path = path;
    key.colorSpace = SourceColorSpace::kRaw;
    std::shared_ptr<const Image> image = cache.get(key, "/M");
    if (!image) {
        throw std::runtime_error("the texture was not read");
    }
    return image;
}

/// Texels that are not finite are zero, all others what the file's type can hold of them.
void checkTexels(Report& report, Imf::PixelType type) {
    const std::vector<float> red = {kNan,     kInf,  -kInf, -1.0F, -65504.0F,
                                    65504.0F, 6e-8F, 0.0F,  -0.0F, 1.0F};
    const std::shared_ptr<const Image> image = readBack(red, type);
    for (std::size_t i = 0; i < red.size(); ++i) {
        const float truth = std::isfinite(red[i]) ? red[i] : 0.0F;
        const float got = image->texel(static_cast<int>(i), 0).x;
        report.error(std::abs(static_cast<double>(got) - static_cast<double>(truth)),
                     [&] { return Text().add("texel", red[i]).add("read", got); });
    }
}

std::shared_ptr<const Image> made(int width, int height, std::vector<float> values) {
    auto image = makeImage(width, height, 1, std::move(values));
    if (!image) {
        throw std::runtime_error(image.error().text);
    }
    return image.value();
}

/// Coordinates of any size: within the range of the texels, and black where they are no numbers.
void checkCoordinates(Report& report, Wrap wrap) {
    const std::shared_ptr<const Image> image = made(3, 2, {1, 2, 3, 4, 5, 6});
    std::vector<float> coordinates = {
        0.0F,  -0.0F, 1.0F,   0.5F,  -1e-30F, 1e-45F,          1e7F,
        -1e7F, 3e38F, -3e38F, 1e20F, 2.0F,    1.0F - 0x1p-24F, -0x1p-24F};
    TestRandom random(101);
    for (int i = 0; i < 40; ++i) {
        coordinates.push_back((random.nextFloat() - 0.5F) *
                              std::ldexp(1.0F, static_cast<int>(random.bits() % 80)));
    }
    for (const float s : coordinates) {
        for (const float t : coordinates) {
            const float v = image->sample({s, t}, wrap, wrap).x;
            const bool inside = v >= 1.0F && v <= 6.0F;
            const bool black = wrap == Wrap::kBlack && v == 0.0F;
            report.require(inside || black,
                           [&] { return Text().add("s", s).add("t", t).add("value", v); });
        }
    }
    for (const float bad : {kNan, kInf, -kInf}) {
        report.error(std::abs(static_cast<double>(image->sample({bad, 0.5F}, wrap, wrap).x)));
        report.error(std::abs(static_cast<double>(image->sample({0.5F, bad}, wrap, wrap).x)));
    }
}

/// Bilinear look-ups between the largest halves, and of opposite signs, against double.
void checkFilter(Report& report) {
    const std::shared_ptr<const Image> image =
        made(2, 2, {65504.0F, -65504.0F, 3e38F * 0.5F, 1e-30F});
    TestRandom random(102);
    for (int i = 0; i < 20000; ++i) {
        const Float2 st = random.nextFloat2();
        const double x = std::clamp(2.0 * static_cast<double>(st.x) - 0.5, 0.0, 1.0);
        const double y = std::clamp(2.0 * static_cast<double>(st.y) - 0.5, 0.0, 1.0);
        const double below = 65504.0 + x * -131008.0;
        const double above = (1.0 - x) * static_cast<double>(3e38F * 0.5F) + x * 1e-30;
        const double truth = (1.0 - y) * below + y * above;
        // Weights are rounded to 6e-8 of a texel.
        const double size =
            std::max(std::abs(below), 65504.0) * (1.0 - y) + y * static_cast<double>(3e38F * 0.5F);
        const auto got = static_cast<double>(image->sample(st, Wrap::kClamp, Wrap::kClamp).x);
        report.error(std::abs(got - truth) / size,
                     [&] { return Text().add("s", st.x).add("t", st.y).add("value", got); });
    }
}

/// A quad with texture coordinates whose material reads one image for every input.
struct Textured {
    std::shared_ptr<Mesh> mesh = test::quadMesh({-9, -9, 0}, {18, 0, 0}, {0, 18, 0});
    Material material = test::constantMaterial("/M", Rgb(0.5F));

    explicit Textured(std::shared_ptr<const Image> image, const Float4& scale, const Float4& bias) {
        mesh->primvars.push_back({"st", {Interpolation::kVertex, 2, {0, 0, 1, 0, 1, 1, 0, 1}}});
        TextureNode node;
        node.scale = scale;
        node.bias = bias;
        material.textures.push_back(node);
        material.images.push_back(std::move(image));
    }
    static MaterialInput input() {
        MaterialInput result;
        result.source = MaterialInput::Source::kTexture;
        result.texture = 0;
        return result;
    }
    void readEverywhere() {
        for (MaterialInput* i :
             {&material.diffuseColor, &material.emissiveColor, &material.specularColor,
              &material.metallic, &material.roughness, &material.clearcoat,
              &material.clearcoatRoughness, &material.opacity, &material.ior, &material.normal}) {
            *i = input();
        }
    }
};

bool within(float v, float lo, float hi) {
    return v >= lo && v <= hi;
}

bool within(const Float3& v, float lo, float hi) {
    return within(v.x, lo, hi) && within(v.y, lo, hi) && within(v.z, lo, hi);
}

/// Whatever a texture says, the inputs are in range and the normal is a unit vector.
void checkInputs(Report& report) {
    const float texels[] = {0.0F, -1.0F, 65504.0F, -65504.0F, 1e-30F, 3e38F, -3e38F, 0.5F};
    const float factors[] = {1.0F, 0.0F, -1.0F, 1e10F, 3e38F, 1e-30F, kInf, kNan};
    for (const float texel : texels) {
        for (const float scale : factors) {
            for (const float bias : factors) {
                Textured textured(made(1, 1, {texel}), Float4(scale, scale, scale, scale),
                                  Float4(bias, bias, bias, bias));
                textured.readEverywhere();
                Diagnostics diagnostics;
                const MaterialBinding binding =
                    bindMaterial(textured.material, *textured.mesh, "/Quad", diagnostics);
                const SurfaceParameters<float> p = evaluateMaterial(binding, 0, 0.25F, 0.25F);
                const bool good = within(p.diffuseColor, 0, 1) && within(p.specularColor, 0, 1) &&
                                  within(p.emission, 0, 1e12F) && within(p.metallic, 0, 1) &&
                                  within(p.roughness, 0, 1) && within(p.clearcoat, 0, 1) &&
                                  within(p.clearcoatRoughness, 0, 1) && within(p.opacity, 0, 1) &&
                                  within(p.ior, 0.01F, 100.0F);
                const auto where = [&] {
                    return Text().add("texel", texel).add("scale", scale).add("bias", bias);
                };
                report.require(good, where);
                report.error(std::abs(length(Double3(p.tangentNormal)) - 1.0), where);
            }
        }
    }
}

/// A primvar of values that are no numbers takes the specification's default.
void checkPrimvar(Report& report) {
    const std::shared_ptr<Mesh> mesh = test::quadMesh({-9, -9, 0}, {18, 0, 0}, {0, 18, 0});
    mesh->primvars.push_back({"bad", {Interpolation::kVertex, 1, {kNan, kInf, -kInf, kNan}}});
    Material material = test::constantMaterial("/M", Rgb(0.5F));
    MaterialInput input;
    input.source = MaterialInput::Source::kPrimvar;
    input.primvar = "bad";
    material.roughness = material.metallic = material.ior = material.diffuseColor = input;
    Diagnostics diagnostics;
    const MaterialBinding binding = bindMaterial(material, *mesh, "/Quad", diagnostics);
    const SurfaceParameters<float> p = evaluateMaterial(binding, 0, 0.25F, 0.25F);
    report.error(std::abs(static_cast<double>(p.roughness) - 0.5));
    report.error(std::abs(static_cast<double>(p.metallic)));
    report.error(std::abs(static_cast<double>(p.ior) - 1.5));
    report.error(std::abs(static_cast<double>(p.diffuseColor.x) - static_cast<double>(0.18F)));
}

/// A floor whose texture is of one value, in a white sky.
Estimate renderTextured(float texel, bool emits) {
    Textured textured(nullptr, Float4(1, 1, 1, 1), Float4(0, 0, 0, 0));
    (emits ? textured.material.emissiveColor : textured.material.diffuseColor) = Textured::input();
    TestScene test;
    const TemporaryDirectory folder;
    const std::string path = folder.file("value.exr");
    writeHard(path, {texel}, Imf::FLOAT);
    textured.material.textures[0].image.path = path;
    textured.material.textures[0].image.colorSpace = SourceColorSpace::kRaw;
    test.add("/Floor", textured.mesh, textured.material);
    test.addSky(Rgb(1.0F));
    return trace(test, test::testCamera({0, 0, 1}, 0.1F), 16, 16, plainOptions(64, 4));
}

void addRendered(Catalogue& catalogue) {
    for (const auto& [name, texel, albedo] :
         {std::tuple("nan", kNan, 0.0), std::tuple("inf", kInf, 0.0),
          std::tuple("negative", -3.0F, 0.0), std::tuple("65504", 65504.0F, 1.0)}) {
        catalogue.push_back({std::string("texture/albedo-") + name,
                             "radiance of a floor of such a texture in a white sky against the "
                             "albedo that it comes to, score",
                             kLargestZ, kReasonZ, [texel = texel, albedo = albedo](Report& report) {
                                 report.error(score(renderTextured(texel, false), albedo));
                             }});
    }
    for (const auto& [name, texel, radiance] :
         {std::tuple("nan", kNan, 0.0), std::tuple("negative", -3.0F, 0.0),
          std::tuple("65504", 65504.0F, 65504.0), std::tuple("1e30", 1e30F, 1e12)}) {
        catalogue.push_back({std::string("texture/emission-") + name,
                             "radiance of a glowing grey floor against what its texture comes to "
                             "and the sky's half, score",
                             kLargestZ, kReasonZ,
                             [texel = texel, radiance = radiance](Report& report) {
                                 report.error(score(renderTextured(texel, true), radiance + 0.5));
                             }});
    }
}

} // namespace

void addTextures(Catalogue& catalogue) {
    catalogue.push_back({"texture/half-texels",
                         "texels of a half-float file of NaN, infinities, negative and extreme "
                         "values, absolute",
                         2e-9,
                         "6e-8 is a denormal half: half of their step is 3e-8, of which it "
                         "is 4e-10 off",
                         [](Report& report) { checkTexels(report, Imf::HALF); }});
    catalogue.push_back({"texture/float-texels", "the same of a float file", 0.0,
                         "floats are kept as they are",
                         [](Report& report) { checkTexels(report, Imf::FLOAT); }});
    for (const auto& [name, wrap] :
         {std::pair("black", Wrap::kBlack), std::pair("clamp", Wrap::kClamp),
          std::pair("repeat", Wrap::kRepeat), std::pair("mirror", Wrap::kMirror)}) {
        catalogue.push_back({std::string("texture/coordinates-") + name,
                             "look-ups at coordinates of any size outside the range of the "
                             "texels; at those that are no numbers against black",
                             0.0, "an interpolation lies between what it interpolates",
                             [wrap = wrap](Report& report) { checkCoordinates(report, wrap); }});
    }
    catalogue.push_back({"texture/filter-of-extremes",
                         "bilinear look-up among 65504, -65504 and 1.5e38 against double, relative "
                         "to the texels",
                         4e-7, "coordinates in texels and three interpolations, each rounded",
                         checkFilter});
    catalogue.push_back({"texture/inputs-in-range",
                         "length of the normal against 1; all inputs in their ranges for any "
                         "texel, scale and bias",
                         2e-7, "a normalisation; the ranges are those of the specification",
                         checkInputs});
    catalogue.push_back({"texture/primvar-not-finite",
                         "inputs by primvars that are no numbers against the defaults", 0.0,
                         "what shading/material.h promises", checkPrimvar});
    addRendered(catalogue);
}

} // namespace mbfeat::stability
