// Attributes of a mesh that is being built. Private to the mesh builder.
#pragma once

#include <string>
#include <vector>

#include "scene/meshBuilder.h"

namespace mbfeat {

/// What attributes are sized and looked up by.
struct MeshTopology {
    std::size_t faces = 0;
    std::size_t points = 0;
    std::size_t faceVertices = 0;        ///< as authored: number of indices
    std::size_t countedFaceVertices = 0; ///< sum of the face counts
    const std::vector<Triangle>* triangles = nullptr;
    /// Face-vertex of each triangle corner; used for face-varying attributes only.
    const std::vector<Triangle>* corners = nullptr;
};

/// Checks and converts; absent (with a message to `subject`) when it cannot be used.
Attribute buildAttribute(const RawAttribute& raw, const MeshTopology& topology,
                         const std::string& subject, Diagnostics& diagnostics);

/// Angle-weighted vertex normals (Thuermer and Wuethrich 1998), of unit length; zero at points
/// without triangles.
Attribute smoothNormals(const std::vector<Float3>& points, const std::vector<Triangle>& triangles);

} // namespace mbfeat
