#pragma once

#include "pxr/base/gf/vec2i.h"
#include "pxr/base/gf/vec3i.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/meshTopology.h"
#include "pxr/imaging/hd/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

/// Triangulation of a mesh and of the primvars on it. Refers to the topology, does not own it.
class HdMeshUtil {
public:
    HdMeshUtil(const HdMeshTopology* topology, const SdfPath& id) : _topology(topology), _id(id) {}
    virtual ~HdMeshUtil();

    /// Fans of the unholed faces, wound for the right-handed orientation. primitiveParams: per
    /// triangle (face << 2) | edge flag; edgeIndices may be null.
    void ComputeTriangleIndices(VtVec3iArray* indices, VtIntArray* primitiveParams,
                                VtIntArray* edgeIndices = nullptr) const;
    /// Three values a triangle from one value a face vertex; false for an unknown type.
    bool ComputeTriangulatedFaceVaryingPrimvar(const void* source, int numElements, HdType dataType,
                                               VtValue* triangulated) const;
    void EnumerateEdges(std::vector<GfVec2i>* edgeVertices,
                        std::vector<int>* firstEdgeIndexForFaces = nullptr) const;

    static int EncodeCoarseFaceParam(int faceIndex, int edgeFlag) {
        return (faceIndex << 2) | (edgeFlag & 3);
    }
    static int DecodeFaceIndexFromCoarseFaceParam(int coarseFaceParam) {
        return coarseFaceParam >> 2;
    }
    static int DecodeEdgeFlagFromCoarseFaceParam(int coarseFaceParam) {
        return coarseFaceParam & 3;
    }

private:
    const HdMeshTopology* _topology;
    const SdfPath _id;
};
HYDRA_INTERFACE_SIZE(HdMeshUtil, 24, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
