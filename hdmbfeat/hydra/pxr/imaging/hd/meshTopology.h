#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/imaging/hd/geomSubset.h"
#include "pxr/imaging/hd/topology.h"
#include "pxr/imaging/interface.h"
#include "pxr/imaging/pxOsd/meshTopology.h"

#include <memory>

HYDRA_INTERFACE_OPEN_SCOPE

class HdMeshTopology;
using HdMeshTopologySharedPtr = std::shared_ptr<HdMeshTopology>;

/// A mesh's faces with its subsets, hidden parts and refinement level.
class HdMeshTopology : public HdTopology {
public:
    HdMeshTopology();
    HdMeshTopology(const HdMeshTopology&) = default;
    /// The other topology at another refinement level.
    HdMeshTopology(const HdMeshTopology& other, int refineLevel);
    explicit HdMeshTopology(const PxOsdMeshTopology& topology, int refineLevel = 0);
    HdMeshTopology(const TfToken& scheme, const TfToken& orientation,
                   const VtIntArray& faceVertexCounts, const VtIntArray& faceVertexIndices,
                   int refineLevel = 0);
    HdMeshTopology(const TfToken& scheme, const TfToken& orientation,
                   const VtIntArray& faceVertexCounts, const VtIntArray& faceVertexIndices,
                   const VtIntArray& holeIndices, int refineLevel = 0);
    ~HdMeshTopology() override;
    HdMeshTopology& operator=(const HdMeshTopology& other);

    const PxOsdMeshTopology& GetPxOsdMeshTopology() const { return _topology; }
    static bool IsEnabledAdaptive();

    int GetNumFaces() const;
    int GetNumFaceVaryings() const;
    int GetNumPoints() const;
    static int ComputeNumPoints(const VtIntArray& faceVertexIndices);

    const TfToken GetScheme() const { return _topology.GetScheme(); }
    int GetRefineLevel() const { return _refineLevel; }
    const VtIntArray& GetFaceVertexCounts() const { return _topology.GetFaceVertexCounts(); }
    const VtIntArray& GetFaceVertexIndices() const { return _topology.GetFaceVertexIndices(); }
    const TfToken& GetOrientation() const { return _topology.GetOrientation(); }

    ID ComputeHash() const override;
    bool operator==(const HdMeshTopology& other) const;

    void SetHoleIndices(const VtIntArray& holeIndices) {
        _topology = _topology.WithHoleIndices(holeIndices);
    }
    const VtIntArray& GetHoleIndices() const { return _topology.GetHoleIndices(); }
    void SetSubdivTags(const PxOsdSubdivTags& subdivTags);
    const PxOsdSubdivTags& GetSubdivTags() const { return _topology.GetSubdivTags(); }
    void SetGeomSubsets(const HdGeomSubsets& geomSubsets) { _geomSubsets = geomSubsets; }
    const HdGeomSubsets& GetGeomSubsets() const { return _geomSubsets; }
    void SetInvisiblePoints(const VtIntArray& invisiblePoints) {
        _invisiblePoints = invisiblePoints;
    }
    const VtIntArray& GetInvisiblePoints() const { return _invisiblePoints; }
    void SetInvisibleFaces(const VtIntArray& invisibleFaces) { _invisibleFaces = invisibleFaces; }
    const VtIntArray& GetInvisibleFaces() const { return _invisibleFaces; }

protected:
    PxOsdMeshTopology _topology;
    HdGeomSubsets _geomSubsets;
    VtIntArray _invisiblePoints;
    VtIntArray _invisibleFaces;
    int _refineLevel;
    int _numPoints;
};
HYDRA_INTERFACE_SIZE(HdMeshTopology, 496, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
