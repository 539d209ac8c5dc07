#include "benchScenes.h"

#include <memory>
#include <string>
#include <utility>

namespace mbfeat::test {

namespace {

void addRoom(TestScene& test, const Material& material) {
    test.add("/Floor", quadMesh({-4, -1, 4}, {8, 0, 0}, {0, 0, -8}),
             constantMaterial("/M/Floor", {0.6F, 0.5F, 0.4F}));
    test.add("/Back", quadMesh({-4, -1, -4}, {8, 0, 0}, {0, 4, 0}),
             constantMaterial("/M/Back", {0.7F, 0.7F, 0.7F}));
    test.add("/Ceiling", quadMesh({-4, 3, -4}, {8, 0, 0}, {0, 0, 8}),
             constantMaterial("/M/Back", {0.7F, 0.7F, 0.7F}));
    test.add("/Left", sphereMesh(0.8F, 32, false), material, translation(-1, 0, -2));
    test.add("/Right", sphereMesh(0.8F, 32, false), material, translation(1, 0, -2));
}

/// With one lamp or with a sky besides.
void fillPrebuilt(TestScene& test, const std::string& name) {
    Material material = constantMaterial("/M/A", {0.8F, 0.7F, 0.6F});
    material.ior = MaterialInput(name == "diffuse" ? 1.0F : 1.5F);
    material.roughness = MaterialInput(0.3F);
    if (name == "glass" || name == "full") {
        material.opacity = MaterialInput(0.0F);
    }
    if (name == "coated" || name == "full") {
        material.useSpecularWorkflow = true;
        material.specularColor = MaterialInput(Rgb(0.2F, 0.1F, 0.1F));
        test.addSky(Rgb(0.2F, 0.3F, 0.5F));
    }
    addRoom(test, material);
    test.addLamp(2.9);
}

ImageKey testImage(const std::string& name) {
    ImageKey key;
    key.path = std::string(MBFEAT_TEST_TEXTURES) + "/" + name;
    return key;
}

MaterialInput imageInput(Material& material, const std::string& name) {
    MaterialInput input;
    input.source = MaterialInput::Source::kTexture;
    input.texture = static_cast<int>(material.textures.size());
    material.textures.emplace_back();
    material.textures.back().image = testImage(name);
    return input;
}

std::shared_ptr<Mesh> withTexturePlaces(std::shared_ptr<Mesh> quad) {
    quad->primvars.push_back(
        {"st", {Interpolation::kVertex, 2, {0.0F, 0.0F, 1.0F, 0.0F, 1.0F, 1.0F, 0.0F, 1.0F}}});
    return quad;
}

/// Textures, bumps, a primvar, a veil and a lamp of triangles.
void addPaintedWalls(TestScene& test) {
    Material floor = constantMaterial("/M/Floor", {0.0F, 0.0F, 0.0F});
    floor.diffuseColor = imageInput(floor, "checker.png");
    test.add("/Floor", withTexturePlaces(quadMesh({-4, -1, 4}, {8, 0, 0}, {0, 0, -8})), floor);
    Material back = constantMaterial("/M/Back", {0.7F, 0.7F, 0.7F});
    back.normal = imageInput(back, "bumps.png");
    test.add("/Back", withTexturePlaces(quadMesh({-4, -1, -4}, {8, 0, 0}, {0, 4, 0})), back);
    Material side = constantMaterial("/M/Side", {0.0F, 0.0F, 0.0F});
    side.diffuseColor.source = MaterialInput::Source::kPrimvar;
    side.diffuseColor.primvar = "paint";
    std::shared_ptr<Mesh> quad = quadMesh({-4, -1, 0}, {0, 0, -4}, {0, 4, 0});
    quad->primvars.push_back({"paint", {Interpolation::kConstant, 3, {0.5F, 0.6F, 0.2F}}});
    test.add("/Side", std::move(quad), side);
    Material veil = constantMaterial("/M/Veil", {0.3F, 0.3F, 0.8F});
    veil.opacity = MaterialInput(0.4F);
    veil.opacityMode = OpacityMode::kPresence;
    test.add("/Veil", quadMesh({1.2F, -1, -2}, {1.2F, 0, 0.4F}, {0, 2, 0}), veil);
    Material glow = constantMaterial("/M/Glow", {0.2F, 0.2F, 0.2F});
    glow.emissiveColor = MaterialInput(Rgb(3.0F, 2.0F, 1.0F));
    test.add("/Glow", quadMesh({1.5F, 0, -3.5F}, {0.5F, 0, 0}, {0, 0.5F, 0}), glow);
}

/// Metal below a coat, a surface of the specular workflow, and rough glass, of which there are two.
void addBalls(TestScene& test) {
    Material coated = constantMaterial("/M/Coated", {0.8F, 0.5F, 0.3F});
    coated.metallic = MaterialInput(0.6F);
    coated.roughness = MaterialInput(0.4F);
    coated.clearcoat = MaterialInput(0.8F);
    coated.ior = MaterialInput(1.5F);
    test.add("/Coated", sphereMesh(0.6F, 32, false), coated, translation(-1.4, -0.4, -2));
    Material lacquer = constantMaterial("/M/Lacquer", {0.1F, 0.3F, 0.5F});
    lacquer.useSpecularWorkflow = true;
    lacquer.specularColor = MaterialInput(Rgb(0.2F, 0.2F, 0.25F));
    lacquer.roughness = MaterialInput(0.2F);
    test.add("/Lacquer", sphereMesh(0.6F, 32, false), lacquer, translation(0, -0.4, -2.4));
    Material glass = constantMaterial("/M/Glass", {0.9F, 0.97F, 0.95F});
    glass.opacity = MaterialInput(0.0F);
    glass.ior = MaterialInput(1.5F);
    glass.roughness = MaterialInput(0.15F);
    test.addInstances("/Glass", sphereMesh(0.5F, 32, false), glass,
                      {translation(0.8, -0.5, -1.4), translation(-0.6, -0.5, -1.0)});
}

/// A sky with an image, and more lamps than are met one by one: one is shaped, one is dimmed, one
/// casts no shadows.
void addLights(TestScene& test) {
    constexpr int kLamps = 10;
    for (int i = 0; i < kLamps; ++i) {
        Light lamp;
        lamp.path = "/Lamp" + std::to_string(i);
        lamp.type = LightType::kRect;
        lamp.radiance = Rgb(3.0F);
        lamp.width = lamp.height = 0.4F;
        lamp.toWorld.y = {0.0, 0.0, 1.0};
        lamp.toWorld.z = {0.0, 1.0, 0.0};
        lamp.toWorld.t = {-2.2 + 0.5 * i, 2.9, -2.0 + 0.2 * (i % 3)};
        lamp.shaping.coneAngle = i == 0 ? 50.0F : 90.0F;
        lamp.diffuse = i == 1 ? 0.5F : 1.0F;
        lamp.castsShadows = i != 2;
        test.scene.setLight(lamp);
    }
    Light sky;
    sky.path = "/Sky";
    sky.type = LightType::kDome;
    sky.radiance = Rgb(0.4F);
    sky.hasTexture = true;
    sky.texture = testImage("checker.png");
    test.scene.setLight(sky);
}

} // namespace

void fillBenchScene(TestScene& test, const std::string& name) {
    if (name != "everything") {
        fillPrebuilt(test, name);
        return;
    }
    addPaintedWalls(test);
    addBalls(test);
    addLights(test);
}

Camera benchCamera(const std::string& name) {
    Camera camera = testCamera({0, 0.5, 3}, 0.7F);
    if (name == "everything") {
        camera.lensRadius = 0.05F;
        camera.focusDistance = 5.0F;
    }
    return camera;
}

} // namespace mbfeat::test
