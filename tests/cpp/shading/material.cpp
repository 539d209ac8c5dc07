// Material evaluation: where inputs come from, how textures are addressed, what is out of range.
#include "shading/material.h"

#include <doctest/doctest.h>

#include <limits>

namespace mbfeat::test {

namespace {

/// A unit square of two triangles with st = (x, y).
Mesh square() {
    Mesh mesh;
    mesh.points = {{0.0F, 0.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 0.0F}, {0.0F, 1.0F, 0.0F}};
    mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
    mesh.triangleFaces = {0, 0};
    mesh.primvars.push_back(
        {"st", {Interpolation::kVertex, 2, {0.0F, 0.0F, 1.0F, 0.0F, 1.0F, 1.0F, 0.0F, 1.0F}}});
    return mesh;
}

/// The point of triangle 0 of square() at texture coordinates (x, y), y <= x.
SurfaceParameters<float> at(const MaterialBinding& binding, float x, float y) {
    return evaluateMaterial(binding, 0, x - y, y);
}

std::shared_ptr<const Image> image(int width, int height, int channels,
                                   const std::vector<float>& values) {
    Result<std::shared_ptr<const Image>> result = makeImage(width, height, channels, values);
    REQUIRE(static_cast<bool>(result));
    return result.value();
}

/// Gives `input` a texture of that image.
TextureNode& addTexture(Material& material, MaterialInput& input,
                        std::shared_ptr<const Image> pixels) {
    input.source = MaterialInput::Source::kTexture;
    input.texture = static_cast<int>(material.textures.size());
    material.textures.emplace_back();
    material.images.push_back(std::move(pixels));
    TextureNode& node = material.textures.back();
    node.wrapS = node.wrapT = Wrap::kRepeat;
    return node;
}

MaterialInput primvarInput(const std::string& name, const Float3& fallback) {
    MaterialInput input(fallback);
    input.source = MaterialInput::Source::kPrimvar;
    input.primvar = name;
    return input;
}

} // namespace

TEST_CASE("attributes are looked up by their interpolation") {
    Mesh mesh = square();
    mesh.triangleFaces = {1, 0};
    const auto value = [&](Interpolation interpolation, int width, std::vector<float> values,
                           std::uint32_t triangle) {
        const Attribute attribute{interpolation, width, std::move(values)};
        return evaluateAttribute(attribute, mesh, triangle, 0.25F, 0.5F);
    };
    const Float4 constant = value(Interpolation::kConstant, 4, {1, 2, 3, 4}, 1);
    CHECK(constant.w == 4.0F);
    const Float4 uniform = value(Interpolation::kUniform, 2, {1, 2, 3, 4}, 0);
    CHECK(uniform.x == 3.0F);
    CHECK(uniform.y == 4.0F);
    CHECK(uniform.z == 0.0F);
    CHECK(uniform.w == 1.0F);
    // Triangle 1 has points 0, 2, 3 with weights 0.25, 0.25, 0.5.
    CHECK(value(Interpolation::kVertex, 1, {4, 100, 8, 16}, 1).x == 11.0F);
    CHECK(value(Interpolation::kFaceVarying, 1, {0, 0, 0, 4, 8, 16}, 1).x == 11.0F);
    const Float4 absent = evaluateAttribute(Attribute(), mesh, 0, 0.3F, 0.3F);
    CHECK(absent.x == 0.0F);
    CHECK(absent.w == 1.0F);
}

TEST_CASE("a material of constants is copied, with every value in range") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    material.diffuseColor = MaterialInput(Float3(2.0F, -1.0F, 0.5F));
    material.emissiveColor = MaterialInput(Float3(-1.0F, 5.0F, 1e30F));
    material.specularColor = MaterialInput(Float3(3.0F));
    material.metallic = MaterialInput(7.0F);
    material.roughness = MaterialInput(-2.0F);
    material.clearcoat = MaterialInput(1.5F);
    material.clearcoatRoughness = MaterialInput(9.0F);
    material.opacity = MaterialInput(-3.0F);
    material.ior = MaterialInput(0.0F);
    material.normal = MaterialInput(Float3(0.0F, 0.0F, 8.0F));
    const MaterialBinding binding = bindMaterial(material, mesh, "/mesh", diagnostics);
    CHECK(binding.isConstant);
    const SurfaceParameters<float> p = evaluateMaterial(binding, 1, 0.2F, 0.2F);
    CHECK(p.diffuseColor == Float3(1.0F, 0.0F, 0.5F));
    CHECK(p.emission.x == 0.0F);
    CHECK(p.emission.y == 5.0F);
    CHECK(p.emission.z < 1e13F);
    CHECK(p.specularColor == Float3(1.0F));
    CHECK(p.metallic == 1.0F);
    CHECK(p.roughness == 0.0F);
    CHECK(p.clearcoat == 1.0F);
    CHECK(p.clearcoatRoughness == 1.0F);
    CHECK(p.opacity == 0.0F);
    CHECK(p.ior > 0.0F);
    CHECK(p.tangentNormal == Float3(0.0F, 0.0F, 1.0F));
    CHECK_FALSE(p.useSpecularWorkflow);
    CHECK(diagnostics.messages().empty());
}

