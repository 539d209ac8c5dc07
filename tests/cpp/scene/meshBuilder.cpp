// The mesh builder: triangulation, validation, and what happens to bad data.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "scene/meshBuilder.h"

using namespace mbfeat;

namespace {

/// Owns the arrays that a RawMesh points at.
struct Polygons {
    std::vector<float> points;
    std::vector<int> counts, indices, holes;

    RawMesh raw() const {
        RawMesh raw;
        raw.path = "/World/mesh";
        raw.points = points;
        raw.faceVertexCounts = counts;
        raw.faceVertexIndices = indices;
        raw.holeIndices = holes;
        return raw;
    }
};

Polygons unitSquare() {
    return {{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {4}, {0, 1, 2, 3}, {}};
}

/// Two triangles and a quad in a row: faces of several sizes.
Polygons mixedFaces() {
    return {{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0, 2, 1, 0},
            {3, 3, 4},
            {0, 1, 2, 0, 2, 3, 1, 4, 5, 2},
            {}};
}

Double3 areaOf(const Mesh& mesh, std::size_t t) {
    const Triangle& triangle = mesh.triangles[t];
    const Double3 a(mesh.points[triangle.v[0]]);
    return cross(Double3(mesh.points[triangle.v[1]]) - a, Double3(mesh.points[triangle.v[2]]) - a) *
           0.5;
}

double totalAreaZ(const Mesh& mesh) {
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        sum += areaOf(mesh, t).z;
    }
    return sum;
}

/// A single polygon in the plane z = 0.
Polygons planar(const std::vector<Float2>& corners) {
    Polygons p;
    for (const Float2& c : corners) {
        p.indices.push_back(static_cast<int>(p.points.size() / 3));
        p.points.insert(p.points.end(), {c.x, c.y, 0.0F});
    }
    p.counts = {static_cast<int>(corners.size())};
    return p;
}

double shoelace(const std::vector<Float2>& c) {
    double sum = 0.0;
    for (std::size_t i = 0; i < c.size(); ++i) {
        const Float2& a = c[i];
        const Float2& b = c[(i + 1) % c.size()];
        sum += static_cast<double>(a.x) * static_cast<double>(b.y) -
               static_cast<double>(b.x) * static_cast<double>(a.y);
    }
    return 0.5 * sum;
}

/// Each triangle of a simple counter-clockwise polygon is counter-clockwise, and they fill it.
void checkFills(const std::vector<Float2>& corners) {
    Diagnostics diagnostics;
    const auto mesh = buildMesh(planar(corners).raw(), diagnostics);
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh->triangles.size(); ++t) {
        CHECK(areaOf(*mesh, t).z > 0.0);
        sum += areaOf(*mesh, t).z;
    }
    CHECK(sum == doctest::Approx(shoelace(corners)).epsilon(1e-6));
    CHECK(mesh->triangles.size() <= corners.size() - 2);
    CHECK(diagnostics.count(Severity::kWarning) == 0);
}

RawAttribute attribute(const char* name, RawInterpolation interpolation, int width,
                       const std::vector<float>& values) {
    RawAttribute a;
    a.name = name;
    a.interpolation = interpolation;
    a.width = width;
    a.values = values;
    return a;
}

std::string onlyMessage(const Diagnostics& diagnostics) {
    REQUIRE(diagnostics.messages().size() == 1);
    return diagnostics.messages()[0].text;
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

} // namespace

TEST_CASE("a quad becomes two triangles in its winding order") {
    Diagnostics diagnostics;
    const Polygons square = unitSquare();
    const auto mesh = buildMesh(square.raw(), diagnostics);
    REQUIRE(mesh->triangles.size() == 2);
    CHECK(areaOf(*mesh, 0).z == 0.5);
    CHECK(areaOf(*mesh, 1).z == 0.5);
    CHECK(mesh->triangleFaces == std::vector<std::uint32_t>{0, 0});
    CHECK(mesh->triangleMaterials.empty());
    CHECK(diagnostics.messages().empty());
}

TEST_CASE("left-handed faces are reversed") {
    Diagnostics diagnostics;
    const Polygons square = unitSquare();
    RawMesh raw = square.raw();
    raw.leftHanded = true;
    const auto mesh = buildMesh(raw, diagnostics);
    CHECK(totalAreaZ(*mesh) == -1.0);
}

