// Instancers: where the copies of a prototype stand.
#pragma once

#include "pxr/pxr.h"

#include <string>
#include <vector>

#include "core/affine.h"
#include "core/diagnostics.h"
#include "pxr/base/gf/matrix4d.h"
#include "pxr/base/gf/quatd.h"
#include "pxr/base/gf/vec3d.h"
#include "pxr/imaging/hd/instancer.h"
#include "scene/scene.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// Instance primvars are pulled in Sync; computeTransforms() may then be called by any number of
/// threads.
class InstancerPrim final : public HdInstancer {
public:
    InstancerPrim(HdSceneDelegate* delegate, const SdfPath& id);
    ~InstancerPrim() override;

    void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;

    /// Prototype to world for every instance, those of parent instancers multiplied out: for each
    /// instance of the parent all instances of this one. Empty where one of them is invisible.
    std::vector<AffineD> computeTransforms(const SdfPath& prototypeId) const;

private:
    void pull(HdSceneDelegate* delegate);
    AffineD instanceTransform(std::size_t index) const;

    std::vector<GfVec3d> translations_;
    std::vector<GfQuatd> rotations_;
    std::vector<GfVec3d> scales_;
    std::vector<GfMatrix4d> transforms_;
};

/// Removes the transforms that cannot be rendered, not finite or flattening to nothing, with one
/// message.
void dropUnusable(Geometry& geometry, Diagnostics& diagnostics);

} // namespace mbfeat
