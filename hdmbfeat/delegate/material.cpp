#include "delegate/material.h"

#include <set>
#include <string>

#include "delegate/guard.h"
#include "delegate/materialNetwork.h"
#include "delegate/renderParam.h"
#include "pxr/imaging/hd/renderIndex.h"
#include "pxr/imaging/hd/sceneDelegate.h"

namespace mbfeat {

namespace {

std::set<std::string> primvarsOf(Material& material) {
    std::set<std::string> names;
    for (const TextureNode& texture : material.textures) {
        names.insert(texture.uvPrimvar);
    }
    for (const auto& [name, input] : inputsOf(material)) {
        if (input->source == MaterialInput::Source::kPrimvar) {
            names.insert(input->primvar);
        }
    }
    names.erase("");
    return names;
}

} // namespace

MaterialPrim::MaterialPrim(const SdfPath& id, RenderParam& param)
    : HdMaterial(id),
      messages_(param.diagnostics()) {}

MaterialPrim::~MaterialPrim() = default;

void MaterialPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam,
                        HdDirtyBits* dirtyBits) {
    auto& param = *static_cast<RenderParam*>(renderParam);
    const std::string path = GetId().GetString();
    guarded(messages_, path, [&] {
        param.acquireSceneForEdit(); // no job counts messages while they change
        messages_.withdraw();
        const VtValue resource = delegate->GetMaterialResource(GetId());
        HdMaterialNetwork2 network;
        if (resource.IsHolding<HdMaterialNetworkMap>()) {
            network = HdConvertToHdMaterialNetwork2(resource.UncheckedGet<HdMaterialNetworkMap>());
        }
        std::optional<Material> material = translateMaterial(path, network, messages_);
        const std::set<std::string> primvars =
            material ? primvarsOf(*material) : std::set<std::string>();
        if (material) {
            param.acquireSceneForEdit().setMaterial(std::move(*material));
        } else {
            param.acquireSceneForEdit().removeMaterial(path);
        }
        // Meshes keep only the primvars that something reads, so those synced before must fetch
        // what this material newly reads.
        if (param.setMaterialPrimvars(path, primvars)) {
            param.markStaleMeshes(delegate->GetRenderIndex().GetChangeTracker());
        }
    });
    *dirtyBits = Clean;
}

void MaterialPrim::Finalize(HdRenderParam* renderParam) {
    auto& param = *static_cast<RenderParam*>(renderParam);
    param.removeMaterial(GetId().GetString());
    param.acquireSceneForEdit().removeMaterial(GetId().GetString());
    HdMaterial::Finalize(renderParam);
}

} // namespace mbfeat
