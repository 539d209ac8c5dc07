// Lights at the limits of strength, size and place: what a floor gets of them, by paths, by samples
// of the light sampler and by closed forms.
#include "families.h"

#include <algorithm>
#include <memory>

#include "rendering.h"
#include "shading/lightSampler.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;
using test::TestScene;

constexpr double kPiExact = 3.14159265358979323846;

Light light(LightType type, float radiance) {
    Light l;
    l.path = "/Light";
    l.type = type;
    l.radiance = Rgb(radiance);
    return l;
}

/// Local -z of the light down, its centre at that height above the floor y = 0.
void hang(Light& l, double height) {
    l.toWorld.x = {1, 0, 0};
    l.toWorld.y = {0, 0, -1};
    l.toWorld.z = {0, 1, 0};
    l.toWorld.t = {0, height, 0};
}

/// A white floor at y = 0 seen from above the origin, a hundredth of `scale` wide.
Estimate renderFloor(const std::vector<Light>& lights, double scale, int samples,
                     std::uint64_t seed = 0) {
    TestScene test;
    AffineD toWorld;
    toWorld.x = toWorld.x * scale;
    toWorld.y = toWorld.y * scale;
    toWorld.z = toWorld.z * scale;
    test.add("/Floor", test::quadMesh({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}),
             test::constantMaterial("/M", Rgb(1.0F)), toWorld);
    int number = 0;
    for (Light l : lights) {
        l.path += std::to_string(number++);
        test.scene.setLight(l);
    }
    // From below the lights, straight down.
    Camera camera = cameraOfScale({0, 0.05 * scale, 0}, 0.1F, scale * 1e-2);
    camera.toWorld.y = {0, 0, -1};
    camera.toWorld.z = {0, 1, 0};
    RenderOptions options = plainOptions(samples, 4);
    options.seed = seed;
    return trace(test, camera, 16, 16, options);
}

void addFloor(Catalogue& catalogue, const std::string& name, const Light& l, double scale,
              double irradiance, double tolerance, const std::string& reason) {
    catalogue.push_back({"light/" + name,
                         "radiance of a white floor under the light against the closed form, "
                         "relative",
                         tolerance, reason, [=](Report& report) {
                             const Estimate e = renderFloor({l}, scale, 256);
                             const double truth = irradiance / kPiExact;
                             report.error(relativeError(e.mean(), truth), [&] {
                                 return Text().add("mean", e.mean()).add("exact", truth);
                             });
                             report.picture(e.picture("floor"));
                         }});
}

void addSuns(Catalogue& catalogue) {
    const std::string constant = "cosines spread by 1e-5, of which 65536 samples leave 4e-8 times "
                                 "4.9; some tens of roundings";
    const auto sun = [](float angle, float radiance) {
        Light l = light(LightType::kDistant, radiance);
        hang(l, 0.0);
        l.angle = angle;
        return l;
    };
    const auto disc = [](double degrees, double radiance) {
        return radiance * kPiExact * sqr(std::sin(degrees * kPiExact / 360.0));
    };
    // The sun's 1e9 cd/m2 as radiance, and far beyond.
    addFloor(catalogue, "sun-1e9", sun(0.53F, 1e9F), 1.0, disc(0.53, 1e9), 2e-6, constant);
    addFloor(catalogue, "sun-1e30", sun(0.53F, 1e30F), 1.0, disc(0.53, 1e30), 2e-6, constant);
    addFloor(catalogue, "sun-1e-30", sun(0.53F, 1e-30F), 1.0, disc(0.53, 1e-30), 2e-6, constant);
    addFloor(catalogue, "sun-angle-1e-3", sun(1e-3F, 1e9F), 1.0, disc(1e-3, 1e9), 2e-6, constant);
    addFloor(catalogue, "sun-angle-0", sun(0.0F, 3.0F), 1.0, 3.0, 2e-6,
             "a delta light: its radiance is the irradiance");
    Light tiniest = sun(1e-6F, 3.0F);
    tiniest.normalize = true;
    addFloor(catalogue, "sun-angle-1e-6-normalized", tiniest, 1.0, 3.0, 2e-6, constant);
    // Some of its samples are below the horizon, so there is noise.
    catalogue.push_back({"light/sun-half-sky", "a distant light of 180 degrees, score", kLargestZ,
                         kReasonZ, [sun](Report& report) {
                             const Estimate e = renderFloor({sun(180.0F, 1.0F)}, 1.0, 256);
                             report.error(score(e, 1.0));
                         }});
}