TEST_CASE("values that are not numbers become the specification's defaults") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    Material material;
    for (MaterialInput* input :
         {&material.diffuseColor, &material.emissiveColor, &material.specularColor,
          &material.metallic, &material.roughness, &material.clearcoat,
          &material.clearcoatRoughness, &material.opacity, &material.opacityThreshold,
          &material.ior, &material.normal}) {
        *input = MaterialInput(Float3(nan));
    }
    const SurfaceParameters<float> p =
        evaluateMaterial(bindMaterial(material, mesh, "/mesh", diagnostics), 0, 0.1F, 0.1F);
    const SurfaceParameters<float> defaults;
    CHECK(p.diffuseColor == defaults.diffuseColor);
    CHECK(p.emission == defaults.emission);
    CHECK(p.specularColor == defaults.specularColor);
    CHECK(p.metallic == defaults.metallic);
    CHECK(p.roughness == defaults.roughness);
    CHECK(p.clearcoat == defaults.clearcoat);
    CHECK(p.clearcoatRoughness == defaults.clearcoatRoughness);
    CHECK(p.opacity == defaults.opacity);
    CHECK(p.ior == defaults.ior);
    CHECK(p.tangentNormal == defaults.tangentNormal);
}

TEST_CASE("the default material takes its colour from displayColor") {
    Mesh mesh = square();
    mesh.primvars.push_back({"displayColor", {Interpolation::kConstant, 3, {0.1F, 0.2F, 0.3F}}});
    Diagnostics diagnostics;
    Material material;
    material.diffuseColor = primvarInput("displayColor", Float3(0.18F));
    const MaterialBinding coloured = bindMaterial(material, mesh, "/mesh", diagnostics);
    CHECK(evaluateMaterial(coloured, 0, 0.3F, 0.3F).diffuseColor == Float3(0.1F, 0.2F, 0.3F));

    const Mesh plain = square();
    const MaterialBinding fallback = bindMaterial(material, plain, "/plain", diagnostics);
    CHECK(fallback.isConstant);
    CHECK(evaluateMaterial(fallback, 0, 0.3F, 0.3F).diffuseColor == Float3(0.18F));
    CHECK(diagnostics.messages().empty());
}

TEST_CASE("a primvar of one component is a grey where a colour is asked for") {
    Mesh mesh = square();
    mesh.primvars.push_back({"wear", {Interpolation::kVertex, 1, {0.0F, 1.0F, 1.0F, 0.0F}}});
    Diagnostics diagnostics;
    Material material;
    material.diffuseColor = primvarInput("wear", Float3(0.0F));
    material.roughness = primvarInput("wear", Float3(0.0F));
    const MaterialBinding binding = bindMaterial(material, mesh, "/mesh", diagnostics);
    const SurfaceParameters<float> p = at(binding, 0.75F, 0.25F);
    CHECK(p.diffuseColor.x == doctest::Approx(0.75F));
    CHECK(p.diffuseColor.z == doctest::Approx(0.75F));
    CHECK(p.roughness == doctest::Approx(0.75F));
}

TEST_CASE("texture channels are scaled, biased and shared between inputs") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    TextureNode& node =
        addTexture(material, material.roughness, image(1, 1, 4, {0.2F, 0.4F, 0.6F, 0.8F}));
    node.scale = {2.0F, 0.5F, 1.0F, 0.25F};
    node.bias = {0.1F, 0.2F, -0.1F, 0.0F};
    material.roughness.channel = 1;
    material.metallic = material.roughness;
    material.metallic.channel = 2;
    material.opacity = material.roughness;
    material.opacity.channel = 3;
    material.diffuseColor = material.roughness;
    material.diffuseColor.channel = 0;
    const SurfaceParameters<float> p =
        at(bindMaterial(material, mesh, "/mesh", diagnostics), 0.6F, 0.3F);
    CHECK(p.roughness == doctest::Approx(0.4F));
    CHECK(p.metallic == doctest::Approx(0.5F));
    CHECK(p.opacity == doctest::Approx(0.2F));
    CHECK(p.diffuseColor.x == doctest::Approx(0.5F));
    CHECK(p.diffuseColor.y == doctest::Approx(0.4F));
    CHECK(p.diffuseColor.z == doctest::Approx(0.5F));
    CHECK(diagnostics.messages().empty());
}

