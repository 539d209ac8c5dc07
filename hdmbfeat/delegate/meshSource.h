// Polygon data of a Hydra mesh as the mesh builder takes it.
#pragma once

#include "pxr/pxr.h"

#include <deque>
#include <set>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "delegate/values.h"
#include "pxr/imaging/hd/mesh.h"
#include "scene/meshBuilder.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// Pulls points, normals and the wanted primvars of a mesh from the scene and keeps the arrays
/// alive that raw() views. Arrays are shared with the scene where their type allows.
class MeshSource {
public:
    /// `slots`: material slot of each geometry subset of the topology.
    MeshSource(const HdMesh& prim, HdSceneDelegate* delegate, const HdMeshTopology& topology,
               const std::vector<std::uint16_t>& slots, const std::set<std::string>& wanted,
               Diagnostics& diagnostics);
    MeshSource(const MeshSource&) = delete;
    MeshSource& operator=(const MeshSource&) = delete;

    const RawMesh& raw() const { return raw_; }

private:
    void addTopology(const HdMeshTopology& topology, const std::vector<std::uint16_t>& slots);
    void addPrimvars(const HdMesh& prim, HdSceneDelegate* delegate,
                     const std::set<std::string>& wanted, Diagnostics& diagnostics);
    void addComputedPrimvars(const HdMesh& prim, HdSceneDelegate* delegate);
    void addAttribute(const std::string& name, HdInterpolation interpolation, const VtValue& value,
                      const VtIntArray& indices, Diagnostics& diagnostics);
    ArrayView<int> keep(const VtIntArray& array);

    RawMesh raw_;
    std::deque<FloatArray> floats_; // deques: views into their elements stay valid
    std::deque<VtIntArray> integers_;
    std::set<std::string> computed_; // primvars that a computation gave, which win
};

} // namespace mbfeat