void addSmall(Catalogue& catalogue) {
    const std::string constant =
        "the floor that is seen spans 5e-4 of the distance: cosines are the same to twice the "
        "square of that, and to some tens of roundings";
    for (const auto& [name, side, height] :
         {std::tuple("area-1e-8", 1e-4, 10.0), std::tuple("area-1e-16", 1e-8, 10.0),
          std::tuple("area-1e-8-away-1e6", 1e-4, 1e6)}) {
        Light l = light(LightType::kRect, 1e20F);
        l.width = l.height = static_cast<float>(side);
        hang(l, height);
        addFloor(catalogue, std::string("rect-") + name, l, 1.0, 1e20 * sqr(side / height), 2e-6,
                 constant);
    }
    for (const auto& [name, radius, height] :
         {std::tuple("1e-8", 1e-8, 10.0), std::tuple("1e-3-away-1e6", 1e-3, 1e6)}) {
        Light l = light(LightType::kSphere, 1e20F);
        l.radius = static_cast<float>(radius);
        hang(l, height);
        addFloor(catalogue, std::string("sphere-") + name, l, 1.0,
                 1e20 * kPiExact * sqr(radius / height), 2e-6, constant);
    }
    Light normalized = light(LightType::kSphere, 8.0F);
    normalized.radius = 1e-6F;
    normalized.normalize = true;
    hang(normalized, 10.0);
    // Radiance 8 over the area 4 pi r^2: irradiance 8 / (4 h^2).
    addFloor(catalogue, "sphere-1e-6-normalized", normalized, 1.0, 8.0 / 400.0, 2e-6, constant);
    Light spot = light(LightType::kSphere, 1.0F);
    spot.radius = 1e-3F;
    hang(spot, 10.0);
    spot.shaping.coneAngle = 0.02F;
    // The image is a thousandth of the height wide: all of it lies inside the cone at its foot.
    spot.toWorld.t.y = 1e4;
    addFloor(catalogue, "spot-cone-0.02", spot, 1.0, kPiExact * sqr(1e-3 / 1e4), 2e-6, constant);
    spot.shaping.coneAngle = 90.0F;
    spot.shaping.focus = 1e6F;
    spot.toWorld.t.y = 1e6;
    addFloor(catalogue, "spot-focus-1e6", spot, 1.0, kPiExact * sqr(1e-3 / 1e6), 2e-6, constant);
}

/// What a receiver gets by the light sampler's own samples, on a grid.
double sampled(const LightSampler& sampler, const LightReceiver& receiver, int grid) {
    double sum = 0.0;
    for (int i = 0; i < grid * grid; ++i) {
        const auto choice = static_cast<float>(std::fmod(i * 0.6180339887498949, 1.0) * 0.9999999);
        const Float2 u((static_cast<float>(i % grid) + 0.5F) / static_cast<float>(grid),
                       (std::floor(static_cast<float>(i) / static_cast<float>(grid)) + 0.5F) /
                           static_cast<float>(grid));
        const LightSample s = sampler.sample(receiver, choice, u);
        if (s.pdf > 0.0F) {
            sum += static_cast<double>(s.radiance.x) *
                   std::max(0.0, static_cast<double>(dot(s.wi, receiver.n))) /
                   static_cast<double>(s.pdf);
        }
    }
    return sum / (static_cast<double>(grid) * grid);
}

LightSampler committed(const std::vector<Light>& lights, std::vector<EmissiveTriangle> triangles) {
    std::vector<std::shared_ptr<const Light>> shared;
    shared.reserve(lights.size());
    for (const Light& l : lights) {
        shared.push_back(std::make_shared<const Light>(l));
    }
    Diagnostics diagnostics;
    LightSampler sampler;
    sampler.commit(shared, Double3(0.0), 1.0F, std::move(triangles), diagnostics);
    return sampler;
}

