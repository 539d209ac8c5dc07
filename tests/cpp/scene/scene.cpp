// Committing scenes: order, changes, materials, textures, the origin.
#include "scene/scene.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "film/temporaryDirectory.h"
#include "scene/dump.h"
#include "scene/imageFiles.h"

using namespace mbfeat;

namespace {

/// A triangle of that size at that place of object space.
std::shared_ptr<const Mesh> triangle(Float3 at = Float3(0.0F), float size = 1.0F) {
    auto mesh = std::make_shared<Mesh>();
    mesh->points = {at, at + Float3(size, 0, 0), at + Float3(0, size, 0)};
    mesh->triangles = {{{0, 1, 2}}};
    return mesh;
}

AffineD translation(double x, double y = 0.0, double z = 0.0) {
    AffineD m;
    m.t = {x, y, z};
    return m;
}

Geometry geometry(const std::string& path, const std::string& material = {}) {
    Geometry g;
    g.path = path;
    g.mesh = triangle();
    g.transforms = {AffineD()};
    g.materials = {material};
    return g;
}

Material material(const std::string& path) {
    Material m;
    m.path = path;
    return m;
}

Light texturedLight(const std::string& path, LightType type, const std::string& file) {
    Light light;
    light.path = path;
    light.type = type;
    light.hasTexture = true;
    light.texture.path = file;
    return light;
}

Material texturedMaterial(const std::string& path, const std::string& file) {
    Material m = material(path);
    m.textures.resize(1);
    m.textures[0].image.path = file;
    m.diffuseColor.source = MaterialInput::Source::kTexture;
    m.diffuseColor.texture = 0;
    return m;
}

struct Fixture {
    Diagnostics diagnostics;
    Scene scene{diagnostics};
    TemporaryDirectory folder;

    std::string image(const std::string& name) {
        writeBytes(folder.file(name), PngFile{1, 1, 3, 8, {255, 0, 0}}.encode());
        return folder.file(name);
    }
};

} // namespace

TEST_CASE_FIXTURE(Fixture, "an empty scene commits") {
    const SceneChanges changes = scene.commit();
    CHECK_FALSE(changes.geometry);
    CHECK(scene.geometries().empty());
    CHECK(scene.lights().empty());
    REQUIRE(scene.materials().size() == 1);
    CHECK(scene.materials()[0]->diffuseColor.source == MaterialInput::Source::kPrimvar);
    CHECK(scene.materials()[0]->diffuseColor.primvar == "displayColor");
    CHECK(scene.origin() == Double3(0.0));
}

TEST_CASE_FIXTURE(Fixture, "geometry is committed in path order, only what can be seen") {
    scene.setGeometry(geometry("/b"));
    scene.setGeometry(geometry("/a"));
    Geometry hidden = geometry("/hidden");
    hidden.visible = false;
    scene.setGeometry(hidden);
    Geometry empty = geometry("/empty");
    empty.mesh = std::make_shared<Mesh>();
    scene.setGeometry(empty);
    Geometry none = geometry("/none");
    none.mesh = nullptr;
    scene.setGeometry(none);
    Geometry nowhere = geometry("/nowhere");
    nowhere.transforms.clear();
    scene.setGeometry(nowhere);
    CHECK(scene.commit().geometry);
    REQUIRE(scene.geometries().size() == 2);
    CHECK(scene.geometries()[0].source->path == "/a");
    CHECK(scene.geometries()[1].source->path == "/b");
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "every edit raises the version, and commits report what changed") {
    std::uint64_t version = scene.version();
    const auto edited = [&] {
        const bool grew = scene.version() > version;
        version = scene.version();
        return grew;
    };
    scene.setMaterial(material("/m"));
    CHECK(edited());
    Geometry g = geometry("/a", "/m");
    scene.setGeometry(g);
    scene.setGeometry(geometry("/b"));
    CHECK(edited());
    SceneChanges changes = scene.commit();
    CHECK(changes.geometry);
    CHECK(changes.materials);
    CHECK_FALSE(changes.lights);
    CHECK_FALSE(edited());
    CHECK(scene.geometries()[0].meshChanged);

    changes = scene.commit();
    CHECK_FALSE((changes.geometry || changes.materials || changes.lights));
    CHECK_FALSE(scene.geometries()[0].meshChanged);

    Material rough = material("/m");
    rough.roughness = MaterialInput(0.25F);
    scene.setMaterial(rough);
    CHECK(edited());
    changes = scene.commit();
    CHECK(changes.materials);
    CHECK_FALSE(changes.geometry);
    CHECK(scene.materials()[1]->roughness.value.x == 0.25F);

    g.transforms = {translation(0.1)};
    scene.setGeometry(g);
    changes = scene.commit();
    CHECK(changes.geometry);
    CHECK_FALSE(changes.materials);
    CHECK(scene.geometries()[0].meshChanged);
    CHECK_FALSE(scene.geometries()[1].meshChanged);

    g.materials = {""};
    scene.setGeometry(g);
    changes = scene.commit();
    CHECK(changes.materials);
    CHECK_FALSE(scene.geometries()[0].meshChanged);

    Light light;
    light.path = "/light";
    scene.setLight(light);
    changes = scene.commit();
    CHECK(changes.lights);
    CHECK_FALSE(changes.geometry);

    edited();
    scene.removeLight("/light");
    scene.removeGeometry("/b");
    scene.removeMaterial("/m");
    CHECK(edited());
    changes = scene.commit();
    CHECK(changes.lights);
    CHECK(changes.geometry);
    CHECK(scene.geometries().size() == 1);
    scene.removeGeometry("/not there");
    CHECK_FALSE(edited());
}