TEST_CASE("a mesh of triangles keeps no face table; others map triangles to faces") {
    Diagnostics diagnostics;
    Polygons triangles = mixedFaces();
    triangles.counts = {3, 3};
    triangles.indices.resize(6);
    CHECK(buildMesh(triangles.raw(), diagnostics)->triangleFaces.empty());
    const Polygons mixed = mixedFaces();
    const auto mesh = buildMesh(mixed.raw(), diagnostics);
    REQUIRE(mesh->triangles.size() == 4);
    for (std::uint32_t t = 0; t < 4; ++t) {
        CHECK(mesh->faceOf(t) == (t < 2 ? t : 2U));
    }
}

TEST_CASE("concave quads are cut along the diagonal inside them") {
    for (int start = 0; start < 4; ++start) {
        std::vector<Float2> arrow = {{0, 0}, {2, -1}, {0.5F, 0}, {2, 1}};
        arrow = {{0, 0}, {2, -1}, {0.5F, 0.0F}, {2, 1}};
        std::rotate(arrow.begin(), arrow.begin() + start, arrow.end());
        checkFills(arrow);
    }
}

TEST_CASE("convex and concave polygons are filled exactly") {
    std::vector<Float2> circle;
    std::vector<Float2> star;
    for (int i = 0; i < 20; ++i) {
        const float angle = kTwoPi * static_cast<float>(i) / 20.0F;
        circle.push_back({cos(angle), sin(angle)});
        const float radius = i % 2 == 0 ? 1.0F : 0.3F;
        star.push_back({radius * cos(angle), radius * sin(angle)});
    }
    checkFills(circle);
    checkFills(star);
    // A spiral and a comb.
    checkFills({{0, 0}, {10, 0}, {10, 10}, {1, 10}, {1, 2}, {8, 2}, {8, 8}, {3, 8},
                {3, 4}, {6, 4},  {6, 6},   {5, 6},  {5, 5}, {4, 5}, {4, 7}, {7, 7},
                {7, 3}, {2, 3},  {2, 9},   {9, 9},  {9, 1}, {0, 1}});
    std::vector<Float2> comb;
    for (int i = 0; i < 50; ++i) {
        comb.push_back({static_cast<float>(i), i % 2 == 0 ? 1.0F : 9.0F});
    }
    comb.push_back({49, 10});
    comb.push_back({0, 10});
    std::reverse(comb.begin(), comb.end());
    if (shoelace(comb) < 0) {
        std::reverse(comb.begin(), comb.end());
    }
    checkFills(comb);
}

TEST_CASE("random star-shaped polygons in any plane are filled") {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(0.05F, 1.0F);
    for (int trial = 0; trial < 200; ++trial) {
        const int n = 5 + trial % 40;
        const Float3 axis = normalize(
            Float3(uniform(random) - 0.5F, uniform(random) - 0.5F, uniform(random) - 0.5F));
        const Float3 side = normalize(cross(axis, Float3(0.3F, 0.8F, 0.5F)));
        const Float3 up = cross(axis, side);
        std::vector<Float3> points;
        Double3 expected(0.0);
        for (int i = 0; i < n; ++i) {
            const float angle = kTwoPi * static_cast<float>(i) / static_cast<float>(n);
            const float radius = uniform(random);
            points.push_back(side * (radius * cos(angle)) + up * (radius * sin(angle)));
        }
        for (int i = 0; i < n; ++i) {
            expected += cross(Double3(points[static_cast<std::size_t>(i)]),
                              Double3(points[static_cast<std::size_t>((i + 1) % n)]));
        }
        std::vector<std::uint32_t> triangles;
        triangulatePolygon(points, triangles);
        REQUIRE(triangles.size() == static_cast<std::size_t>(3 * (n - 2)));
        double signedArea = 0.0;
        double area = 0.0;
        for (std::size_t t = 0; t < triangles.size(); t += 3) {
            const Double3 a(points[triangles[t]]);
            const Double3 normal =
                cross(Double3(points[triangles[t + 1]]) - a, Double3(points[triangles[t + 2]]) - a);
            signedArea += dot(normal, Double3(axis));
            area += length(normal);
        }
        CHECK(signedArea == doctest::Approx(dot(expected, Double3(axis))).epsilon(1e-4));
        CHECK(area == doctest::Approx(length(expected)).epsilon(1e-4));
    }
}

