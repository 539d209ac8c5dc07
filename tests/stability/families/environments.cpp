// Domes: one bright texel, black, at the poles, of one texel, of extreme values.
#include "families.h"

#include <algorithm>
#include <stdexcept>

#include "core/floatTraps.h"
#include "film/temporaryDirectory.h"
#include "rendering.h"
#include "scene/imageFiles.h"
#include "shading/environmentMap.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;
using test::TestScene;

constexpr double kPiExact = 3.14159265358979323846;

using Texels = std::vector<float>;

std::shared_ptr<const Image> image(int width, int height, const Texels& grey) {
    auto made = makeImage(width, height, 1, grey);
    if (!made) {
        throw std::runtime_error(made.error().subject + " " + made.error().text);
    }
    return made.value();
}

/// An image of `rest` with one texel of `sun`, as large as the sun's disc or as a row at a pole.
std::shared_ptr<const Image> sunImage(int width, int height, int x, int y, float sun, float rest) {
    Texels texels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), rest);
    texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x)] = sun;
    return image(width, height, texels);
}

/// Irradiance on a surface with that normal, by midpoints in latitude and longitude over the
/// bilinear image, in double.
double irradiance(const EnvironmentMap& map, int width, int height,
                  const Double3& n = {0.0, 1.0, 0.0}) {
    double sum = 0.0;
    constexpr int kFine = 8;
    const int rows = height * kFine, columns = width * kFine;
    for (int j = 0; j < rows; ++j) {
        const double latitude = kPiExact * ((j + 0.5) / rows - 0.5);
        const double weight = std::cos(latitude) * (kPiExact / rows) * (2.0 * kPiExact / columns);
        for (int i = 0; i < columns; ++i) {
            const double longitude = kPiExact * (1.0 - 2.0 * (i + 0.5) / columns);
            const Float3 d(static_cast<float>(std::sin(longitude) * std::cos(latitude)),
                           static_cast<float>(std::sin(latitude)),
                           static_cast<float>(std::cos(longitude) * std::cos(latitude)));
            const double cosine = dot(n, Double3(d));
            if (cosine > 0.0) {
                sum += weight * cosine * static_cast<double>(map.value(d).x);
            }
        }
    }
    return sum;
}

/// By the map's own samples for such a surface.
std::vector<double> sampled(const EnvironmentMap& map, int batches, int count,
                            const Facing<float>& to = {}) {
    TestRandom random(81);
    std::vector<double> values;
    for (int b = 0; b < batches; ++b) {
        double sum = 0.0;
        for (int i = 0; i < count; ++i) {
            const EnvironmentMap::Sample s = map.sample(random.nextFloat2(), to);
            const double cosine = std::max(static_cast<double>(s.direction.y), 0.0);
            sum += cosine * static_cast<double>(map.value(s.direction).x) /
                   static_cast<double>(s.pdf) / count;
        }
        values.push_back(sum);
    }
    return values;
}