TEST_CASE("texture coordinates wrap as authored") {
    Mesh mesh = square();
    // Coordinates run from 0 to 4 across the square.
    for (float& value : mesh.primvars[0].attribute.values) {
        value *= 4.0F;
    }
    Diagnostics diagnostics;
    const auto red = [&](Wrap wrap, float s) {
        Material material;
        TextureNode& node =
            addTexture(material, material.diffuseColor, image(2, 1, 3, {0.25F, 0, 0, 0.75F, 0, 0}));
        node.wrapS = wrap;
        return at(bindMaterial(material, mesh, "/mesh", diagnostics), s / 4.0F, 0.01F)
            .diffuseColor.x;
    };
    // Texel centres are at 0.25 and 0.75 of each period.
    CHECK(red(Wrap::kRepeat, 2.25F) == doctest::Approx(0.25F));
    CHECK(red(Wrap::kRepeat, 2.75F) == doctest::Approx(0.75F));
    CHECK(red(Wrap::kMirror, 1.25F) == doctest::Approx(0.75F));
    CHECK(red(Wrap::kMirror, 1.75F) == doctest::Approx(0.25F));
    CHECK(red(Wrap::kClamp, 3.0F) == doctest::Approx(0.75F));
    CHECK(red(Wrap::kBlack, 3.0F) == 0.0F);
}

TEST_CASE("UsdTransform2d scales, then turns counter-clockwise, then moves") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    // A 4 x 4 image whose red is the column and green the row.
    std::vector<float> values;
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
            values.insert(values.end(),
                          {0.25F * static_cast<float>(x), 0.25F * static_cast<float>(y), 0.0F});
        }
    }
    TextureNode& node = addTexture(material, material.diffuseColor, image(4, 4, 3, values));
    node.stScale = {0.5F, 1.0F};
    node.stRotation = 90.0F;
    node.stTranslation = {0.875F, 0.0F};
    const MaterialBinding binding = bindMaterial(material, mesh, "/mesh", diagnostics);
    // (0.75, 0.25) -> (0.375, 0.25) -> (-0.25, 0.375) -> (0.625, 0.375): column 2, row 1.
    const SurfaceParameters<float> p = at(binding, 0.75F, 0.25F);
    CHECK(p.diffuseColor.x == doctest::Approx(0.5F));
    CHECK(p.diffuseColor.y == doctest::Approx(0.25F));
}

TEST_CASE("an image that could not be read gives the texture's fallback, unscaled") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    TextureNode& node = addTexture(material, material.diffuseColor, nullptr);
    node.fallback = {0.3F, 0.6F, 0.9F, 1.0F};
    node.scale = {5.0F, 5.0F, 5.0F, 5.0F};
    CHECK(at(bindMaterial(material, mesh, "/mesh", diagnostics), 0.6F, 0.3F).diffuseColor ==
          Float3(0.3F, 0.6F, 0.9F));
}

TEST_CASE("missing texture coordinates are reported once, by prim, and read at the fallback") {
    Mesh mesh = square();
    mesh.primvars.clear();
    Diagnostics diagnostics;
    Material material;
    material.path = "/looks/wood";
    TextureNode& node =
        addTexture(material, material.diffuseColor, image(2, 1, 3, {0.25F, 0, 0, 0.75F, 0, 0}));
    node.stFallback = {0.75F, 0.5F};
    addTexture(material, material.roughness, image(1, 1, 1, {0.5F}));
    const MaterialBinding binding = bindMaterial(material, mesh, "/world/table", diagnostics);
    CHECK(at(binding, 0.1F, 0.05F).diffuseColor.x == doctest::Approx(0.75F));
    REQUIRE(diagnostics.messages().size() == 1);
    const Message message = diagnostics.messages().front();
    CHECK(message.severity == Severity::kWarning);
    CHECK(message.subject == "/world/table");
    CHECK(message.text.find("'st'") != std::string::npos);
    CHECK(message.text.find("/looks/wood") != std::string::npos);

    mesh.primvars.push_back({"st", {Interpolation::kVertex, 1, {0, 1, 1, 0}}});
    bindMaterial(material, mesh, "/world/shelf", diagnostics);
    REQUIRE(diagnostics.messages().size() == 2);
    CHECK(diagnostics.messages().back().text.find("one component") != std::string::npos);
}

TEST_CASE("a texture that does not exist leaves the input's constant") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    material.roughness = MaterialInput(0.7F);
    material.roughness.source = MaterialInput::Source::kTexture;
    material.roughness.texture = 5;
    const MaterialBinding binding = bindMaterial(material, mesh, "/mesh", diagnostics);
    CHECK(evaluateMaterial(binding, 0, 0.1F, 0.1F).roughness == 0.7F);
}