TEST_CASE_FIXTURE(Fixture, "moving instances keeps their mesh") {
    Geometry g = geometry("/a");
    g.instanced = true;
    g.transforms = {translation(0), translation(3)};
    scene.setGeometry(g);
    scene.commit();
    g.transforms[1] = translation(3.5);
    scene.setGeometry(g);
    CHECK(scene.commit().geometry);
    CHECK_FALSE(scene.geometries()[0].meshChanged);
}

TEST_CASE_FIXTURE(Fixture, "materials are resolved by slot, unused ones are left out") {
    scene.setMaterial(material("/z"));
    scene.setMaterial(material("/m"));
    scene.setMaterial(material("/unused"));
    Geometry g = geometry("/a");
    g.materials = {"/z", "", "/m"};
    scene.setGeometry(g);
    scene.commit();
    REQUIRE(scene.materials().size() == 3);
    CHECK(scene.materials()[1]->path == "/m");
    CHECK(scene.materials()[2]->path == "/z");
    CHECK(scene.geometries()[0].materials == std::vector<std::uint32_t>{2, 0, 1});
}

TEST_CASE_FIXTURE(Fixture,
                  "a missing material is replaced by the default and named with its prim") {
    scene.setGeometry(geometry("/World/a", "/Looks/gone"));
    scene.commit();
    scene.setGeometry(geometry("/World/a", "/Looks/gone"));
    scene.commit();
    CHECK(scene.geometries()[0].materials == std::vector<std::uint32_t>{0});
    REQUIRE(diagnostics.messages().size() == 1);
    CHECK(diagnostics.messages()[0].subject == "/World/a");
    CHECK(diagnostics.messages()[0].text.find("/Looks/gone") != std::string::npos);
}

TEST_CASE_FIXTURE(Fixture, "slots that the mesh uses but nobody binds get the default material") {
    auto mesh = std::make_shared<Mesh>(*triangle());
    mesh->triangleMaterials = {3};
    Geometry g = geometry("/a", "/m");
    g.mesh = mesh;
    scene.setMaterial(material("/m"));
    scene.setGeometry(g);
    scene.commit();
    CHECK(scene.geometries()[0].materials == std::vector<std::uint32_t>{1, 0, 0, 0});
    CHECK(diagnostics.messages().size() == 1);
}

TEST_CASE_FIXTURE(Fixture, "textures of bound materials are loaded once, others are not") {
    const std::string file = image("a.png");
    scene.setMaterial(texturedMaterial("/m1", file));
    scene.setMaterial(texturedMaterial("/m2", file));
    scene.setMaterial(texturedMaterial("/unused", folder.file("missing.png")));
    scene.setGeometry(geometry("/a", "/m1"));
    scene.setGeometry(geometry("/b", "/m2"));
    Geometry hidden = geometry("/c", "/unused");
    hidden.visible = false;
    scene.setGeometry(hidden);
    scene.commit();
    CHECK(diagnostics.messages().empty());
    REQUIRE(scene.materials().size() == 3);
    REQUIRE(scene.materials()[1]->images.size() == 1);
    CHECK(scene.materials()[1]->images[0] != nullptr);
    CHECK(scene.materials()[1]->images[0] == scene.materials()[2]->images[0]);
    CHECK(scene.textures().count() == 1);

    // An edit of the material keeps its image; unbinding frees it.
    const auto before = scene.materials()[1]->images[0];
    Material edited = texturedMaterial("/m1", file);
    edited.roughness = MaterialInput(0.1F);
    scene.setMaterial(edited);
    scene.commit();
    CHECK(scene.materials()[1]->images[0] == before);
}