void addSun(Catalogue& catalogue, const std::string& name, int width, int height, int x, int y,
            float sun, float rest) {
    catalogue.push_back({"dome/sun-" + name + "-irradiance",
                         "irradiance of the dome's samples against quadrature of its image, score",
                         kLargestZ, kReasonZ, [=](Report& report) {
                             const EnvironmentMap map(sunImage(width, height, x, y, sun, rest));
                             const double truth = irradiance(map, width, height);
                             const std::vector<double> values = sampled(map, 256, 1024);
                             // Midpoints, 8 x 8 a texel, are exact for what a bilinear texel is;
                             // the cosines bend by the square of their step, 1e-6.
                             report.error(std::abs(standardScore(values, truth, 2e-5)), [&] {
                                 return Text().add("first", values[0]).add("quadrature", truth);
                             });
                         }});
    catalogue.push_back(
        {"dome/sun-" + name + "-facing",
         "irradiance of the dome's samples for a surface that faces up against quadrature, score",
         kLargestZ, kReasonZ, [=](Report& report) {
             const EnvironmentMap map(sunImage(width, height, x, y, sun, rest));
             const double truth = irradiance(map, width, height);
             const Facing<float> up{Float3(0.0F, 1.0F, 0.0F), false};
             const std::vector<double> values = sampled(map, 256, 1024, up);
             report.error(std::abs(standardScore(values, truth, 2e-5)),
                          [&] { return Text().add("first", values[0]).add("quadrature", truth); });
         }});
    catalogue.push_back(
        {"dome/sun-" + name + "-density",
         "density of the dome's samples told twice, relative; at its cells' edges "
         "of the neighbour",
         4e-4,
         "a direction is rounded to 1e-7 of a turn, a ten-thousandth of a cell, along two axes",
         [=](Report& report) {
             const EnvironmentMap map(sunImage(width, height, x, y, sun, rest));
             TestRandom random(82);
             int wrong = 0;
             constexpr int kCount = 20000;
             for (int i = 0; i < kCount; ++i) {
                 const EnvironmentMap::Sample s = map.sample(random.nextFloat2());
                 const auto told = static_cast<double>(map.pdf(s.direction));
                 wrong += relativeError(told, static_cast<double>(s.pdf)) > 1e-5 ? 1 : 0;
                 report.require(std::abs(length(Double3(s.direction)) - 1.0) < 1e-6,
                                [&] { return Text().add("pdf", s.pdf); });
             }
             report.error(static_cast<double>(wrong) / kCount);
         }});
}

Light dome(std::shared_ptr<const Image> texture, float radiance) {
    Light l;
    l.path = "/Sky";
    l.type = LightType::kDome;
    l.radiance = Rgb(radiance);
    l.hasTexture = texture != nullptr;
    l.image = std::move(texture);
    return l;
}

Estimate renderFloor(const std::vector<Light>& lights) {
    TestScene test;
    test.add("/Floor", test::quadMesh({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}),
             test::constantMaterial("/M", Rgb(1.0F)));
    for (const Light& l : lights) {
        test.scene.setLight(l);
    }
    Camera camera = test::testCamera({0, 0.5, 0}, 0.1F);
    camera.toWorld.y = {0, 0, -1};
    camera.toWorld.z = {0, 1, 0};
    return trace(test, camera, 16, 16, plainOptions(64, 4));
}

/// sunImage() as a file, whose rows go down.
void writeSun(const std::string& path, int width, int height, int x, int y, float sun, float rest) {
    Texels texels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), rest);
    texels[static_cast<std::size_t>(height - 1 - y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x)] = sun;
    const FloatTrapsMasked foreignCode;
    writeExr(path, Imf::Header(width, height),
             {{"R", Imf::FLOAT, texels}, {"G", Imf::FLOAT, texels}, {"B", Imf::FLOAT, texels}});
}

/// A dome with a small sun, turned about two axes, over a floor that faces up.
void addTurned(Catalogue& catalogue, const std::string& name, int width, int height,
               const Double3& first, const Double3& second) {
    catalogue.push_back(
        {"dome/turned-" + name + "-floor",
         "radiance of a white floor under a turned dome against quadrature of its image, score",
         kLargestZ, kReasonZ, [=](Report& report) {
             const int x = width / 3, y = 3 * height / 4;
             const TemporaryDirectory folder;
             Light light = dome(nullptr, 1.0F);
             light.hasTexture = true;
             light.texture.path = folder.file("sky.exr");
             writeSun(light.texture.path, width, height, x, y, 2000.0F, 0.5F);
             light.toWorld.x = normalize(first);
             light.toWorld.z = normalize(cross(first, second));
             light.toWorld.y = cross(light.toWorld.z, light.toWorld.x);
             // The world's +y, in the dome's own space.
             const AffineD& m = light.toWorld;
             const EnvironmentMap map(sunImage(width, height, x, y, 2000.0F, 0.5F));
             const double truth = irradiance(map, width, height, {m.x.y, m.y.y, m.z.y}) / kPiExact;
             const Estimate e = renderFloor({light});
             report.error(score(e, truth),
                          [&] { return Text().add("mean", e.mean()).add("quadrature", truth); });
             report.picture(e.picture("floor"));
         }});
}

