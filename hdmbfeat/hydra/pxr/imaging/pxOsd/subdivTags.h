#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/imaging/interface.h"

#include <cstdint>

HYDRA_INTERFACE_OPEN_SCOPE

/// Subdivision rules, creases and corners of a mesh.
class PxOsdSubdivTags {
public:
    using ID = uint64_t;

    PxOsdSubdivTags();
    PxOsdSubdivTags(const PxOsdSubdivTags&) = default;
    PxOsdSubdivTags(PxOsdSubdivTags&&) = default;
    PxOsdSubdivTags& operator=(const PxOsdSubdivTags&) = default;
    PxOsdSubdivTags& operator=(PxOsdSubdivTags&&) = default;

    PxOsdSubdivTags(const TfToken& vertexInterpolationRule,
                    const TfToken& faceVaryingInterpolationRule, const TfToken& creaseMethod,
                    const TfToken& triangleSubdivision, const VtIntArray& creaseIndices,
                    const VtIntArray& creaseLengths, const VtFloatArray& creaseWeights,
                    const VtIntArray& cornerIndices, const VtFloatArray& cornerWeights)
        : _vtxInterpolationRule(vertexInterpolationRule),
          _fvarInterpolationRule(faceVaryingInterpolationRule),
          _creaseMethod(creaseMethod),
          _trianglesSubdivision(triangleSubdivision),
          _creaseIndices(creaseIndices),
          _creaseLengths(creaseLengths),
          _creaseWeights(creaseWeights),
          _cornerIndices(cornerIndices),
          _cornerWeights(cornerWeights) {}

    TfToken GetVertexInterpolationRule() const { return _vtxInterpolationRule; }
    void SetVertexInterpolationRule(TfToken rule) { _vtxInterpolationRule = rule; }
    TfToken GetFaceVaryingInterpolationRule() const { return _fvarInterpolationRule; }
    void SetFaceVaryingInterpolationRule(TfToken rule) { _fvarInterpolationRule = rule; }
    TfToken GetCreaseMethod() const { return _creaseMethod; }
    void SetCreaseMethod(TfToken method) { _creaseMethod = method; }
    TfToken GetTriangleSubdivision() const { return _trianglesSubdivision; }
    void SetTriangleSubdivision(TfToken rule) { _trianglesSubdivision = rule; }

    /// Vertex indices of all creases, one after another; their counts are the crease lengths.
    const VtIntArray& GetCreaseIndices() const { return _creaseIndices; }
    void SetCreaseIndices(const VtIntArray& indices) { _creaseIndices = indices; }
    const VtIntArray& GetCreaseLengths() const { return _creaseLengths; }
    void SetCreaseLengths(const VtIntArray& lengths) { _creaseLengths = lengths; }
    /// One weight a crease, or one an edge.
    const VtFloatArray& GetCreaseWeights() const { return _creaseWeights; }
    void SetCreaseWeights(const VtFloatArray& weights) { _creaseWeights = weights; }
    const VtIntArray& GetCornerIndices() const { return _cornerIndices; }
    void SetCornerIndices(const VtIntArray& indices) { _cornerIndices = indices; }
    const VtFloatArray& GetCornerWeights() const { return _cornerWeights; }
    void SetCornerWeights(const VtFloatArray& weights) { _cornerWeights = weights; }

    ID ComputeHash() const;

private:
    TfToken _vtxInterpolationRule;
    TfToken _fvarInterpolationRule;
    TfToken _creaseMethod;
    TfToken _trianglesSubdivision;
    VtIntArray _creaseIndices;
    VtIntArray _creaseLengths;
    VtFloatArray _creaseWeights;
    VtIntArray _cornerIndices;
    VtFloatArray _cornerWeights;
};
HYDRA_INTERFACE_SIZE(PxOsdSubdivTags, 232, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
