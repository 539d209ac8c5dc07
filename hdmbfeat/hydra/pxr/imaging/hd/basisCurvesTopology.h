#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/imaging/hd/topology.h"
#include "pxr/imaging/interface.h"

#include <cstddef>

HYDRA_INTERFACE_OPEN_SCOPE

/// Curves of one type, basis and wrap, each with its number of vertices; optionally indexed.
class HdBasisCurvesTopology : public HdTopology {
public:
    HdBasisCurvesTopology();
    HdBasisCurvesTopology(const HdBasisCurvesTopology& other);
    HdBasisCurvesTopology(const TfToken& curveType, const TfToken& curveBasis,
                          const TfToken& curveWrap, const VtIntArray& curveVertexCounts,
                          const VtIntArray& curveIndices);
    HdBasisCurvesTopology& operator=(const HdBasisCurvesTopology&) = default;
    ~HdBasisCurvesTopology() override;

    const VtIntArray& GetCurveVertexCounts() const { return _curveVertexCounts; }
    const VtIntArray& GetCurveIndices() const { return _curveIndices; }
    size_t GetNumCurves() const { return _curveVertexCounts.size(); }
    size_t GetNumPoints() const { return _numPoints; }
    TfToken GetCurveType() const { return _curveType; }
    TfToken GetCurveBasis() const { return _curveBasis; }
    TfToken GetCurveWrap() const { return _curveWrap; }
    bool HasIndices() const { return !_curveIndices.empty(); }

    void SetInvisiblePoints(const VtIntArray& invisiblePoints) {
        _invisiblePoints = invisiblePoints;
    }
    const VtIntArray& GetInvisiblePoints() const { return _invisiblePoints; }
    void SetInvisibleCurves(const VtIntArray& invisibleCurves) {
        _invisibleCurves = invisibleCurves;
    }
    const VtIntArray& GetInvisibleCurves() const { return _invisibleCurves; }

    ID ComputeHash() const override;
    bool operator==(const HdBasisCurvesTopology& other) const;
    bool operator!=(const HdBasisCurvesTopology& other) const;

    size_t CalculateNeededNumberOfControlPoints() const;
    size_t CalculateNeededNumberOfVaryingControlPoints() const;

private:
    TfToken _curveType;
    TfToken _curveBasis;
    TfToken _curveWrap;
    VtIntArray _curveVertexCounts;
    VtIntArray _curveIndices;
    VtIntArray _invisiblePoints;
    VtIntArray _invisibleCurves;
    size_t _numPoints;
};
HYDRA_INTERFACE_SIZE(HdBasisCurvesTopology, 200, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