Light lamp() {
    Light l;
    l.path = "/Lamp";
    l.type = LightType::kSphere;
    l.radius = 0.1F;
    l.toWorld.t = {0, 3, 0};
    return l;
}

void addWhole(Catalogue& catalogue) {
    catalogue.push_back(
        {"dome/black-adds-nothing", "change of the image when a black dome is added to a lamp", 0.0,
         "what emits nothing is not sampled, so that no number changes", [](Report& report) {
             const Estimate alone = renderFloor({lamp()});
             const Estimate both = renderFloor({lamp(), dome(nullptr, 0.0F)});
             const std::vector<double> a = alone.grey(), b = both.grey();
             for (std::size_t i = 0; i < a.size(); ++i) {
                 report.error(std::abs(a[i] - b[i]));
             }
         }});
    catalogue.push_back(
        {"dome/black-alone", "radiance under a black dome alone", 0.0, "there is no light",
         [](Report& report) { report.error(renderFloor({dome(nullptr, 0.0F)}).mean()); }});
    for (const auto& [name, radiance] :
         {std::pair("1e-30", 1e-30F), std::pair("1e30", 1e30F), std::pair("65504", 65504.0F)}) {
        catalogue.push_back({std::string("dome/uniform-") + name,
                             "radiance of a white floor against that of a uniform dome, score",
                             kLargestZ, kReasonZ, [radiance = radiance](Report& report) {
                                 const Estimate e = renderFloor({dome(nullptr, radiance)});
                                 report.error(score(e, static_cast<double>(radiance)));
                                 report.picture(e.picture("floor"));
                             }});
    }
    catalogue.push_back({"dome/dark-with-lamp",
                         "a dome of 1e-20 beside a lamp against the lamp alone, score of the "
                         "difference",
                         kLargestZ, kReasonZ, [](Report& report) {
                             const Estimate alone = renderFloor({lamp()});
                             const Estimate both = renderFloor({lamp(), dome(nullptr, 1e-20F)});
                             report.error(score(both, alone));
                         }});
}

/// Maps of one texel, one row and one column are what they say in every direction.
void checkSmallest(Report& report) {
    for (const auto& size : {std::pair(1, 1), std::pair(2, 1), std::pair(1, 2), std::pair(7, 1)}) {
        const int w = size.first;
        const int h = size.second;
        const EnvironmentMap map(
            image(w, h, Texels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 3.0F)));
        TestRandom random(83);
        for (int i = 0; i < 4096; ++i) {
            const EnvironmentMap::Sample s = map.sample(random.nextFloat2());
            report.error(relativeError(static_cast<double>(map.value(s.direction).x), 3.0));
            report.error(relativeError(static_cast<double>(s.pdf), 1.0 / (4.0 * kPiExact)),
                         [&] { return Text().add("width", w).add("height", h).add("pdf", s.pdf); });
        }
        report.error(relativeError(map.mean(), 3.0));
    }
}

} // namespace

void addEnvironments(Catalogue& catalogue) {
    addSun(catalogue, "one-texel-1e6", 512, 256, 100, 200, 1e6F, 1.0F);
    addSun(catalogue, "one-texel-in-black", 512, 256, 300, 180, 1e9F, 0.0F);
    addSun(catalogue, "at-pole", 256, 128, 17, 127, 1e6F, 1e-3F);
    addSun(catalogue, "at-seam", 256, 128, 0, 100, 65504.0F, 0.0F);
    addTurned(catalogue, "upright", 64, 32, {0.8, 0.0, 0.6}, {0.0, 1.0, 0.0});
    addTurned(catalogue, "tilted", 64, 32, {0.8, 0.3, 0.6}, {-0.4, 1.0, 0.7});
    addTurned(catalogue, "sun-below", 60, 30, {0.8, 0.0, 0.6}, {0.2, -1.0, 0.0});
    addTurned(catalogue, "sun-at-horizon", 31, 15, {0.1, 0.9, 0.3}, {1.0, 0.2, 0.0});
    addWhole(catalogue);
    catalogue.push_back({"dome/smallest-images",
                         "value, density and mean of uniform maps of one to seven texels, relative",
                         1e-6, "some roundings", checkSmallest});
}

} // namespace mbfeat::stability
