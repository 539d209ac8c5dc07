#include "testScenes.h"

#include <cmath>
#include <utility>

#include <doctest/doctest.h>

namespace mbfeat::test {

std::shared_ptr<Mesh> sphereMesh(float radius, int segments, bool inward) {
    auto mesh = std::make_shared<Mesh>();
    const int rows = segments / 2;
    mesh->normals = {Interpolation::kVertex, 3, {}};
    for (int i = 0; i <= rows; ++i) {
        for (int j = 0; j < segments; ++j) {
            const float theta = kPi * static_cast<float>(i) / static_cast<float>(rows);
            const float phi = kTwoPi * static_cast<float>(j) / static_cast<float>(segments);
            const Float3 n(std::sin(theta) * std::cos(phi), std::cos(theta),
                           std::sin(theta) * std::sin(phi));
            mesh->points.push_back(n * radius);
            const float sign = inward ? -1.0F : 1.0F;
            mesh->normals.values.insert(mesh->normals.values.end(),
                                        {n.x * sign, n.y * sign, n.z * sign});
        }
    }
    const auto index = [&](int i, int j) {
        return static_cast<std::uint32_t>(i * segments + j % segments);
    };
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (inward) {
            std::swap(b, c);
        }
        mesh->triangles.push_back({{a, b, c}});
    };
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < segments; ++j) {
            if (i > 0) {
                add(index(i, j), index(i, j + 1), index(i + 1, j));
            }
            if (i + 1 < rows) {
                add(index(i, j + 1), index(i + 1, j + 1), index(i + 1, j));
            }
        }
    }
    return mesh;
}

std::shared_ptr<Mesh> quadMesh(const Float3& origin, const Float3& u, const Float3& v) {
    auto mesh = std::make_shared<Mesh>();
    mesh->points = {origin, origin + u, origin + u + v, origin + v};
    mesh->triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
    mesh->triangleFaces = {0, 0};
    return mesh;
}

Material constantMaterial(const std::string& path, const Rgb& diffuse) {
    Material material;
    material.path = path;
    material.diffuseColor = MaterialInput(diffuse);
    material.roughness = MaterialInput(1.0F);
    material.ior = MaterialInput(1.0F);
    return material;
}

void TestScene::add(const std::string& path, std::shared_ptr<const Mesh> mesh,
                    const Material& material, const AffineD& toWorld) {
    scene.setMaterial(material);
    Geometry geometry;
    geometry.path = path;
    geometry.mesh = std::move(mesh);
    geometry.transforms = {toWorld};
    geometry.materials = {material.path};
    scene.setGeometry(std::move(geometry));
}

void TestScene::addInstances(const std::string& path, std::shared_ptr<const Mesh> mesh,
                             const Material& material, std::vector<AffineD> transforms) {
    scene.setMaterial(material);
    Geometry geometry;
    geometry.path = path;
    geometry.mesh = std::move(mesh);
    geometry.transforms = std::move(transforms);
    geometry.instanced = true;
    geometry.materials = {material.path};
    scene.setGeometry(std::move(geometry));
}

void TestScene::addSky(const Rgb& radiance) {
    Light sky;
    sky.path = "/Sky";
    sky.type = LightType::kDome;
    sky.radiance = radiance;
    scene.setLight(sky);
}

void TestScene::addLamp(double height) {
    Light light;
    light.path = "/Lamp";
    light.type = LightType::kRect;
    light.radiance = Rgb(6.0F);
    light.toWorld.y = {0.0, 0.0, 1.0};
    light.toWorld.z = {0.0, 1.0, 0.0};
    light.toWorld.t = {0.0, height, -2.0};
    scene.setLight(light);
}

AffineD translation(double x, double y, double z) {
    AffineD transform;
    transform.t = {x, y, z};
    return transform;
}

Camera testCamera(const Double3& position, float tangent) {
    Camera camera;
    camera.toWorld.t = position;
    camera.windowMin = {-tangent, -tangent};
    camera.windowMax = {tangent, tangent};
    camera.nearClip = 1e-3F;
    camera.farClip = 1e6F;
    return camera;
}

void prepareView(Integrator& integrator, const IntegratorRequest& request, const Camera& camera,
                 int width, int height) {
    // Outside of the checks, which are not compiled everywhere.
    [[maybe_unused]] const bool committed = integrator.commit(request.options, {});
    ImageWindow window;
    window.width = width;
    window.height = height;
    window.data = {0, 0, width, height};
    [[maybe_unused]] const Status problem = integrator.setView(camera, window, request);
    REQUIRE(committed);
    REQUIRE_FALSE(problem);
}

namespace {

FilmRequest filmRequest(int width, int height) {
    FilmRequest request;
    request.window.width = width;
    request.window.height = height;
    request.window.data = {0, 0, width, height};
    return request;
}

RenderView viewOf(const Camera& camera, const FilmRequest& request) {
    RenderView view;
    view.camera = camera;
    view.film = std::make_shared<Film>(request);
    return view;
}

} // namespace

RenderView viewOf(const Camera& camera, int width, int height) {
    return viewOf(camera, filmRequest(width, height));
}

RenderReport renderView(Scene& scene, const RenderView& view, const RenderOptions& options,
                        bool interactive) {
    RenderJob job;
    job.interactive = interactive;
    job.views.push_back(view);
    job.options = options;
    Renderer renderer(scene);
    renderer.start(std::move(job));
    renderer.wait();
    REQUIRE(renderer.isConverged());
    return renderer.report();
}

std::shared_ptr<Film> render(Scene& scene, const Camera& camera, int width, int height,
                             const std::vector<std::string>& aovs, const RenderOptions& options) {
    FilmRequest request = filmRequest(width, height);
    request.aovs = aovs;
    request.samplesPerPixel = options.samplesPerPixel;
    const RenderView view = viewOf(camera, request);
    renderView(scene, view, options);
    return view.film;
}

std::vector<float> aov(const Film& film, const std::string& name) {
    const int index = film.findBound(name);
    REQUIRE(index >= 0);
    const PixelRect& data = film.window().data;
    std::vector<float> values(
        static_cast<std::size_t>(data.width) * static_cast<std::size_t>(data.height) *
        static_cast<std::size_t>(film.aovs()[static_cast<std::size_t>(index)].width()));
    film.resolve(index, values.data());
    return values;
}

double meanOf(const Film& film, const std::string& name) {
    const std::vector<float> values = aov(film, name);
    const int index = film.findBound(name);
    const auto stride =
        static_cast<std::size_t>(film.aovs()[static_cast<std::size_t>(index)].width());
    double sum = 0.0;
    for (std::size_t i = 0; i < values.size(); i += stride) {
        sum += values[i];
    }
    return sum * static_cast<double>(stride) / static_cast<double>(values.size());
}

RenderOptions exactOptions(int samplesPerPixel) {
    RenderOptions options;
    options.samplesPerPixel = samplesPerPixel;
    options.maxBounces = 64;
    options.pixelFilter = PixelFilter::kBox;
    options.pixelFilterWidth = 1.0F;
    options.splitting = 1;
    return options;
}

} // namespace mbfeat::test
