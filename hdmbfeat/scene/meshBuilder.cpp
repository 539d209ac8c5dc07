#include "scene/meshBuilder.h"

#include <cfloat>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "scene/meshAttributes.h"
#include "scene/triangulate.h"

namespace mbfeat {

namespace {

/// Faces that were dropped for one reason.
struct Drops {
    std::size_t count = 0;
    std::size_t first = 0;

    void add(std::size_t face) {
        first = count == 0 ? face : first;
        ++count;
    }
};

/// Builds triangles out of the faces of one mesh.
class FaceBuilder {
public:
    FaceBuilder(const RawMesh& raw, bool keepCorners, Mesh& mesh, Diagnostics& diagnostics)
        : raw_(raw),
          mesh_(mesh),
          diagnostics_(diagnostics),
          keepCorners_(keepCorners) {}

    void run() {
        copyPoints();
        markHoles();
        assignSlots();
        reserve();
        std::size_t first = 0; // face-vertex that the face starts with
        for (std::size_t face = 0; face < raw_.faceVertexCounts.size; ++face) {
            const auto count = static_cast<std::size_t>(std::max(raw_.faceVertexCounts[face], 0));
            addFace(face, first, count);
            first += count;
        }
        countedFaceVertices_ = first;
        finishFaces();
        report();
    }

    const std::vector<Triangle>& corners() const { return corners_; }
    std::size_t countedFaceVertices() const { return countedFaceVertices_; }

private:
    void copyPoints() {
        const std::size_t count = raw_.points.size / 3;
        if (raw_.points.size % 3 != 0) {
            diagnostics_.warn(raw_.path, "has an incomplete last point; it is left out");
        }
        mesh_.points.resize(count);
        static_assert(sizeof(Float3) == 3 * sizeof(float));
        if (count > 0) {
            std::memcpy(static_cast<void*>(mesh_.points.data()), raw_.points.data,
                        count * sizeof(Float3));
        }
        for (std::size_t i = 0; i < count; ++i) {
            if (isFinite(mesh_.points[i])) {
                continue;
            }
            if (badPoints_.empty()) {
                badPoints_.resize(count, false);
            }
            badPoints_[i] = true;
            mesh_.points[i] = Float3(0.0F);
        }
    }

    void markHoles() {
        std::size_t bad = 0;
        for (const int face : raw_.holeIndices) {
            if (face < 0 || static_cast<std::size_t>(face) >= raw_.faceVertexCounts.size) {
                ++bad;
                continue;
            }
            holes_.resize(raw_.faceVertexCounts.size, false);
            holes_[static_cast<std::size_t>(face)] = true;
        }
        if (bad > 0) {
            diagnostics_.warn(raw_.path,
                              std::to_string(bad) + " hole indices name no face; they are ignored");
        }
    }

    /// Material slots of the faces; left empty when all are in slot 0.
    void assignSlots() {
        constexpr std::uint16_t kUnset = std::numeric_limits<std::uint16_t>::max();
        const std::size_t faces = raw_.faceVertexCounts.size;
        bool needed = raw_.slot != 0;
        for (const RawSubset& subset : raw_.subsets) {
            needed = needed || subset.slot != 0;
        }
        if (!needed) {
            return;
        }
        slots_.assign(faces, kUnset);
        for (const RawSubset& subset : raw_.subsets) {
            std::size_t bad = 0;
            std::size_t taken = 0;
            for (const int face : subset.faces) {
                if (face < 0 || static_cast<std::size_t>(face) >= faces) {
                    ++bad;
                    continue;
                }
                std::uint16_t& slot = slots_[static_cast<std::size_t>(face)];
                taken += slot != kUnset ? 1 : 0;
                slot = slot == kUnset ? subset.slot : slot;
            }
            reportSubset(subset, bad, taken);
        }
        for (std::uint16_t& slot : slots_) {
            slot = slot == kUnset ? raw_.slot : slot;
        }
    }

    void reportSubset(const RawSubset& subset, std::size_t bad, std::size_t taken) {
        if (bad > 0) {
            diagnostics_.warn(subset.path, std::to_string(bad) + " indices name no face of " +
                                               raw_.path + "; they are ignored");
        }
        if (taken > 0) {
            diagnostics_.warn(subset.path,
                              std::to_string(taken) + " faces of " + raw_.path +
                                  " are in an earlier subset too; they stay with that one");
        }
    }

