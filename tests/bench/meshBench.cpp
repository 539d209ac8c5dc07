// What building a mesh of a million triangles costs: processor seconds of the best of several
// runs, and bytes a triangle that the mesh holds.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

#include "scene/meshBuilder.h"

using namespace mbfeat;

namespace {

constexpr int kSide = 708; // quads on a side: 1,002,528 triangles
constexpr int kRuns = 5;

/// A wavy height field of quads or triangles, with texture coordinates a face corner.
struct Field {
    std::vector<float> points, st;
    std::vector<int> counts, indices;

    Field(bool quads, bool seams) {
        for (int j = 0; j <= kSide; ++j) {
            for (int i = 0; i <= kSide; ++i) {
                const auto x = static_cast<float>(i);
                const auto y = static_cast<float>(j);
                points.insert(points.end(), {x, y, std::sin(0.1F * x) * std::cos(0.1F * y)});
            }
        }
        const auto at = [](int i, int j) { return j * (kSide + 1) + i; };
        for (int j = 0; j < kSide; ++j) {
            for (int i = 0; i < kSide; ++i) {
                const int a = at(i, j);
                const int b = at(i + 1, j);
                const int c = at(i + 1, j + 1);
                const int d = at(i, j + 1);
                if (quads) {
                    counts.push_back(4);
                    indices.insert(indices.end(), {a, b, c, d});
                } else {
                    counts.insert(counts.end(), {3, 3});
                    indices.insert(indices.end(), {a, b, c, a, c, d});
                }
            }
        }
        for (std::size_t k = 0; k < indices.size(); ++k) {
            const auto p = static_cast<std::size_t>(indices[k]);
            // A seam in the last row only: the test whether corners agree reads almost everything.
            const bool torn = seams && k + 4 >= indices.size();
            st.insert(st.end(), {points[3 * p] + (torn ? 1.0F : 0.0F), points[3 * p + 1]});
        }
    }

    RawMesh raw(bool textured, bool smooth) const {
        RawMesh raw;
        raw.path = "/field";
        raw.points = points;
        raw.faceVertexCounts = counts;
        raw.faceVertexIndices = indices;
        raw.smoothNormals = smooth;
        if (textured) {
            RawAttribute a;
            a.name = "st";
            a.interpolation = RawInterpolation::kFaceVarying;
            a.width = 2;
            a.values = st;
            raw.primvars = {a};
        }
        return raw;
    }
};

template <class T>
std::size_t bytesOf(const std::vector<T>& values) {
    return values.capacity() * sizeof(T);
}

std::size_t bytesOf(const Mesh& mesh) {
    std::size_t bytes = bytesOf(mesh.points) + bytesOf(mesh.triangles) +
                        bytesOf(mesh.triangleFaces) + bytesOf(mesh.triangleMaterials) +
                        bytesOf(mesh.normals.values);
    for (const NamedAttribute& primvar : mesh.primvars) {
        bytes += bytesOf(primvar.attribute.values);
    }
    return bytes;
}

void measure(const char* name, const RawMesh& raw) {
    double best = 1e9;
    std::size_t bytes = 0;
    std::size_t triangles = 0;
    for (int run = 0; run < kRuns; ++run) {
        Diagnostics diagnostics;
        const std::clock_t start = std::clock();
        const auto mesh = buildMesh(raw, diagnostics);
        best = std::min(best, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
        bytes = bytesOf(*mesh);
        triangles = mesh->triangles.size();
    }
    std::printf("%-40s %zu triangles  %6.3f s  %5.1f bytes a triangle\n", name, triangles, best,
                static_cast<double>(bytes) / static_cast<double>(triangles));
}

} // namespace

int main() {
    const Field triangles(false, false);
    const Field quads(true, false);
    const Field torn(true, true);
    measure("triangles, faceted", triangles.raw(false, false));
    measure("triangles, smooth", triangles.raw(false, true));
    measure("quads, faceted", quads.raw(false, false));
    measure("quads, smooth, st per point", quads.raw(true, true));
    measure("quads, smooth, st per corner", torn.raw(true, true));
    return 0;
}
