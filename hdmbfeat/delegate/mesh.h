// Meshes: from Hydra's topology, primvars and instancers to the scene's geometry.
#pragma once

#include "pxr/pxr.h"

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "pxr/imaging/hd/mesh.h"
#include "scene/scene.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class RenderParam;
struct VisibilityFilter;

class MeshPrim final : public HdMesh {
public:
    MeshPrim(const SdfPath& id, RenderParam& param);
    ~MeshPrim() override;

    HdDirtyBits GetInitialDirtyBitsMask() const override;
    /// Runs in parallel for different meshes.
    void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam, HdDirtyBits* dirtyBits,
              const TfToken& reprToken) override;
    void Finalize(HdRenderParam* renderParam) override;
    /// Also of meshes that are not synced, as those are whose new tag hides them.
    void UpdateRenderTag(HdSceneDelegate* delegate, HdRenderParam* renderParam) override;

    /// Shows or hides the mesh after the pass's filter changed.
    void updateFilter(RenderParam& param);

    /// Whether a material or AOV reads a primvar that was not fetched, for nobody read it then.
    bool lacksPrimvars() const;
    /// Fetches the mesh again from where it was synced from.
    void refetch();

protected:
    HdDirtyBits _PropagateDirtyBits(HdDirtyBits bits) const override { return bits; }
    void _InitRepr(const TfToken& reprToken, HdDirtyBits* dirtyBits) override;

private:
    void syncPrim(HdSceneDelegate* delegate, RenderParam& param, HdDirtyBits* dirtyBits);
    void updateMesh(HdSceneDelegate* delegate, RenderParam& param);
    void updateMaterials(HdSceneDelegate* delegate, const HdMeshTopology& topology);
    void updateTransforms(HdSceneDelegate* delegate);
    bool passesFilter(const VisibilityFilter& filter) const;
    void publish(RenderParam& param);

    RenderParam& param_;
    Diagnostics meshMessages_, placeMessages_, publishMessages_; ///< of the last of each
    HdSceneDelegate* delegate_ = nullptr;                        ///< of the last sync
    Geometry geometry_;
    std::set<std::string> fetchedPrimvars_;
    std::vector<std::uint16_t> subsetSlots_; ///< material slot of each subset of the topology
    bool published_ = false;
};

} // namespace mbfeat
