// From polygon data as USD has it to a validated triangle mesh.
//
// Everything that can be wrong with authored data is dealt with here: what is bad is dropped and
// reported to the Diagnostics with the prim path, and the rest of the mesh is kept. The result
// satisfies every promise of scene/mesh.h, so that nothing behind it checks again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "scene/mesh.h"

namespace mbfeat {

/// A view of somebody else's array. Does not own: the array must outlive the call it is passed to.
template <class T>
struct ArrayView {
    const T* data = nullptr;
    std::size_t size = 0;

    ArrayView() = default;
    ArrayView(const T* data_, std::size_t size_) : data(data_), size(size_) {}
    ArrayView(const std::vector<T>& v) // NOLINT(google-explicit-constructor)
        : data(v.data()),
          size(v.size()) {}
    bool empty() const { return size == 0; }
    const T& operator[](std::size_t i) const { return data[i]; }
    const T* begin() const { return data; }
    const T* end() const { return data + size; }
};

/// USD's interpolations.
enum class RawInterpolation : std::uint8_t { kConstant, kUniform, kVarying, kVertex, kFaceVarying };

/// An attribute as authored.
struct RawAttribute {
    std::string name; ///< of the primvar, for look-ups and messages; "normals" for normals
    RawInterpolation interpolation = RawInterpolation::kConstant;
    int width = 0;           ///< floats a value, 1..4; 0: absent
    ArrayView<float> values; ///< width * number of values
    bool indexed = false;    ///< `indices` selects values; it may be empty, which is an error
    ArrayView<int> indices;  ///< one a constant, face, point or face-vertex
};

/// A GeomSubset of faces with its own material.
struct RawSubset {
    std::string path;       ///< prim path, for messages
    ArrayView<int> faces;   ///< face indices; a face in several subsets belongs to the first
    std::uint16_t slot = 0; ///< Geometry::materials index of its faces
};

struct RawMesh {
    std::string path;        ///< prim path, for messages
    ArrayView<float> points; ///< x, y, z of each point, object space
    ArrayView<int> faceVertexCounts;
    ArrayView<int> faceVertexIndices;
    ArrayView<int> holeIndices; ///< faces that are not there
    bool leftHanded = false;    ///< orientation = leftHanded: front faces are clockwise
    bool doubleSided = false;
    std::vector<RawSubset> subsets;
    std::uint16_t slot = 0; ///< material slot of faces in no subset
    RawAttribute normals;   ///< width 3 or absent; not used for shading when of wrong size
    std::vector<RawAttribute> primvars;
    /// Without (valid) authored normals: true makes angle-weighted vertex normals (surfaces that
    /// are subdivision surfaces), false leaves the mesh faceted.
    bool smoothNormals = false;
};

/// Triangulates and validates. Never null; without triangles when nothing could be kept. Errors
/// and drops go to `diagnostics`, one message a kind of problem and prim. What is done:
/// - convex polygons become fans, concave ones are ear-clipped on their best-fitting plane;
///   left-handed faces are reversed; hole faces are left out;
/// - faces with fewer than three vertices, with an index out of range, with a point that is not
///   finite or without their face-vertices (counts and indices disagree) are dropped, as are
///   triangles without area;
/// - attributes of the wrong size, without values or with bad indices are dropped, values that are
///   not finite become zero;
/// - indices are resolved; varying is vertex; face-varying attributes that agree at every point
///   become per-vertex ones, the others get a value a triangle corner.
/// Threads: any number of calls at once.
std::shared_ptr<const Mesh> buildMesh(const RawMesh& raw, Diagnostics& diagnostics);

/// Triangulates one polygon in space, for callers with polygons of their own: appends triples of
/// indices into the polygon, in its winding order (n - 2 triangles, also for polygons that are
/// not planar or intersect themselves). `points`: x, y, z of each of the n >= 3 corners, finite.
void triangulatePolygon(ArrayView<Float3> points, std::vector<std::uint32_t>& triangles);

} // namespace mbfeat