TEST_CASE("polygons that intersect or repeat themselves still become n - 2 triangles") {
    std::mt19937 random(11);
    std::uniform_int_distribution<int> grid(0, 4);
    for (int trial = 0; trial < 300; ++trial) {
        std::vector<Float3> points;
        const int n = 5 + trial % 30;
        for (int i = 0; i < n; ++i) {
            points.emplace_back(static_cast<float>(grid(random)), static_cast<float>(grid(random)),
                                trial % 3 == 0 ? static_cast<float>(grid(random)) : 0.0F);
        }
        std::vector<std::uint32_t> triangles;
        triangulatePolygon(points, triangles);
        CHECK(triangles.size() == static_cast<std::size_t>(3 * (n - 2)));
        for (const std::uint32_t corner : triangles) {
            CHECK(corner < static_cast<std::uint32_t>(n));
        }
    }
}

TEST_CASE("holes are left out and subsets choose material slots") {
    Diagnostics diagnostics;
    Polygons mixed = mixedFaces();
    mixed.holes = {1};
    RawMesh raw = mixed.raw();
    const std::vector<int> first = {0};
    const std::vector<int> second = {2, 0};
    raw.subsets = {{"/World/mesh/a", first, 2}, {"/World/mesh/b", second, 1}};
    const auto mesh = buildMesh(raw, diagnostics);
    REQUIRE(mesh->triangles.size() == 3);
    CHECK(mesh->triangleFaces == std::vector<std::uint32_t>{0, 2, 2});
    CHECK(mesh->triangleMaterials == std::vector<std::uint16_t>{2, 1, 1});
    CHECK(contains(onlyMessage(diagnostics), "1 faces of /World/mesh are in an earlier subset"));
    CHECK(diagnostics.messages()[0].subject == "/World/mesh/b");
}

TEST_CASE("subset and hole indices that name no face are ignored with a message") {
    Diagnostics diagnostics;
    Polygons mixed = mixedFaces();
    mixed.holes = {-1, 3, 99};
    RawMesh raw = mixed.raw();
    const std::vector<int> faces = {1, 3, -7};
    raw.subsets = {{"/World/mesh/a", faces, 1}};
    const auto mesh = buildMesh(raw, diagnostics);
    CHECK(mesh->triangleMaterials == std::vector<std::uint16_t>{0, 1, 0, 0});
    REQUIRE(diagnostics.messages().size() == 2);
    CHECK(contains(diagnostics.messages()[0].text, "3 hole indices name no face"));
    CHECK(contains(diagnostics.messages()[1].text, "2 indices name no face of /World/mesh"));
}

TEST_CASE("faces with an index out of range are dropped, the rest is kept") {
    Diagnostics diagnostics;
    Polygons mixed = mixedFaces();
    mixed.indices[1] = 6;
    mixed.indices[3] = -1;
    const auto mesh = buildMesh(mixed.raw(), diagnostics);
    CHECK(mesh->triangles.size() == 2);
    CHECK(mesh->triangleFaces == std::vector<std::uint32_t>{2, 2});
    CHECK(contains(onlyMessage(diagnostics), "2 of 3 faces with a vertex index out of range"));
}

TEST_CASE("faces at points that are not finite are dropped, and all points are finite") {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Diagnostics diagnostics;
        Polygons mixed = mixedFaces();
        mixed.points[4 * 3 + 1] = bad;
        const auto mesh = buildMesh(mixed.raw(), diagnostics);
        CHECK(mesh->triangles.size() == 2);
        for (const Float3& point : mesh->points) {
            CHECK(isFinite(point));
        }
        CHECK(contains(onlyMessage(diagnostics), "1 of 3 faces with a point that is not finite"));
    }
}

TEST_CASE("faces of fewer than three vertices and negative counts are dropped") {
    Diagnostics diagnostics;
    Polygons p = unitSquare();
    p.counts = {2, -3, 0, 3};
    p.indices = {0, 1, 0, 1, 2};
    const auto mesh = buildMesh(p.raw(), diagnostics);
    REQUIRE(mesh->triangles.size() == 1);
    CHECK(mesh->faceOf(0) == 3);
    CHECK(contains(onlyMessage(diagnostics), "3 of 4 faces with fewer than three vertices"));
}