TEST_CASE("opacity is refraction, presence or a threshold") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    material.opacity = MaterialInput(0.4F);
    const auto both = [&] {
        const MaterialBinding binding = bindMaterial(material, mesh, "/mesh", diagnostics);
        return std::make_pair(evaluateOpacity(binding, 0, 0.2F, 0.2F),
                              evaluateMaterial(binding, 0, 0.2F, 0.2F).opacity);
    };
    CHECK(both() == std::make_pair(1.0F, 0.4F));
    material.opacityMode = OpacityMode::kPresence;
    CHECK(both() == std::make_pair(0.4F, 1.0F));
    material.opacityThreshold = MaterialInput(0.3F);
    CHECK(both() == std::make_pair(1.0F, 1.0F));
    material.opacityThreshold = MaterialInput(0.5F);
    CHECK(both() == std::make_pair(0.0F, 1.0F));
    material.opacityMode = OpacityMode::kTransparent;
    CHECK(both() == std::make_pair(0.0F, 1.0F));
}

TEST_CASE("textured cut-outs switch from texel to texel") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    addTexture(material, material.opacity, image(2, 1, 1, {0.0F, 1.0F}));
    material.opacityThreshold = MaterialInput(0.5F);
    const MaterialBinding binding = bindMaterial(material, mesh, "/mesh", diagnostics);
    CHECK(evaluateOpacity(binding, 0, 0.25F, 0.0F) == 0.0F);
    CHECK(evaluateOpacity(binding, 0, 0.75F, 0.0F) == 1.0F);
    CHECK(evaluateMaterial(binding, 0, 0.75F, 0.0F).opacity == 1.0F);
}

TEST_CASE("tangents follow the coordinates that the normal map is read at") {
    Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    const auto frame = [&] {
        return tangentFrame(bindMaterial(material, mesh, "/mesh", diagnostics), 1);
    };
    CHECK(length(frame().dpdu - Float3(1.0F, 0.0F, 0.0F)) < 1e-6F);
    CHECK(length(frame().dpdv - Float3(0.0F, 1.0F, 0.0F)) < 1e-6F);

    TextureNode& node = addTexture(material, material.normal, image(1, 1, 3, {0.75F, 0.5F, 1.0F}));
    node.scale = {2.0F, 2.0F, 2.0F, 1.0F};
    node.bias = {-1.0F, -1.0F, -1.0F, 0.0F};
    node.stScale = {2.0F, 1.0F};
    node.stRotation = 90.0F; // u = -y, v = 2 x
    CHECK(length(frame().dpdu - Float3(0.0F, -1.0F, 0.0F)) < 1e-6F);
    CHECK(length(frame().dpdv - Float3(0.5F, 0.0F, 0.0F)) < 1e-6F);

    const Float3 n =
        evaluateMaterial(bindMaterial(material, mesh, "/mesh", diagnostics), 1, 0.2F, 0.2F)
            .tangentNormal;
    CHECK(n.x == doctest::Approx(0.5F / std::sqrt(1.25F)));
    CHECK(length(n) == doctest::Approx(1.0F));
}

TEST_CASE("collapsed coordinates and triangles still have tangents") {
    Mesh mesh = square();
    Diagnostics diagnostics;
    const Material material;
    const auto check = [&](const Float3& normal) {
        const TangentFrame frame =
            tangentFrame(bindMaterial(material, mesh, "/mesh", diagnostics), 0);
        CHECK(isFinite(frame.dpdu));
        CHECK(isFinite(frame.dpdv));
        CHECK(std::abs(dot(frame.dpdu, normal)) < 1e-5F);
        CHECK(length(cross(frame.dpdu, frame.dpdv)) > 0.5F);
    };
    mesh.primvars[0].attribute.values.assign(8, 0.3F);
    check({0.0F, 0.0F, 1.0F});
    mesh.primvars[0].attribute.values = {0, 0, 1, 1, 2, 2, 3, 3};
    check({0.0F, 0.0F, 1.0F});
    mesh.primvars.clear();
    check({0.0F, 0.0F, 1.0F});
    for (Float3& point : mesh.points) {
        point *= 1e-18F;
    }
    check({0.0F, 0.0F, 1.0F});
    mesh.points.assign(4, Float3(1.0F));
    check({0.0F, 0.0F, 1.0F});
}

TEST_CASE("a binding may be moved") {
    const Mesh mesh = square();
    Diagnostics diagnostics;
    Material material;
    addTexture(material, material.normal, image(1, 1, 3, {0.0F, 0.6F, 0.8F}));
    std::vector<MaterialBinding> bindings;
    for (int i = 0; i < 5; ++i) {
        bindings.push_back(bindMaterial(material, mesh, "/mesh", diagnostics));
    }
    for (const MaterialBinding& binding : bindings) {
        CHECK(binding.normalTexture == binding.textures.data());
        CHECK(evaluateMaterial(binding, 0, 0.1F, 0.1F).tangentNormal.y == doctest::Approx(0.6F));
    }
}

} // namespace mbfeat::test