TEST_CASE_FIXTURE(Fixture, "textures nobody holds are freed, and unread inputs load none") {
    Material m = texturedMaterial("/m", image("a.png"));
    scene.setMaterial(m);
    scene.setGeometry(geometry("/a", "/m"));
    scene.commit();
    CHECK(scene.textures().count() == 1);
    m.occlusion = m.diffuseColor;
    m.diffuseColor = MaterialInput(0.5F);
    scene.setMaterial(m);
    scene.commit();
    CHECK(scene.textures().count() == 0);
}

TEST_CASE_FIXTURE(Fixture, "a missing texture is reported once with the prim and leaves null") {
    scene.setMaterial(texturedMaterial("/m1", folder.file("missing.png")));
    scene.setMaterial(texturedMaterial("/m2", folder.file("missing.png")));
    scene.setGeometry(geometry("/a", "/m1"));
    scene.setGeometry(geometry("/b", "/m2"));
    Light dome;
    dome.path = "/dome";
    dome.type = LightType::kDome;
    dome.hasTexture = true;
    dome.texture.path = folder.file("sky.exr");
    scene.setLight(dome);
    scene.commit();
    CHECK(scene.materials()[1]->images[0] == nullptr);
    CHECK(scene.lights()[0]->image == nullptr);
    REQUIRE(diagnostics.messages().size() == 2);
    for (const Message& message : diagnostics.messages()) {
        CHECK(message.subject ==
              (message.text.find("sky.exr") != std::string::npos ? "/dome" : "/m1"));
    }
}

TEST_CASE_FIXTURE(Fixture, "light textures are loaded for the lights that show them") {
    Light light = texturedLight("/light", LightType::kRect, image("a.png"));
    scene.setLight(light);
    scene.commit();
    CHECK(scene.lights()[0]->image != nullptr);
    light.type = LightType::kSphere;
    scene.setLight(light);
    scene.commit();
    CHECK(scene.lights()[0]->image == nullptr);
}

TEST_CASE_FIXTURE(Fixture, "lights that an effect takes along are gone, and come back with it") {
    Light panel;
    panel.path = "/panel";
    panel.type = LightType::kRect;
    scene.setLight(texturedLight("/sky", LightType::kDome, image("sky.png")));
    scene.setLight(panel);
    scene.commit();
    REQUIRE(scene.lights().size() == 2);
    scene.takeEffects(EffectSet(Effect::kEnvironment));
    CHECK(scene.commit().lights);
    REQUIRE(scene.lights().size() == 1);
    CHECK(scene.lights()[0]->path == "/panel");
    scene.takeEffects(EffectSet(Effect::kEnvironment) | EffectSet(Effect::kAreaLights));
    CHECK(scene.commit().lights);
    CHECK(scene.lights().empty());
    scene.takeEffects(EffectSet());
    CHECK(scene.commit().lights);
    REQUIRE(scene.lights().size() == 2);
    CHECK(scene.lights()[1]->image != nullptr);
    CHECK(scene.textures().loaded() == 1); // kept meanwhile
    CHECK(diagnostics.messages().empty());
}

TEST_CASE_FIXTURE(Fixture, "another rendering space loads colour textures anew") {
    scene.setMaterial(texturedMaterial("/m", image("a.png")));
    scene.setGeometry(geometry("/a", "/m"));
    scene.commit();
    CHECK(scene.materials()[1]->images[0]->texel(0, 0).x == 1.0F);
    const std::uint64_t version = scene.version();
    scene.setRenderingColorSpace("ACEScg");
    CHECK(scene.version() > version);
    CHECK(scene.commit().materials);
    CHECK(scene.materials()[1]->images[0]->texel(0, 0).x == doctest::Approx(0.613).epsilon(1e-3));
    CHECK(scene.textures().count() == 1);
    const std::uint64_t same = scene.version();
    scene.setRenderingColorSpace("ACEScg");
    CHECK(scene.version() == same);
}

