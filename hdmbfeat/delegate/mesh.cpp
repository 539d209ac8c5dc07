#include "delegate/mesh.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "delegate/conversions.h"
#include "delegate/guard.h"
#include "delegate/instancer.h"
#include "delegate/meshSource.h"
#include "delegate/renderParam.h"
#include "delegate/tokens.h"
#include "pxr/imaging/hd/changeTracker.h"
#include "pxr/imaging/hd/renderIndex.h"

namespace mbfeat {

namespace {

constexpr HdDirtyBits kMeshBits =
    HdChangeTracker::DirtyPoints | HdChangeTracker::DirtyNormals | HdChangeTracker::DirtyPrimvar |
    HdChangeTracker::DirtyTopology | HdChangeTracker::DirtyDisplayStyle |
    HdChangeTracker::DirtyDoubleSided | HdChangeTracker::DirtySubdivTags |
    HdChangeTracker::DirtyMaterialId | HdChangeTracker::DirtyComputationPrimvarDesc;

// Visibility is among them for that of the instancer, which places nothing where it is invisible.
constexpr HdDirtyBits kTransformBits =
    HdChangeTracker::DirtyTransform | HdChangeTracker::DirtyInstancer |
    HdChangeTracker::DirtyInstanceIndex | HdChangeTracker::DirtyVisibility;

/// Slot of a material path in the list, which grows when the path is new.
std::uint16_t slotOf(std::vector<std::string>& materials, const std::string& path) {
    const auto found = std::find(materials.begin(), materials.end(), path);
    if (found == materials.end()) {
        materials.push_back(path);
        return static_cast<std::uint16_t>(materials.size() - 1);
    }
    return static_cast<std::uint16_t>(found - materials.begin());
}

} // namespace

MeshPrim::MeshPrim(const SdfPath& id, RenderParam& param)
    : HdMesh(id),
      param_(param),
      meshMessages_(param.diagnostics()),
      placeMessages_(param.diagnostics()),
      publishMessages_(param.diagnostics()) {
    geometry_.path = id.GetString();
    param_.registerMesh(this);
}

MeshPrim::~MeshPrim() {
    param_.unregisterMesh(this);
}

HdDirtyBits MeshPrim::GetInitialDirtyBitsMask() const {
    return HdChangeTracker::Clean | HdChangeTracker::InitRepr | kMeshBits | kTransformBits |
           HdChangeTracker::DirtyVisibility | HdChangeTracker::DirtyPrimID |
           HdChangeTracker::DirtyRepr | HdChangeTracker::DirtyRenderTag;
}

void MeshPrim::_InitRepr(const TfToken& reprToken, HdDirtyBits* /*dirtyBits*/) {
    const bool known = std::any_of(_reprs.begin(), _reprs.end(),
                                   [&](const auto& repr) { return repr.first == reprToken; });
    if (!known) {
        _reprs.emplace_back(reprToken, HdReprSharedPtr());
    }
}

void MeshPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam, HdDirtyBits* dirtyBits,
                    const TfToken& /*reprToken*/) {
    auto& param = *static_cast<RenderParam*>(renderParam);
    guarded(publishMessages_, geometry_.path, [&] { syncPrim(delegate, param, dirtyBits); });
    // Also the bits above those of the scene, which a host that marks everything dirty sets: with
    // any left the prim is synced again, and the render starts twice (test_blender.py).
    *dirtyBits = HdChangeTracker::Clean;
}

void MeshPrim::syncPrim(HdSceneDelegate* delegate, RenderParam& param, HdDirtyBits* dirtyBits) {
    delegate_ = delegate;
    const SdfPath& id = GetId();
    _UpdateVisibility(delegate, dirtyBits);
    _UpdateInstancer(delegate, dirtyBits);
    HdInstancer::_SyncInstancerAndParents(delegate->GetRenderIndex(), GetInstancerId());
    if ((*dirtyBits & HdChangeTracker::DirtyMaterialId) != 0) {
        SetMaterialId(delegate->GetMaterialId(id));
    }
    param.acquireSceneForEdit();
    if ((*dirtyBits & kMeshBits) != 0) {
        updateMesh(delegate, param);
    }
    if ((*dirtyBits & kTransformBits) != 0) {
        updateTransforms(delegate);
    }
    publish(param);
}

void MeshPrim::updateMaterials(HdSceneDelegate* /*delegate*/, const HdMeshTopology& topology) {
    geometry_.materials = {GetMaterialId().GetString()};
    subsetSlots_.clear();
    for (const HdGeomSubset& subset : topology.GetGeomSubsets()) {
        subsetSlots_.push_back(subset.materialId.IsEmpty()
                                   ? std::uint16_t{0}
                                   : slotOf(geometry_.materials, subset.materialId.GetString()));
    }
}