/// A wall that emits stands on the floor: by samples against the closed form, ever nearer to it.
/// E of a perpendicular wall from y = 0 to h, endless in z, at distance x: pi/2 (1 - x / sqrt(x^2 +
/// h^2)); a width of 2e4 stands for endless.
void checkTouchingWall(Report& report, double x) {
    Light wall = light(LightType::kRect, 1.0F);
    wall.width = 20.0F;
    wall.height = 2.0F;
    // Emits along +x, stands on y = 0.
    wall.toWorld.x = {0, 0, 1};
    wall.toWorld.y = {0, 1, 0};
    wall.toWorld.z = {-1, 0, 0};
    wall.toWorld.t = {0, 1, 0};
    TestScene test;
    test.add("/Floor", test::quadMesh({0, 0, 1}, {2, 0, 0}, {0, 0, -2}),
             test::constantMaterial("/M", Rgb(1.0F)));
    test.scene.setLight(wall);
    Camera camera = cameraOfScale({x, 0.01 * x, 0}, 0.05F, x * 1e-2);
    camera.toWorld.y = {0, 0, -1};
    camera.toWorld.z = {0, 1, 0};
    const Estimate e = trace(test, camera, 16, 16, plainOptions(4096, 1));
    // Between two endless planes that meet the view factor of a strip of half width w and height h.
    const double h = 2.0, w = 10.0;
    const double s = std::sqrt(x * x + h * h);
    // Of a vertical rectangle with one foot corner beside the receiver (Howell C-12), twice.
    const double exact = std::atan(w / x) - x / s * std::atan(w / s);
    report.error(score(e, exact / kPiExact));
    report.picture(e.picture("floor"));
}

/// A sphere that lies on the floor, seen at its foot.
void checkTouchingSphere(Report& report, double radius, double share) {
    Light ball = light(LightType::kSphere, 1.0F);
    ball.radius = static_cast<float>(radius);
    ball.toWorld.t = {0, radius, 0};
    TestScene test;
    AffineD toWorld;
    toWorld.x = toWorld.x * radius;
    toWorld.y = toWorld.y * radius;
    toWorld.z = toWorld.z * radius;
    test.add("/Floor", test::quadMesh({-9, 0, 9}, {18, 0, 0}, {0, 0, -18}),
             test::constantMaterial("/M", Rgb(1.0F)), toWorld);
    test.scene.setLight(ball);
    const double x = share * radius;
    // Between the floor and the ball, which is x^2 / 2 above it there.
    const double eye = 0.2 * std::min(0.5 * share * share, 1.0) * radius;
    Camera camera = cameraOfScale({x, eye, 0}, 0.02F, eye * 1e-2);
    camera.toWorld.y = {0, 0, -1};
    camera.toWorld.z = {0, 1, 0};
    const Estimate e = trace(test, camera, 16, 16, plainOptions(256, 1));
    const double exact = std::pow(1.0 + share * share, -1.5);
    // The image spans a little of the floor, over which the value changes.
    const double span = 0.02 * eye / radius;
    report.error(std::max(relativeError(e.mean(), exact) - span, 0.0),
                 [&] { return Text().add("mean", e.mean()).add("exact", exact); });
    report.picture(e.picture("floor"));
}

/// Lights of very different strength: all of them arrive. With `behind` the stronger half stands
/// below the receiver's horizon, so that the weaker half is all there is.
void checkManyStrengths(Report& report, int count, double ratio, bool behind) {
    std::vector<Light> lights;
    double truth = 0.0;
    for (int i = 0; i < count; ++i) {
        Light l = light(LightType::kSphere, 1.0F);
        l.path += std::to_string(i);
        l.radius = 1e-3F;
        const double strength = std::pow(ratio, static_cast<double>(i) / (count - 1));
        l.radiance = Rgb(static_cast<float>(strength));
        // On a circle around the normal, so that each gives its strength's share.
        const double angle = 2.0 * kPiExact * i / count;
        const bool below = behind && i >= count / 2;
        l.toWorld.t = {std::cos(angle), below ? -1.0 : 1.0, std::sin(angle)};
        truth += below ? 0.0
                       : static_cast<double>(l.radiance.x) * kPiExact * 1e-6 / 2.0 * std::sqrt(0.5);
        lights.push_back(l);
    }
    const LightSampler sampler = committed(lights, {});
    const LightReceiver receiver{Float3(0.0F), {0, 1, 0}, false};
    TestRandom random(71);
    std::vector<double> values;
    for (int i = 0; i < 256; ++i) {
        double sum = 0.0;
        for (int j = 0; j < 256; ++j) {
            const float choice = random.nextFloat();
            const LightSample s = sampler.sample(receiver, choice, random.nextFloat2());
            sum += s.pdf > 0.0F ? static_cast<double>(s.radiance.x) *
                                      static_cast<double>(dot(s.wi, receiver.n)) /
                                      static_cast<double>(s.pdf) / 256.0
                                : 0.0;
        }
        values.push_back(sum);
    }
    report.error(std::abs(standardScore(values, truth, 4e-6)),
                 [&] { return Text().add("mean", values.front()).add("exact", truth); });
}

