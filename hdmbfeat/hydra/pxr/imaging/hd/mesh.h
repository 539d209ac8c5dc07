#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/enums.h"
#include "pxr/imaging/hd/meshTopology.h"
#include "pxr/imaging/hd/rprim.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// A polygon mesh or subdivision surface.
class HdMesh : public HdRprim {
public:
    ~HdMesh() override;

    bool IsDoubleSided(HdSceneDelegate* delegate) const {
        return delegate->GetDoubleSided(GetId());
    }
    HdCullStyle GetCullStyle(HdSceneDelegate* delegate) const {
        return delegate->GetCullStyle(GetId());
    }
    VtValue GetShadingStyle(HdSceneDelegate* delegate) const {
        return delegate->GetShadingStyle(GetId());
    }
    HdMeshTopology GetMeshTopology(HdSceneDelegate* delegate) const {
        return delegate->GetMeshTopology(GetId());
    }
    HdDisplayStyle GetDisplayStyle(HdSceneDelegate* delegate) const {
        return delegate->GetDisplayStyle(GetId());
    }
    PxOsdSubdivTags GetSubdivTags(HdSceneDelegate* delegate) const {
        return delegate->GetSubdivTags(GetId());
    }
    VtValue GetPoints(HdSceneDelegate* delegate) const {
        return GetPrimvar(delegate, TfToken("points"));
    }
    VtValue GetNormals(HdSceneDelegate* delegate) const {
        return GetPrimvar(delegate, TfToken("normals"));
    }

    const TfTokenVector& GetBuiltinPrimvarNames() const override;
    /// Null in the library.
    virtual HdMeshTopologySharedPtr GetTopology() const;

protected:
    explicit HdMesh(const SdfPath& id);

private:
    HdMesh() = delete;
    HdMesh(const HdMesh&) = delete;
    HdMesh& operator=(const HdMesh&) = delete;
};
HYDRA_INTERFACE_SIZE(HdMesh, 464, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