void MeshPrim::updateMesh(HdSceneDelegate* delegate, RenderParam& param) {
    meshMessages_.withdraw();
    HdMeshTopology topology = GetMeshTopology(delegate);
    updateMaterials(delegate, topology);
    const int refineLevel = GetDisplayStyle(delegate).refineLevel;
    if (refineLevel > 0 && topology.GetScheme() != tokens().none) {
        meshMessages_.report(
            Severity::kInfo, "complexity",
            "subdivision surfaces are rendered as their control meshes with smooth normals; the "
            "refinement level is not used.");
    }
    if (!delegate->GetLightParamValue(GetId(), TfToken("inputs:intensity")).IsEmpty()) {
        meshMessages_.warn(geometry_.path,
                           "mesh lights are not supported; it is rendered but "
                           "gives no light. Give it a material with emissiveColor.");
    }
    fetchedPrimvars_ = param.primvarsFor(geometry_.materials);
    const MeshSource source(*this, delegate, topology, subsetSlots_, fetchedPrimvars_,
                            meshMessages_);
    std::shared_ptr<const Mesh> mesh = buildMesh(source.raw(), meshMessages_);
    // Hosts and OpenUSD mark more than changed, e.g. meshes whose material got an input: what is
    // the same stays, with all that was built of it.
    if (geometry_.mesh == nullptr || !isSame(*mesh, *geometry_.mesh)) {
        geometry_.mesh = std::move(mesh);
    }
    if (geometry_.mesh->triangles.empty()) {
        param.countSkippedPrim();
    }
}

void MeshPrim::updateTransforms(HdSceneDelegate* delegate) {
    placeMessages_.withdraw();
    const AffineD local = toAffine(delegate->GetTransform(GetId()));
    geometry_.instanced = !GetInstancerId().IsEmpty();
    geometry_.instanceIds.clear();
    if (geometry_.instanced) {
        const auto* const instancer =
            dynamic_cast<InstancerPrim*>(delegate->GetRenderIndex().GetInstancer(GetInstancerId()));
        geometry_.transforms.clear();
        if (instancer != nullptr) {
            geometry_.transforms = instancer->computeTransforms(GetId());
            for (AffineD& transform : geometry_.transforms) {
                transform = concatenate(local, transform);
            }
        } else {
            placeMessages_.warn(geometry_.path, "its instancer " + GetInstancerId().GetString() +
                                                    " does not exist; nothing of it is rendered. "
                                                    "Check the instancer's prim.");
        }
    } else {
        geometry_.transforms = {local};
    }
    dropUnusable(geometry_, placeMessages_);
}

void MeshPrim::UpdateRenderTag(HdSceneDelegate* delegate, HdRenderParam* renderParam) {
    HdMesh::UpdateRenderTag(delegate, renderParam);
    auto& param = *static_cast<RenderParam*>(renderParam);
    guarded(publishMessages_, geometry_.path, [&] { updateFilter(param); });
}

bool MeshPrim::passesFilter(const VisibilityFilter& filter) const {
    return filter.accepts(geometry_.path, GetRenderTag().GetString());
}

void MeshPrim::publish(RenderParam& param) {
    geometry_.primId = GetPrimId();
    geometry_.visible = IsVisible() && passesFilter(param.filter());
    if (geometry_.mesh == nullptr) { // it could not be built: keep what was there
        return;
    }
    Scene& scene = param.acquireSceneForEdit();
    publishMessages_.withdraw();
    scene.setGeometry(geometry_, publishMessages_);
    published_ = true;
}

void MeshPrim::updateFilter(RenderParam& param) {
    const bool visible = IsVisible() && passesFilter(param.filter());
    if (published_ && visible != geometry_.visible) {
        publish(param);
    }
}

bool MeshPrim::lacksPrimvars() const {
    const std::set<std::string> wanted = param_.primvarsFor(geometry_.materials);
    return published_ && !std::includes(fetchedPrimvars_.begin(), fetchedPrimvars_.end(),
                                        wanted.begin(), wanted.end());
}

void MeshPrim::refetch() {
    param_.acquireSceneForEdit();
    updateMesh(delegate_, param_);
    publish(param_);
}

void MeshPrim::Finalize(HdRenderParam* renderParam) {
    auto& param = *static_cast<RenderParam*>(renderParam);
    if (published_) {
        param.acquireSceneForEdit().removeGeometry(geometry_.path);
        published_ = false;
    }
    HdMesh::Finalize(renderParam);
}

} // namespace mbfeat
