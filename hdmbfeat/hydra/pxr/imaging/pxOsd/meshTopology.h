#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/imaging/pxOsd/subdivTags.h"

#include <atomic>
#include <cstdint>

HYDRA_INTERFACE_OPEN_SCOPE

/// Faces, holes, orientation and subdivision rules of a mesh.
class PxOsdMeshTopology {
public:
    using ID = uint64_t;

    PxOsdMeshTopology();
    PxOsdMeshTopology(const PxOsdMeshTopology& other);
    PxOsdMeshTopology& operator=(const PxOsdMeshTopology&) = default;
    ~PxOsdMeshTopology();

    PxOsdMeshTopology(const TfToken& scheme, const TfToken& orientation,
                      const VtIntArray& faceVertexCounts, const VtIntArray& faceVertexIndices);
    PxOsdMeshTopology(const TfToken& scheme, const TfToken& orientation,
                      const VtIntArray& faceVertexCounts, const VtIntArray& faceVertexIndices,
                      const VtIntArray& holeIndices);
    PxOsdMeshTopology(const TfToken& scheme, const TfToken& orientation,
                      const VtIntArray& faceVertexCounts, const VtIntArray& faceVertexIndices,
                      const VtIntArray& holeIndices, const PxOsdSubdivTags& subdivTags);

    const TfToken GetScheme() const { return _scheme; }
    const TfToken& GetOrientation() const { return _orientation; }
    const VtIntArray& GetFaceVertexCounts() const { return _faceVertexCounts; }
    const VtIntArray& GetFaceVertexIndices() const { return _faceVertexIndices; }
    const VtIntArray& GetHoleIndices() const { return _holeIndices; }
    const PxOsdSubdivTags& GetSubdivTags() const { return _subdivTags; }

    PxOsdMeshTopology WithHoleIndices(const VtIntArray& holeIndices) const {
        return {_scheme,     _orientation, _faceVertexCounts, _faceVertexIndices,
                holeIndices, _subdivTags};
    }

    ID ComputeHash() const;
    bool operator==(const PxOsdMeshTopology& other) const;

private:
    /// Remembers that a topology was found valid; copies keep the answer, any change starts anew.
    struct _Validated {
        _Validated() : value(false) {}
        _Validated(const _Validated& other) : value(other.value.load()) {}
        _Validated& operator=(const _Validated& other) {
            value.store(other.value.load());
            return *this;
        }
        std::atomic<bool> value;
    };

    TfToken _scheme;
    TfToken _orientation;
    VtIntArray _faceVertexCounts;
    VtIntArray _faceVertexIndices;
    VtIntArray _holeIndices;
    PxOsdSubdivTags _subdivTags;
    mutable _Validated _validated;
};
HYDRA_INTERFACE_SIZE(PxOsdMeshTopology, 376, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