/// Emissive triangles in one place, or as small as they come.
void checkTriangles(Report& report, int count, float size) {
    std::vector<EmissiveTriangle> triangles;
    for (int i = 0; i < count; ++i) {
        EmissiveTriangle t;
        t.p0 = {0.0F, 1.0F, 0.0F};
        t.p1 = {size, 1.0F, 0.0F};
        t.p2 = {0.0F, 1.0F, size};
        t.radiance = Rgb(1.0F);
        t.userId = static_cast<std::uint32_t>(i);
        triangles.push_back(t);
    }
    const LightSampler sampler = committed({}, triangles);
    const double truth = count * 0.5 * sqr(static_cast<double>(size));
    const double e = sampled(sampler, {Float3(0.0F), {0, 1, 0}, false}, 64);
    report.error(relativeError(e, truth), [&] { return Text().add("E", e).add("exact", truth); });
    // The density of a point that a ray met is that of the sample.
    TestRandom random(72);
    const LightReceiver receiver{Float3(0.0F), {0, 1, 0}, false};
    for (int i = 0; i < 256; ++i) {
        const float choice = random.nextFloat();
        const LightSample s = sampler.sample(receiver, choice, random.nextFloat2());
        report.error(
            relativeError(static_cast<double>(sampler.pdfTriangle(s.triangle, receiver, s.point)),
                          static_cast<double>(s.pdf)));
    }
}

void addTouching(Catalogue& catalogue) {
    for (const auto& [name, x] :
         {std::pair("0.1", 0.1), std::pair("1e-3", 1e-3), std::pair("1e-5", 1e-5)}) {
        catalogue.push_back({std::string("light/wall-touches-floor-at-") + name,
                             "radiance of a floor beside a light that stands on it against the "
                             "closed form, score",
                             kLargestZ, kReasonZ,
                             [x = x](Report& report) { checkTouchingWall(report, x); }});
    }
    for (const auto& [name, radius, share] :
         {std::tuple("1-at-0.1", 1.0, 0.1), std::tuple("1-at-1e-2", 1.0, 1e-2),
          std::tuple("1e-6-at-0.1", 1e-6, 0.1), std::tuple("1e6-at-0.1", 1e6, 0.1)}) {
        catalogue.push_back({std::string("light/sphere-on-floor-") + name,
                             "radiance of a floor at the foot of a spherical light against the "
                             "closed form, relative",
                             1.5e-4,
                             "cosines of the visible cone spread by 0.1: the net of a pixel's 256 "
                             "samples leaves a 256th of that, 256 pixels a 16th; 4.89 times that",
                             [radius = radius, share = share](Report& report) {
                                 checkTouchingSphere(report, radius, share);
                             }});
    }
}

/// A light as large as the sky just above the floor, sampled by area: scattering finds it.
void checkHuge(Report& report) {
    Light l = light(LightType::kRect, 1.0F);
    l.width = l.height = 1e6F;
    hang(l, 1e2);
    const Estimate e = renderFloor({l}, 1.0, 1024);
    report.error(score(e, 1.0 / (1.0 + sqr(1e2 / 5e5))));
    report.picture(e.picture("floor"));
}

} // namespace

void addLights(Catalogue& catalogue) {
    addSuns(catalogue);
    addSmall(catalogue);
    addTouching(catalogue);
    catalogue.push_back({"light/rect-area-1e12",
                         "radiance of a floor under a light of a million "
                         "units against the closed form, score",
                         kLargestZ, kReasonZ, checkHuge});
    for (const auto& [name, count, ratio] :
         {std::tuple("1e12-of-2", 2, 1e12), std::tuple("1e12-of-100", 100, 1e12),
          std::tuple("1e30-of-1000", 1000, 1e30)}) {
        for (const bool behind : {false, true}) {
            catalogue.push_back(
                {std::string("light/strengths-") + name + (behind ? "-strong-behind" : ""),
                 std::string("irradiance of lights of very different strength") +
                     (behind ? ", the stronger half behind the floor," : "") +
                     " against the sum, score",
                 kLargestZ, kReasonZ, [count = count, ratio = ratio, behind](Report& report) {
                     checkManyStrengths(report, count, ratio, behind);
                 }});
        }
    }
    for (const auto& [name, count, size] :
         {std::tuple("one-1e-8", 1, 1e-8F), std::tuple("thousand-in-one-place", 1000, 1e-3F)}) {
        catalogue.push_back({std::string("light/triangles-") + name,
                             "irradiance of emissive triangles against the closed form, and "
                             "densities told twice, relative",
                             2e-6, "every sample is the same to some tens of roundings",
                             [count = count, size = size](Report& report) {
                                 checkTriangles(report, count, size);
                             }});
    }
}

} // namespace mbfeat::stability
