// Whole paths where ray offsets are hard: scales, far places, coplanar, interpenetrating and closed
// surfaces, shells of glass.
#include "families.h"

#include "core/frame.h"
#include "rendering.h"

namespace mbfeat::stability {

namespace {

using test::TestScene;

Material white(const std::string& path) {
    return test::constantMaterial(path, Rgb(1.0F));
}

/// Passes light on unbent; its interface cannot be seen but is met.
Material clearGlass(float ior) {
    Material glass = white("/M/Glass");
    glass.opacity = MaterialInput(0.0F);
    glass.roughness = MaterialInput(0.0F);
    glass.ior = MaterialInput(ior);
    return glass;
}

/// A convex grey body of flat facets in a white sky, seen from outside.
struct BodyView {
    double scale = 1.0;
    Double3 place{0.0, 0.0, 0.0};
    bool instanced = false;
    Double3 stretch{1.0, 1.0, 1.0}; ///< along its axes, before it is turned
};

Estimate renderBody(const BodyView& view, TestScene& test) {
    AffineD toWorld = skew(view.scale);
    toWorld.x = toWorld.x * view.stretch.x;
    toWorld.y = toWorld.y * view.stretch.y;
    toWorld.z = toWorld.z * view.stretch.z;
    toWorld.t = view.place;
    const Material grey = test::constantMaterial("/M/Body", Rgb(0.5F));
    if (view.instanced) {
        test.addInstances("/Body", facetedSphere(1.0F, 24), grey, {toWorld});
    } else {
        test.add("/Body", facetedSphere(1.0F, 24), grey, toWorld);
    }
    test.addSky(Rgb(1.0F));
    const double least = std::min(view.stretch.x, std::min(view.stretch.y, view.stretch.z));
    const Double3 eye = view.place + Double3(0.0, 0.0, 4.0 * view.scale);
    return trace(test, cameraOfScale(eye, static_cast<float>(0.12 * least), view.scale), 16, 16,
                 plainOptions(64));
}

void addBody(Catalogue& catalogue, const std::string& name, const BodyView& view,
             bool withStranger = false) {
    const auto render = [=] {
        TestScene test;
        if (withStranger) {
            test.add("/Far", facetedSphere(1.0F, 8), white("/M/Far"));
        }
        return renderBody(view, test);
    };
    catalogue.push_back({"placement/" + name + "-self-hits",
                         "pixels with a path that met the convex body twice, as a share", 0.0,
                         "rays that leave a convex body meet it nowhere", [=](Report& report) {
                             const Estimate estimate = render();
                             report.error(estimate.shareAbove(1));
                             report.picture(estimate.picture("body"));
                         }});
    catalogue.push_back({"placement/" + name + "-albedo",
                         "radiance of the body in a white sky against its albedo, score", kLargestZ,
                         kReasonZ, [=](Report& report) {
                             const Estimate estimate = render();
                             report.error(score(estimate, 0.5));
                             report.picture(estimate.picture("body"));
                         }});
}

void addBodies(Catalogue& catalogue) {
    for (const auto& [name, scale] : {std::pair("1e-6", 1e-6), std::pair("1e-3", 1e-3),
                                      std::pair("1e3", 1e3), std::pair("1e6", 1e6)}) {
        BodyView view;
        view.scale = scale;
        view.instanced = true;
        addBody(catalogue, std::string("instance-scale-") + name, view);
    }
    BodyView flat;
    flat.instanced = true;
    flat.stretch = {1.0, 1e-2, 1e2};
    addBody(catalogue, "instance-stretched", flat);
    BodyView away;
    away.place = {1e7, -1e7, 1e7};
    addBody(catalogue, "far-1e7-baked", away);
    away.instanced = true;
    addBody(catalogue, "far-1e7-instance", away);
    // Something at the world's origin keeps render space from moving to the body.
    away.scale = 1e3;
    addBody(catalogue, "far-1e7-of-two-instance", away, true);
    away.instanced = false;
    addBody(catalogue, "far-1e7-of-two-baked", away, true);
}

/// `count` concentric hollow shells of glass, walls and gaps of the same width.
void addShells(TestScene& test, int count, double width, const Material& glass, double scale) {
    for (int i = 0; i < 2 * count; ++i) {
        // The outside of glass is where the front is.
        const bool inner = i % 2 != 0;
        test.add("/Shell" + std::to_string(i), facetedSphere(1.0F, 32, inner), glass,
                 skew(scale * (1.0 - i * width)));
    }
}

/// `count` panes at the origin, turned away from the axes a little; glass and gaps as wide.
void addPanes(TestScene& test, int count, double width, const Material& glass, double scale) {
    for (int i = 0; i < 2 * count; ++i) {
        const auto z = static_cast<float>(-i * width);
        const bool back = i % 2 != 0;
        // No larger than need be: the error bound of a point grows with its triangle.
        const Float3 u = back ? Float3(0, 3, 0) : Float3(3, 0, 0);
        const Float3 v = back ? Float3(3, 0, 0) : Float3(0, 3, 0);
        AffineD toWorld;
        toWorld.x = Double3(0.96, 0.0, 0.28) * scale;
        toWorld.y = Double3(0.0, 1.0, 0.0) * scale;
        toWorld.z = Double3(-0.28, 0.0, 0.96) * scale;
        test.add("/Pane" + std::to_string(i), test::quadMesh({-1.5F, -1.5F, z}, u, v), glass,
                 toWorld);
    }
}

void addGlass(Catalogue& catalogue) {
    constexpr int kShells = 3;
    for (const auto& [name, width] :
         {std::pair("1e-3", 1e-3), std::pair("1e-4", 1e-4), std::pair("1e-5", 1e-5)}) {
        catalogue.push_back(
            {std::string("placement/shells-met-width-") + name,
             "segments a path of three unbending hollow shells against thirteen", 0.0,
             "every interface is met once; widths are above the error bound of points at "
             "distance 1, which is 2e-6",
             [width = width](Report& report) {
                 TestScene test;
                 addShells(test, kShells, width, clearGlass(1.0F), 1.0);
                 test.addSky(Rgb(1.0F));
                 const Estimate e =
                     trace(test, test::testCamera({0, 0, 4}, 0.1F), 32, 32, plainOptions(64));
                 const double segments = static_cast<double>(e.rays) / static_cast<double>(e.paths);
                 report.error(std::abs(segments - (4.0 * kShells + 1.0)),
                              [&] { return Text().add("segments", segments); });
             }});
    }
    for (const auto& [name, width, scale, ior] :
         {std::tuple("width-1e-3", 1e-3, 1.0, 1.5F), std::tuple("width-1e-5", 1e-5, 1.0, 1.5F),
          std::tuple("width-1e-3-scale-1e-6", 1e-3, 1e-6, 1.5F),
          std::tuple("width-1e-3-index-10", 1e-3, 1.0, 10.0F)}) {
        catalogue.push_back(
            {std::string("placement/panes-furnace-") + name,
             "radiance through three panes of glass in a white sky against 1, relative", 1e-5,
             "weights of a smooth interface are 1 to two roundings, and the mean path of a pixel "
             "meets some tens of the at most 1024 interfaces: 80 x 2 x 6e-8",
             [width = width, scale = scale, ior = ior](Report& report) {
                 TestScene test;
                 addPanes(test, kShells, width, clearGlass(ior), scale);
                 test.addSky(Rgb(1.0F));
                 const Estimate e = trace(test, cameraOfScale({0, 0, 4 * scale}, 0.2F, scale), 32,
                                          32, plainOptions(64, 1024));
                 for (const double v : e.grey()) {
                     report.error(relativeError(v, 1.0), [&] { return Text().add("radiance", v); });
                 }
                 report.picture(e.picture("panes"));
             }});
    }
}

/// A box with its inside, or its outside, as the front; flat or turned, of any size and place.
std::shared_ptr<Mesh> boxMesh() {
    auto mesh = std::make_shared<Mesh>();
    for (int i = 0; i < 8; ++i) {
        mesh->points.emplace_back((i & 1) != 0 ? 1.0F : -1.0F, (i & 2) != 0 ? 1.0F : -1.0F,
                                  (i & 4) != 0 ? 1.0F : -1.0F);
    }
    const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        mesh->triangles.push_back({{q[0], q[1], q[2]}});
        mesh->triangles.push_back({{q[0], q[2], q[3]}});
    }
    return mesh;
}

void addClosed(Catalogue& catalogue) {
    for (const auto& [name, scale, offset] :
         {std::tuple("unit", 1.0, 0.0), std::tuple("scale-1e-6", 1e-6, 0.0),
          std::tuple("scale-1e6", 1e6, 0.0), std::tuple("far-1e7", 1.0, 1e7)}) {
        catalogue.push_back(
            {std::string("placement/closed-box-") + name,
             "light of a bright sky inside a closed grey box", 0.0,
             "neither edges nor corners let rays through",
             [scale = scale, offset = offset](Report& report) {
                 TestScene test;
                 AffineD toWorld = skew(scale);
                 toWorld.t = {offset, offset, offset};
                 test.add("/Box", boxMesh(), test::constantMaterial("/M", Rgb(0.9F)), toWorld);
                 test.addSky(Rgb(1e6F));
                 const Estimate e =
                     trace(test, cameraOfScale({offset, offset, offset + 0.1 * scale}, 2.0F, scale),
                           32, 32, plainOptions(64, 16));
                 for (const double v : e.grey()) {
                     report.error(v);
                 }
                 report.picture(e.picture("inside"));
             }});
    }
    catalogue.push_back(
        {"placement/interpenetrating-furnace",
         "radiance of interpenetrating white boxes in a white sky against 1, score", kLargestZ,
         kReasonZ, [](Report& report) {
             TestScene test;
             for (int i = 0; i < 6; ++i) {
                 AffineD toWorld = skew(0.7 + 0.1 * i);
                 toWorld.t = {0.2 * i - 0.5, 0.1 * (i % 3), 0.15 * (i % 2)};
                 std::swap(toWorld.x, i % 2 == 0 ? toWorld.y : toWorld.z);
                 test.add("/Box" + std::to_string(i), boxMesh(), white("/M"), toWorld);
             }
             test.addSky(Rgb(1.0F));
             RenderOptions options = plainOptions(256, 1024);
             options.russianRouletteStart = 64;
             const Estimate e = trace(test, test::testCamera({0, 0, 6}, 0.4F), 16, 16, options);
             report.error(score(e, 1.0));
             report.picture(e.picture("boxes"));
         }});
}

/// Two floors in one plane, one of two triangles, the other of many.
std::shared_ptr<Mesh> gridMesh(int cells) {
    auto mesh = std::make_shared<Mesh>();
    for (int j = 0; j <= cells; ++j) {
        for (int i = 0; i <= cells; ++i) {
            const auto at = [&](int k) {
                return 2.0F * static_cast<float>(k) / static_cast<float>(cells) - 1.0F;
            };
            mesh->points.emplace_back(at(i), at(j), 0.0F);
        }
    }
    const auto index = [&](int i, int j) {
        return static_cast<std::uint32_t>(j * (cells + 1) + i);
    };
    for (int j = 0; j < cells; ++j) {
        for (int i = 0; i < cells; ++i) {
            mesh->triangles.push_back({{index(i, j), index(i + 1, j), index(i + 1, j + 1)}});
            mesh->triangles.push_back({{index(i, j), index(i + 1, j + 1), index(i, j + 1)}});
        }
    }
    return mesh;
}

void addFlat(Catalogue& catalogue) {
    const auto coplanar = [](bool turned, int cells) {
        return [=](Report& report) {
            TestScene test;
            const AffineD toWorld = turned ? skew(3.0) : AffineD();
            const Material grey = test::constantMaterial("/M", Rgb(0.5F));
            test.add("/One", gridMesh(1), grey, toWorld);
            test.add("/Two", gridMesh(cells), grey, toWorld);
            test.addSky(Rgb(1.0F));
            const Double3 normal = normalize(toWorld.z);
            Camera camera = test::testCamera(normal * 3.0, 0.15F);
            // Looks along -z of its own space, onto the floor.
            const Frame<double> frame = Frame<double>::fromNormal(normal);
            camera.toWorld.x = frame.s;
            camera.toWorld.y = frame.t;
            camera.toWorld.z = frame.n;
            const Estimate e = trace(test, camera, 16, 16, plainOptions(256));
            report.error(e.shareAbove(1));
            report.picture(e.picture("floor"));
        };
    };
    catalogue.push_back({"placement/coplanar-same",
                         "pixels with a path between two floors that "
                         "lie in one plane, as a share",
                         0.0, "equal triangles are at equal places", coplanar(true, 1)});
    catalogue.push_back({"placement/coplanar-level",
                         "pixels with a path between two floors in one level plane, as a share",
                         0.0, "points of a level plane are exact", coplanar(false, 7)});
    catalogue.push_back({"placement/coplanar-turned",
                         "pixels with a path between two floors in one skew plane, as a share", 0.0,
                         "offsets cover what rounding can move a plane of other triangles by",
                         coplanar(true, 7)});
    for (const auto& [name, height] : {std::pair("1e-2", 1e-2), std::pair("1e-4", 1e-4)}) {
        catalogue.push_back(
            {std::string("placement/grazing-camera-") + name,
             "radiance of a grey floor seen at a grazing angle in a white sky, score", kLargestZ,
             kReasonZ, [height = height](Report& report) {
                 TestScene test;
                 test.add("/Floor", test::quadMesh({-100, 0, 100}, {200, 0, 0}, {0, 0, -200}),
                          test::constantMaterial("/M", Rgb(0.5F)));
                 test.addSky(Rgb(1.0F));
                 Camera camera = cameraOfScale({0, height, 0}, 1e-3F, 1.0);
                 // Below the horizon only.
                 camera.windowMax.y = static_cast<float>(-0.02 * height);
                 camera.windowMin.y = static_cast<float>(-0.9 * height);
                 camera.nearClip = 1e-6F;
                 const Estimate e = trace(test, camera, 16, 16, plainOptions(64));
                 report.error(score(e, 0.5));
                 report.error(e.shareAbove(1) > 0.0 ? 100.0 : 0.0,
                              [] { return std::string("the floor lights itself"); });
                 report.picture(e.picture("floor"));
             }});
    }
}

} // namespace

void addPlacements(Catalogue& catalogue) {
    addBodies(catalogue);
    addGlass(catalogue);
    addClosed(catalogue);
    addFlat(catalogue);
}

} // namespace mbfeat::stability