    void reserve() {
        const std::size_t faceVertices = raw_.faceVertexIndices.size;
        const std::size_t faces = raw_.faceVertexCounts.size;
        const std::size_t expected = faceVertices > 2 * faces ? faceVertices - 2 * faces : 0;
        mesh_.triangles.reserve(expected);
        if (expected != faces) {
            mesh_.triangleFaces.reserve(expected);
        }
        if (!slots_.empty()) {
            mesh_.triangleMaterials.reserve(expected);
        }
        if (keepCorners_) {
            corners_.reserve(expected);
        }
    }

    void addFace(std::size_t face, std::size_t first, std::size_t count) {
        if (!holes_.empty() && holes_[face]) {
            return;
        }
        if (count < 3) {
            tooFew_.add(face);
            return;
        }
        if (first + count > raw_.faceVertexIndices.size) {
            missing_.add(face);
            return;
        }
        const int* indices = raw_.faceVertexIndices.data + first;
        for (std::size_t i = 0; i < count; ++i) {
            // Negative indices become huge ones.
            const auto index = static_cast<std::uint32_t>(indices[i]);
            if (index >= mesh_.points.size()) {
                outOfRange_.add(face);
                return;
            }
            if (!badPoints_.empty() && badPoints_[index]) {
                notFinite_.add(face);
                return;
            }
        }
        if (count == 3) {
            addTriangle(face, first, 0, 1, 2);
        } else if (count == 4) {
            const auto split =
                splitQuad(point(first), point(first + 1), point(first + 2), point(first + 3));
            for (const auto& t : split) {
                addTriangle(face, first, static_cast<std::uint32_t>(t[0]),
                            static_cast<std::uint32_t>(t[1]), static_cast<std::uint32_t>(t[2]));
            }
        } else {
            addPolygon(face, first, count);
        }
    }

    void addPolygon(std::size_t face, std::size_t first, std::size_t count) {
        polygon_.clear();
        for (std::size_t i = 0; i < count; ++i) {
            polygon_.push_back(point(first + i));
        }
        polygonTriangles_.clear();
        triangulatePolygon(polygon_, polygonTriangles_);
        for (std::size_t i = 0; i + 2 < polygonTriangles_.size(); i += 3) {
            addTriangle(face, first, polygonTriangles_[i], polygonTriangles_[i + 1],
                        polygonTriangles_[i + 2]);
        }
    }

    const Float3& point(std::size_t faceVertex) const {
        return mesh_.points[static_cast<std::size_t>(raw_.faceVertexIndices[faceVertex])];
    }

    /// Adds the triangle of three corners of a face, unless a float normal of it cannot exist.
    void addTriangle(std::size_t face, std::size_t first, std::uint32_t a, std::uint32_t b,
                     std::uint32_t c) {
        if (raw_.leftHanded) {
            std::swap(b, c);
        }
        const std::size_t corners[3] = {first + a, first + b, first + c};
        const double area =
            maxComponent(abs(areaVector(point(corners[0]), point(corners[1]), point(corners[2]))));
        if (!(area >= FLT_MIN && area <= FLT_MAX)) {
            degenerate_.add(face);
            return;
        }
        noteFace(face);
        Triangle triangle;
        Triangle corner;
        for (int k = 0; k < 3; ++k) {
            triangle.v[k] = static_cast<std::uint32_t>(raw_.faceVertexIndices[corners[k]]);
            corner.v[k] = static_cast<std::uint32_t>(corners[k]);
        }
        mesh_.triangles.push_back(triangle);
        if (keepCorners_) {
            corners_.push_back(corner);
        }
        if (!slots_.empty()) {
            mesh_.triangleMaterials.push_back(slots_[face]);
        }
    }

    /// Records the source face of the next triangle, from the first on that is not its own number.
    void noteFace(std::size_t face) {
        const std::size_t next = mesh_.triangles.size();
        if (mesh_.triangleFaces.empty() && face != next) {
            mesh_.triangleFaces.resize(next);
            std::iota(mesh_.triangleFaces.begin(), mesh_.triangleFaces.end(), 0U);
            facesDiffer_ = true;
        }
        if (facesDiffer_) {
            mesh_.triangleFaces.push_back(static_cast<std::uint32_t>(face));
        }
    }

    void finishFaces() {
        // Drops make the estimate too large; give back what is really spare.
        const auto trim = [](auto& values) {
            if (values.capacity() > values.size() + values.size() / 8) {
                values.shrink_to_fit();
            }
        };
        trim(mesh_.triangles);
        trim(mesh_.triangleFaces);
        trim(mesh_.triangleMaterials);
    }

