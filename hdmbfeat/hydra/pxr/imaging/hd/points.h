#pragma once

#include "pxr/imaging/hd/rprim.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// A cloud of points with widths.
class HdPoints : public HdRprim {
public:
    ~HdPoints() override;

    HdDisplayStyle GetDisplayStyle(HdSceneDelegate* delegate) const {
        return delegate->GetDisplayStyle(GetId());
    }

    const TfTokenVector& GetBuiltinPrimvarNames() const override;

protected:
    explicit HdPoints(const SdfPath& id);

private:
    HdPoints() = delete;
    HdPoints(const HdPoints&) = delete;
    HdPoints& operator=(const HdPoints&) = delete;
};
HYDRA_INTERFACE_SIZE(HdPoints, 464, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
