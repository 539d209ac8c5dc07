// Textures and material inputs on lanes: the same bits as of each point alone.
#include "shading/materialLanes.h"

#include <doctest/doctest.h>

#include <array>
#include <limits>
#include <random>

#include "core/laneQuads.h"

namespace mbfeat::test {

namespace {

using Batch = xsimd::batch<float>;
constexpr int kLanes = LaneTraits<Batch>::kWidth;

bool sameBits(float a, float b) {
    return bitsOf(a) == bitsOf(b) || (std::isnan(a) && std::isnan(b));
}

float lane(const Batch& batch, int i) {
    return LaneBuffer<Batch>(batch)[i];
}

/// Texels of any bits that the storage may hold.
Image randomImage(Image::Storage storage, int width, int height, int channels, std::mt19937& rng) {
    const auto count = static_cast<std::size_t>(width * height * channels);
    std::vector<std::uint8_t> data;
    if (storage == Image::Storage::kFloat) {
        std::uniform_real_distribution<float> value(-2.0F, 5.0F);
        data.resize(count * sizeof(float));
        for (std::size_t i = 0; i < count; ++i) {
            const float texel = value(rng);
            std::memcpy(data.data() + i * sizeof(float), &texel, sizeof(float));
        }
    } else {
        data.resize(count);
        for (std::uint8_t& byte : data) {
            byte = static_cast<std::uint8_t>(rng());
        }
    }
    return {width, height, channels, storage, std::move(data)};
}

/// Inside and outside of the image, on the borders of texels, and what is no number.
float coordinate(std::mt19937& rng, int size) {
    constexpr float kInf = std::numeric_limits<float>::infinity();
    switch (rng() % 8U) {
    case 0:
        return static_cast<float>(static_cast<int>(rng() % 41U) - 20) / static_cast<float>(size);
    case 1: {
        const float special[] = {0.0F, -0.0F, 1.0F, kInf, -kInf, NAN, 1e9F, -1e30F};
        return special[rng() % 8U];
    }
    default:
        return std::uniform_real_distribution<float>(-2.5F, 3.5F)(rng);
    }
}

Mesh someMesh(std::mt19937& rng) {
    constexpr std::size_t kPoints = 9, kTriangles = 7;
    Mesh mesh;
    mesh.points.resize(kPoints);
    for (std::size_t i = 0; i < kTriangles; ++i) {
        const auto corner = [&] { return static_cast<std::uint32_t>(rng() % kPoints); };
        mesh.triangles.push_back({{corner(), corner(), corner()}});
        mesh.triangleFaces.push_back(static_cast<std::uint32_t>(i / 2));
    }
    const auto add = [&](const char* name, Interpolation interpolation, int width,
                         std::size_t count) {
        std::vector<float> values(count * static_cast<std::size_t>(width));
        for (float& value : values) {
            value = std::uniform_real_distribution<float>(-0.5F, 1.5F)(rng);
        }
        mesh.primvars.push_back({name, {interpolation, width, std::move(values)}});
    };
    add("st", Interpolation::kVertex, 2, kPoints);
    add("other", Interpolation::kFaceVarying, 3, 3 * kTriangles);
    add("faces", Interpolation::kUniform, 1, (kTriangles + 1) / 2);
    add("one", Interpolation::kConstant, 4, 1);
    return mesh;
}

MaterialInput fromTexture(Material& material, std::shared_ptr<const Image> image, int channel,
                          const char* primvar) {
    MaterialInput input;
    input.source = MaterialInput::Source::kTexture;
    input.texture = static_cast<int>(material.textures.size());
    input.channel = channel;
    TextureNode& node = material.textures.emplace_back();
    node.uvPrimvar = primvar;
    node.wrapS = Wrap::kRepeat;
    node.wrapT = Wrap::kMirror;
    node.scale = {2.0F, -1.0F, 0.7F, 1.0F};
    node.bias = {-0.5F, 0.25F, 0.0F, 0.1F};
    node.stRotation = 30.0F;
    node.stScale = {1.5F, 0.5F};
    node.stTranslation = {0.1F, -0.7F};
    material.images.push_back(std::move(image));
    return input;
}

MaterialInput fromPrimvar(const char* name) {
    MaterialInput input;
    input.source = MaterialInput::Source::kPrimvar;
    input.primvar = name;
    return input;
}

/// Compares the parameters of random points.
void checkPoints(const MaterialBinding& binding, std::mt19937& rng) {
    REQUIRE(binding.onLanes);
    for (int round = 0; round < 50; ++round) {
        alignas(64) std::int32_t triangles[kLanes];
        LaneBuffer<Batch> b1, b2;
        for (int i = 0; i < kLanes; ++i) {
            triangles[i] = static_cast<std::int32_t>(rng() % binding.mesh->triangles.size());
            b1[i] = std::uniform_real_distribution<float>(0.0F, 1.0F)(rng);
            b2[i] = std::uniform_real_distribution<float>(0.0F, 1.0F - b1[i])(rng);
        }
        SurfaceParameters<Batch> found;
        found.metallic = Batch(binding.constants.metallic);
        const MeshPlaces<Batch> places{loadIntLanes<Batch>(triangles), b1.lanes(), b2.lanes()};
        MaterialLanes<Batch>(binding, places).evaluate(found);
        for (int i = 0; i < kLanes; ++i) {
            const SurfaceParameters<float> expected =
                evaluateMaterial(binding, static_cast<std::uint32_t>(triangles[i]), b1[i], b2[i]);
            for (int c = 0; c < 3; ++c) {
                CHECK(sameBits(lane(found.diffuseColor[c], i), expected.diffuseColor[c]));
                CHECK(sameBits(lane(found.emission[c], i), expected.emission[c]));
                CHECK(sameBits(lane(found.specularColor[c], i), expected.specularColor[c]));
                CHECK(sameBits(lane(found.tangentNormal[c], i), expected.tangentNormal[c]));
            }
            CHECK(sameBits(lane(found.metallic, i), expected.metallic));
            CHECK(sameBits(lane(found.roughness, i), expected.roughness));
            CHECK(sameBits(lane(found.clearcoat, i), expected.clearcoat));
            CHECK(sameBits(lane(found.clearcoatRoughness, i), expected.clearcoatRoughness));
            CHECK(sameBits(lane(found.opacity, i), expected.opacity));
            CHECK(sameBits(lane(found.ior, i), expected.ior));
        }
    }
}

} // namespace

TEST_CASE("textures are the same on lanes") {
    std::mt19937 rng(11);
    for (const auto storage :
         {Image::Storage::kUNorm8, Image::Storage::kSrgb8, Image::Storage::kFloat}) {
        for (int channels = 1; channels <= 4; ++channels) {
            for (const int size : {1, 5, 16}) {
                const Image image = randomImage(storage, size, size + 2, channels, rng);
                REQUIRE(image.hasLanes());
                for (const Wrap s : {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror}) {
                    const Wrap t = static_cast<Wrap>(rng() % 4U);
                    LaneBuffer<Batch> x, y;
                    for (int i = 0; i < kLanes; ++i) {
                        x[i] = coordinate(rng, size);
                        y[i] = coordinate(rng, size + 2);
                    }
                    const Vec2<Batch> st(x.lanes(), y.lanes());
                    const Vec4<Batch> found = sampleTexture(image, st, s, t);
                    for (int i = 0; i < kLanes; ++i) {
                        const Float4 expected = image.sample({x[i], y[i]}, s, t);
                        CAPTURE(x[i]);
                        CAPTURE(y[i]);
                        CHECK(sameBits(lane(found.x, i), expected.x));
                        CHECK(sameBits(lane(found.y, i), expected.y));
                        CHECK(sameBits(lane(found.z, i), expected.z));
                        CHECK(sameBits(lane(found.w, i), expected.w));
                    }
                }
            }
        }
    }
}

TEST_CASE("images that lanes cannot read say so") {
    std::vector<std::uint8_t> data(8);
    CHECK_FALSE(Image(2, 2, 1, Image::Storage::kHalf, data).hasLanes());
    CHECK_FALSE(Image(2, 2, 1, Image::Storage::kUNorm16, data).hasLanes());
    CHECK(Image(2, 2, 2, Image::Storage::kUNorm8, data).bytes() == 8);
}

TEST_CASE("material inputs are the same on lanes") {
    std::mt19937 rng(12);
    const Mesh mesh = someMesh(rng);
    const auto image = [&](Image::Storage storage, int channels) {
        return std::make_shared<const Image>(randomImage(storage, 6, 4, channels, rng));
    };
    Material material;
    material.metallic = MaterialInput(0.3F);
    material.diffuseColor = fromTexture(material, image(Image::Storage::kSrgb8, 3), 0, "st");
    material.roughness = material.diffuseColor; // another channel of the same look-up
    material.roughness.channel = 1;
    material.emissiveColor = fromTexture(material, image(Image::Storage::kFloat, 4), 1, "other");
    material.normal = fromTexture(material, image(Image::Storage::kUNorm8, 3), 0, "st");
    material.clearcoat = fromTexture(material, nullptr, 0, "st");
    material.clearcoatRoughness =
        fromTexture(material, image(Image::Storage::kUNorm8, 1), 0, "missing");
    material.opacity = fromPrimvar("faces");
    material.ior = fromPrimvar("one");
    material.specularColor = fromPrimvar("other");
    Diagnostics diagnostics;
    checkPoints(bindMaterial(material, mesh, "/mesh", diagnostics), rng);
    material.opacityMode = OpacityMode::kPresence;
    CHECK_FALSE(bindMaterial(material, mesh, "/mesh", diagnostics).onLanes);
    material.opacity = MaterialInput(1.0F);
    CHECK(bindMaterial(material, mesh, "/mesh", diagnostics).onLanes);
}

} // namespace mbfeat::test