TEST_CASE_FIXTURE(Fixture,
                  "transforms that cannot be used are dropped, the others keep their ids") {
    Geometry g = geometry("/a");
    g.instanced = true;
    AffineD flat;
    flat.y = {0, 0, 0};
    AffineD skewed; // all rows in one plane
    skewed.z = {1, 1, 1e-17};
    AffineD bad = translation(std::numeric_limits<double>::quiet_NaN());
    AffineD mirrored;
    mirrored.x = {-1, 0, 0};
    AffineD thin;
    thin.y = {0, 1e-9, 0};
    g.transforms = {flat, mirrored, bad, skewed, thin};
    scene.setGeometry(g);
    scene.commit();
    REQUIRE(scene.geometries().size() == 1);
    CHECK(scene.geometries()[0].source->transforms.size() == 2);
    CHECK(scene.geometries()[0].source->instanceIds == std::vector<std::int32_t>{1, 4});
    REQUIRE(diagnostics.messages().size() == 1);
    CHECK(diagnostics.messages()[0].subject == "/a");
    CHECK(diagnostics.messages()[0].text.find("3 of 5 transforms") != std::string::npos);
}

TEST_CASE_FIXTURE(Fixture, "lights that cannot be used are off") {
    Light light;
    light.path = "/flat";
    light.toWorld.z = {0, 0, 0};
    scene.setLight(light);
    light.path = "/nan";
    light.toWorld = AffineD();
    light.radiance.y = std::numeric_limits<float>::infinity();
    scene.setLight(light);
    scene.commit();
    REQUIRE(scene.lights().size() == 2);
    CHECK(isBlack(scene.lights()[0]->radiance));
    CHECK(isBlack(scene.lights()[1]->radiance));
    CHECK(diagnostics.messages().size() == 2);
}

TEST_CASE_FIXTURE(Fixture, "the origin is the snapped centre of the bounds and stays put") {
    Geometry g = geometry("/a");
    g.transforms = {translation(1e9 + 3.7, -5e8, 12.3)};
    scene.setGeometry(g);
    CHECK(scene.commit().geometry);
    const Double3 origin = scene.origin();
    CHECK(std::abs(origin.x - (1e9 + 4.2)) <= 0.125);
    CHECK(std::abs(origin.y - (-5e8 + 0.5)) <= 0.125);
    CHECK(std::abs(origin.z - 12.3) <= 0.125);
    // On the grid of a power of two, so that small offsets from it are exact.
    CHECK(origin.x * 4.0 == std::round(origin.x * 4.0));

    g.transforms = {translation(1e9 + 3.75, -5e8, 12.3)};
    scene.setGeometry(g);
    scene.commit();
    CHECK(scene.origin() == origin);

    scene.setGeometry(geometry("/b"));
    scene.commit();
    CHECK_FALSE(scene.origin() == origin);
    CHECK(scene.geometries()[0].meshChanged);
}

TEST_CASE_FIXTURE(Fixture, "scenes about the world's origin keep it") {
    scene.setGeometry(geometry("/a"));
    Geometry g = geometry("/b");
    g.transforms = {translation(-1.0, -0.75)};
    scene.setGeometry(g);
    scene.commit();
    CHECK(scene.origin() == Double3(0.0));
}

TEST_CASE_FIXTURE(Fixture, "bounds beyond what doubles hold leave the origin alone") {
    Geometry g = geometry("/a");
    g.transforms = {translation(1.7e308), translation(-1.7e308)};
    scene.setGeometry(g);
    scene.commit();
    CHECK(scene.origin() == Double3(0.0));
}

TEST_CASE_FIXTURE(Fixture, "the dump tells scenes apart and is the same for the same scene") {
    const auto fill = [](Scene& s, float roughness) {
        Material m = material("/Looks/m");
        m.roughness = MaterialInput(roughness);
        s.setMaterial(m);
        s.setGeometry(geometry("/World/a", "/Looks/m"));
        Light light;
        light.path = "/World/light";
        light.radius = 0.1F;
        s.setLight(light);
        s.commit();
        return dumpScene(s);
    };
    const std::string dump = fill(scene, 0.3F);
    Diagnostics other;
    Scene same(other);
    Scene different(other);
    CHECK(fill(same, 0.3F) == dump);
    CHECK(fill(different, 0.30000001192F) == dump); // the same float
    CHECK(fill(different, 0.3000002F) != dump);
    for (const std::string line :
         {"origin 0.5 0.5 0\n", "geometry /World/a\n", "  transform 1 0 0, 0 1 0, 0 0 1, 0 0 0\n",
          "  material slot 0 is 1 '/Looks/m'\n", "  bounds 0 0 0, 1 1 0\n", "  points 3 checksum ",
          "material 0 (default)\n",
          "  diffuseColor primvar 'displayColor' fallback 0.18 0.18 0.18\n",
          "material 1 /Looks/m\n", "  roughness 0.3 0.3 0.3\n", "light /World/light sphere\n",
          "  radius 0.1 treatAsPoint false\n"}) {
        CHECK_MESSAGE(dump.find(line) != std::string::npos, line);
    }
}
