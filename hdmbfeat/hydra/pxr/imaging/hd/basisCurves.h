#pragma once

#include "pxr/imaging/hd/basisCurvesTopology.h"
#include "pxr/imaging/hd/rprim.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// Curves: linear, or cubic in a basis.
class HdBasisCurves : public HdRprim {
public:
    ~HdBasisCurves() override;

    HdBasisCurvesTopology GetBasisCurvesTopology(HdSceneDelegate* delegate) const {
        return delegate->GetBasisCurvesTopology(GetId());
    }
    HdDisplayStyle GetDisplayStyle(HdSceneDelegate* delegate) const {
        return delegate->GetDisplayStyle(GetId());
    }

    const TfTokenVector& GetBuiltinPrimvarNames() const override;

protected:
    explicit HdBasisCurves(const SdfPath& id);

private:
    HdBasisCurves() = delete;
    HdBasisCurves(const HdBasisCurves&) = delete;
    HdBasisCurves& operator=(const HdBasisCurves&) = delete;
};
HYDRA_INTERFACE_SIZE(HdBasisCurves, 464, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