TEST_CASE("counts and indices that disagree cost only the faces concerned") {
    Diagnostics diagnostics;
    Polygons mixed = mixedFaces();
    mixed.indices.pop_back();
    CHECK(buildMesh(mixed.raw(), diagnostics)->triangles.size() == 2);
    CHECK(contains(onlyMessage(diagnostics), "1 of 3 faces without vertex indices"));
    diagnostics.clear();
    mixed = mixedFaces();
    mixed.counts.pop_back();
    CHECK(buildMesh(mixed.raw(), diagnostics)->triangles.size() == 2);
    CHECK(contains(onlyMessage(diagnostics), "the others are ignored"));
}

TEST_CASE("empty and senseless meshes give no triangles and no crash") {
    Diagnostics diagnostics;
    CHECK(buildMesh(RawMesh(), diagnostics)->triangles.empty());
    Polygons p;
    p.counts = {3, 4, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()};
    p.indices = {0, 1, 2};
    CHECK(buildMesh(p.raw(), diagnostics)->triangles.empty());
    p.points = {0, 0};
    CHECK(buildMesh(p.raw(), diagnostics)->points.empty());
}

TEST_CASE("triangles without area are left out") {
    Diagnostics diagnostics;
    Polygons p = unitSquare();
    p.counts = {3, 3, 3};
    p.indices = {0, 0, 1, 0, 1, 2, 3, 3, 3};
    const auto mesh = buildMesh(p.raw(), diagnostics);
    REQUIRE(mesh->triangles.size() == 1);
    CHECK(mesh->faceOf(0) == 1);
    CHECK(contains(onlyMessage(diagnostics), "2 triangles without area"));
    CHECK(diagnostics.count(Severity::kWarning) == 0);
    // Tiny is not degenerate; sizes whose normals overflow in float are.
    Polygons tiny = planar({{0, 0}, {1e-15F, 0}, {0, 1e-15F}});
    CHECK(buildMesh(tiny.raw(), diagnostics)->triangles.size() == 1);
    Polygons huge = planar({{0, 0}, {1e30F, 0}, {0, 1e30F}});
    CHECK(buildMesh(huge.raw(), diagnostics)->triangles.empty());
}

TEST_CASE("primvars of every interpolation reach the triangles") {
    Diagnostics diagnostics;
    const Polygons mixed = mixedFaces();
    RawMesh raw = mixed.raw();
    const std::vector<float> constant = {7, 8};
    const std::vector<float> uniform = {10, 20, 30};
    const std::vector<float> vertex = {0, 1, 2, 3, 4, 5};
    const std::vector<float> corners = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    raw.primvars = {attribute("constant", RawInterpolation::kConstant, 2, constant),
                    attribute("uniform", RawInterpolation::kUniform, 1, uniform),
                    attribute("varying", RawInterpolation::kVarying, 1, vertex),
                    attribute("vertex", RawInterpolation::kVertex, 1, vertex),
                    attribute("faceVarying", RawInterpolation::kFaceVarying, 1, corners)};
    const auto mesh = buildMesh(raw, diagnostics);
    CHECK(diagnostics.messages().empty());
    CHECK(mesh->findPrimvar("constant")->values == constant);
    CHECK(mesh->findPrimvar("uniform")->values == uniform);
    CHECK(mesh->findPrimvar("varying")->interpolation == Interpolation::kVertex);
    CHECK(mesh->findPrimvar("vertex")->values == vertex);
    const Attribute* faceVarying = mesh->findPrimvar("faceVarying");
    CHECK(faceVarying->interpolation == Interpolation::kFaceVarying);
    CHECK(faceVarying->values == std::vector<float>{0, 1, 2, 3, 4, 5, 6, 7, 8, 6, 8, 9});
}