    void report() {
        const std::size_t total = raw_.faceVertexCounts.size;
        reportDrops(tooFew_, "with fewer than three vertices");
        reportDrops(outOfRange_, "with a vertex index out of range (there are " +
                                     std::to_string(mesh_.points.size()) + " points)");
        reportDrops(notFinite_, "with a point that is not finite");
        reportDrops(missing_, "without vertex indices (faceVertexCounts add up to " +
                                  std::to_string(countedFaceVertices_) + ", but there are " +
                                  std::to_string(raw_.faceVertexIndices.size) +
                                  " faceVertexIndices)");
        if (missing_.count == 0 && countedFaceVertices_ < raw_.faceVertexIndices.size) {
            diagnostics_.warn(
                raw_.path, "has " + std::to_string(raw_.faceVertexIndices.size) +
                               " faceVertexIndices, but its " + std::to_string(total) +
                               " faceVertexCounts add up to " +
                               std::to_string(countedFaceVertices_) + "; the others are ignored");
        }
        if (degenerate_.count > 0) {
            diagnostics_.report(Severity::kInfo, raw_.path,
                                std::to_string(degenerate_.count) +
                                    " triangles without area are left out (the first in face " +
                                    std::to_string(degenerate_.first) + ")");
        }
    }

    void reportDrops(const Drops& drops, const std::string& what) {
        if (drops.count > 0) {
            diagnostics_.warn(raw_.path, std::to_string(drops.count) + " of " +
                                             std::to_string(raw_.faceVertexCounts.size) +
                                             " faces " + what + " are dropped (the first is face " +
                                             std::to_string(drops.first) + ")");
        }
    }

    const RawMesh& raw_;
    Mesh& mesh_;
    Diagnostics& diagnostics_;
    bool keepCorners_;
    bool facesDiffer_ = false;
    std::size_t countedFaceVertices_ = 0;
    std::vector<Triangle> corners_;
    std::vector<bool> badPoints_, holes_;
    std::vector<std::uint16_t> slots_;
    std::vector<Float3> polygon_;
    std::vector<std::uint32_t> polygonTriangles_;
    Drops tooFew_, outOfRange_, notFinite_, missing_, degenerate_;
};

bool hasFaceVarying(const RawMesh& raw) {
    bool found =
        raw.normals.width > 0 && raw.normals.interpolation == RawInterpolation::kFaceVarying;
    for (const RawAttribute& primvar : raw.primvars) {
        found = found || primvar.interpolation == RawInterpolation::kFaceVarying;
    }
    return found;
}

void addAttributes(const RawMesh& raw, const MeshTopology& topology, Mesh& mesh,
                   Diagnostics& diagnostics) {
    if (raw.normals.width == 3) {
        mesh.normals = buildAttribute(raw.normals, topology, raw.path, diagnostics);
    } else if (raw.normals.width != 0) {
        diagnostics.warn(raw.path, "has normals of " + std::to_string(raw.normals.width) +
                                       " numbers instead of 3; they are not used");
    }
    if (!mesh.normals && raw.smoothNormals) {
        mesh.normals = smoothNormals(mesh.points, mesh.triangles);
    }
    for (const RawAttribute& primvar : raw.primvars) {
        Attribute attribute = buildAttribute(primvar, topology, raw.path, diagnostics);
        if (attribute) {
            mesh.primvars.push_back({primvar.name, std::move(attribute)});
        }
    }
}

} // namespace

std::shared_ptr<const Mesh> buildMesh(const RawMesh& raw, Diagnostics& diagnostics) {
    auto mesh = std::make_shared<Mesh>();
    mesh->doubleSided = raw.doubleSided;
    constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
    if (raw.points.size / 3 >= kMost || raw.faceVertexIndices.size >= kMost) {
        diagnostics.error(raw.path, "has more than 4 billion points or face-vertices and is left "
                                    "out; split it");
        return mesh;
    }
    FaceBuilder faces(raw, hasFaceVarying(raw), *mesh, diagnostics);
    faces.run();
    if (mesh->triangles.empty()) {
        return mesh;
    }
    MeshTopology topology;
    topology.faces = raw.faceVertexCounts.size;
    topology.points = mesh->points.size();
    topology.faceVertices = raw.faceVertexIndices.size;
    topology.countedFaceVertices = faces.countedFaceVertices();
    topology.triangles = &mesh->triangles;
    topology.corners = &faces.corners();
    addAttributes(raw, topology, *mesh, diagnostics);
    return mesh;
}

} // namespace mbfeat