TEST_CASE("face-varying values follow the corners of reversed faces") {
    Diagnostics diagnostics;
    Polygons p = mixedFaces();
    p.counts = {3, 3};
    p.indices = {0, 1, 2, 0, 2, 3};
    RawMesh raw = p.raw();
    raw.leftHanded = true;
    const std::vector<float> values = {0, 1, 2, 3, 4, 5};
    raw.primvars = {attribute("st", RawInterpolation::kFaceVarying, 1, values)};
    const auto mesh = buildMesh(raw, diagnostics);
    CHECK(mesh->triangles[0].v[1] == 2);
    CHECK(mesh->findPrimvar("st")->values == std::vector<float>{0, 2, 1, 3, 5, 4});
}

TEST_CASE("face-varying values that agree at every point are kept per point") {
    Diagnostics diagnostics;
    const Polygons mixed = mixedFaces();
    RawMesh raw = mixed.raw();
    std::vector<float> values;
    for (const int index : mixed.indices) {
        values.push_back(static_cast<float>(index) * 0.5F);
        values.push_back(1.0F);
    }
    const std::vector<float> palette = {5, 6, 7, 8, 9, 10};
    RawAttribute indexed = attribute("indexed", RawInterpolation::kFaceVarying, 1, palette);
    indexed.indexed = true;
    indexed.indices = mixed.indices;
    raw.primvars = {attribute("st", RawInterpolation::kFaceVarying, 2, values), indexed};
    const auto mesh = buildMesh(raw, diagnostics);
    const Attribute* st = mesh->findPrimvar("st");
    CHECK(st->interpolation == Interpolation::kVertex);
    CHECK(st->values == std::vector<float>{0, 1, 0.5F, 1, 1, 1, 1.5F, 1, 2, 1, 2.5F, 1});
    CHECK(mesh->findPrimvar("indexed")->values == palette);
}

TEST_CASE("indexed primvars are resolved") {
    Diagnostics diagnostics;
    const Polygons mixed = mixedFaces();
    RawMesh raw = mixed.raw();
    const std::vector<float> palette = {1, 2, 3, 4, 5, 6};
    const std::vector<int> perFace = {1, 0, 1};
    RawAttribute a = attribute("displayColor", RawInterpolation::kUniform, 3, palette);
    a.indexed = true;
    a.indices = perFace;
    raw.primvars = {a};
    const auto mesh = buildMesh(raw, diagnostics);
    CHECK(mesh->findPrimvar("displayColor")->values ==
          std::vector<float>{4, 5, 6, 1, 2, 3, 4, 5, 6});
}

TEST_CASE(
    "primvars that are empty, of the wrong size or badly indexed are dropped with a message") {
    const Polygons mixed = mixedFaces();
    const std::vector<float> none;
    const std::vector<float> five = {1, 2, 3, 4, 5};
    const std::vector<int> bad = {0, 1, 9};
    const std::vector<int> negative = {0, -1, 1};
    const std::vector<int> noIndices;
    struct Case {
        RawAttribute attribute;
        const char* message;
    };
    const auto withIndices = [](RawAttribute a, const std::vector<int>& indices) {
        a.indexed = true;
        a.indices = indices;
        return a;
    };
    const RawAttribute uniform = attribute("x", RawInterpolation::kUniform, 1, five);
    const Case cases[] = {
        {attribute("x", RawInterpolation::kVertex, 2, none), "has no values"},
        {attribute("x", RawInterpolation::kVertex, 2, five), "incomplete last value"},
        {attribute("x", RawInterpolation::kVertex, 1, five), "vertex interpolation needs 6"},
        {attribute("x", RawInterpolation::kVarying, 1, five), "varying interpolation needs 6"},
        {uniform, "uniform interpolation needs 3"},
        {attribute("x", RawInterpolation::kFaceVarying, 1, five), "interpolation needs 10"},
        {attribute("x", RawInterpolation::kConstant, 1, none), "has no values"},
        {withIndices(uniform, bad), "has the index 9, but 5 values"},
        {withIndices(uniform, negative), "has the index -1"},
        {withIndices(uniform, noIndices), "has 0 indices"},
    };
    for (const Case& c : cases) {
        Diagnostics diagnostics;
        RawMesh raw = mixed.raw();
        raw.primvars = {c.attribute};
        const auto mesh = buildMesh(raw, diagnostics);
        CHECK(mesh->triangles.size() == 4);
        CHECK(mesh->findPrimvar("x") == nullptr);
        const std::string text = onlyMessage(diagnostics);
        CHECK_MESSAGE(contains(text, c.message), text);
        CHECK(contains(text, "'x'"));
        CHECK(diagnostics.messages()[0].subject == "/World/mesh");
    }
}

TEST_CASE("primvar values that are not finite become zero") {
    Diagnostics diagnostics;
    const Polygons square = unitSquare();
    RawMesh raw = square.raw();
    const std::vector<float> values = {1, std::numeric_limits<float>::quiet_NaN(),
                                       -std::numeric_limits<float>::infinity(), 4};
    raw.primvars = {attribute("x", RawInterpolation::kVertex, 1, values)};
    const auto mesh = buildMesh(raw, diagnostics);
    CHECK(mesh->findPrimvar("x")->values == std::vector<float>{1, 0, 0, 4});
    CHECK(contains(onlyMessage(diagnostics), "2 numbers that are not finite"));
}

TEST_CASE("smooth normals of a sphere point outwards, in either orientation") {
    constexpr int kRings = 24;
    constexpr int kSides = 48;
    Polygons p;
    for (int i = 0; i <= kRings; ++i) {
        for (int j = 0; j < kSides; ++j) {
            const float theta = kPi * static_cast<float>(i) / kRings;
            const float phi = kTwoPi * static_cast<float>(j) / kSides;
            p.points.insert(p.points.end(),
                            {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)});
        }
    }
    for (int i = 0; i < kRings; ++i) {
        for (int j = 0; j < kSides; ++j) {
            const int k = (j + 1) % kSides;
            p.counts.push_back(4);
            p.indices.insert(p.indices.end(), {i * kSides + j, (i + 1) * kSides + j,
                                               (i + 1) * kSides + k, i * kSides + k});
        }
    }
    Diagnostics diagnostics;
    RawMesh raw = p.raw();
    raw.smoothNormals = true;
    for (const bool leftHanded : {false, true}) {
        raw.leftHanded = leftHanded;
        const auto mesh = buildMesh(raw, diagnostics);
        REQUIRE(mesh->normals.interpolation == Interpolation::kVertex);
        REQUIRE(mesh->normals.values.size() == mesh->points.size() * 3);
        for (std::size_t i = kSides; i < mesh->points.size() - kSides; ++i) {
            const float* n = mesh->normals.values.data() + 3 * i;
            const float cosine = dot(Float3(n[0], n[1], n[2]), mesh->points[i]);
            CHECK((leftHanded ? -cosine : cosine) > 0.9999F);
        }
    }
    raw.smoothNormals = false;
    CHECK_FALSE(buildMesh(raw, diagnostics)->normals);
}

TEST_CASE("smooth normals weigh faces by angle, not by how they are triangulated") {
    // The corner of a cube: three quads, one of them cut so that the corner lies in two triangles.
    Polygons p;
    p.points = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1};
    p.counts = {3, 3, 4, 4};
    p.indices = {0, 2, 1, 0, 3, 2, 0, 1, 5, 4, 0, 4, 6, 3};
    Diagnostics diagnostics;
    RawMesh raw = p.raw();
    raw.smoothNormals = true;
    const auto mesh = buildMesh(raw, diagnostics);
    for (int k = 0; k < 3; ++k) {
        CHECK(mesh->normals.values[static_cast<std::size_t>(k)] ==
              doctest::Approx(-1.0 / std::sqrt(3.0)).epsilon(2e-4));
    }
}

TEST_CASE("authored normals win over smooth ones unless they are unusable") {
    Diagnostics diagnostics;
    const Polygons square = unitSquare();
    RawMesh raw = square.raw();
    raw.smoothNormals = true;
    const std::vector<float> tilted = {1, 0, 0};
    raw.normals = attribute("normals", RawInterpolation::kUniform, 3, tilted);
    CHECK(buildMesh(raw, diagnostics)->normals.values == tilted);
    CHECK(diagnostics.messages().empty());
    raw.normals.interpolation = RawInterpolation::kVertex;
    const auto mesh = buildMesh(raw, diagnostics);
    CHECK(mesh->normals.values == std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
    CHECK(contains(onlyMessage(diagnostics), "'normals'"));
    CHECK(contains(onlyMessage(diagnostics), "vertex interpolation needs 4"));
}
