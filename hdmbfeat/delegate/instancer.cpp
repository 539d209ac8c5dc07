#include "delegate/instancer.h"

#include <algorithm>

#include "delegate/conversions.h"
#include "delegate/guard.h"
#include "delegate/renderParam.h"
#include "delegate/tokens.h"
#include "pxr/base/gf/quatf.h"
#include "pxr/base/gf/quath.h"
#include "pxr/base/gf/rotation.h"
#include "pxr/base/gf/vec3h.h"
#include "pxr/base/vt/array.h"
#include "pxr/imaging/hd/changeTracker.h"
#include "pxr/imaging/hd/renderIndex.h"
#include "pxr/imaging/hd/sceneDelegate.h"

namespace mbfeat {

namespace {

template <class From, class To>
bool readArray(const VtValue& value, std::vector<To>& out) {
    if (!value.IsHolding<VtArray<From>>()) {
        return false;
    }
    const VtArray<From>& array = value.UncheckedGet<VtArray<From>>();
    out.clear();
    out.reserve(array.size());
    for (const From& element : array) {
        out.emplace_back(element);
    }
    return true;
}

/// Rotations also come as (real, i, j, k) in four floats.
bool readQuaternionVectors(const VtValue& value, std::vector<GfQuatd>& out) {
    if (!value.IsHolding<VtArray<GfVec4f>>()) {
        return false;
    }
    out.clear();
    for (const GfVec4f& q : value.UncheckedGet<VtArray<GfVec4f>>()) {
        out.emplace_back(q[0], GfVec3d(q[1], q[2], q[3]));
    }
    return true;
}

} // namespace

InstancerPrim::InstancerPrim(HdSceneDelegate* delegate, const SdfPath& id)
    : HdInstancer(delegate, id) {}

InstancerPrim::~InstancerPrim() = default;

void InstancerPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam,
                         HdDirtyBits* dirtyBits) {
    auto& param = *static_cast<RenderParam*>(renderParam);
    guarded(param.diagnostics(), GetId().GetString(), [&] {
        _UpdateInstancer(delegate, dirtyBits);
        if (HdChangeTracker::IsAnyPrimvarDirty(*dirtyBits, GetId())) {
            pull(delegate);
        }
    });
}

void InstancerPrim::pull(HdSceneDelegate* delegate) {
    // Attributes that are gone are not described any more.
    translations_.clear();
    rotations_.clear();
    scales_.clear();
    transforms_.clear();
    for (const HdPrimvarDescriptor& descriptor :
         delegate->GetPrimvarDescriptors(GetId(), HdInterpolationInstance)) {
        const TfToken& name = descriptor.name;
        const VtValue value = delegate->Get(GetId(), name);
        if (name == tokens().instanceTranslations) {
            readArray<GfVec3f>(value, translations_) || readArray<GfVec3d>(value, translations_);
        } else if (name == tokens().instanceScales) {
            readArray<GfVec3f>(value, scales_) || readArray<GfVec3d>(value, scales_);
        } else if (name == tokens().instanceRotations) {
            readArray<GfQuath>(value, rotations_) || readArray<GfQuatf>(value, rotations_) ||
                readArray<GfQuatd>(value, rotations_) || readQuaternionVectors(value, rotations_);
        } else if (name == tokens().instanceTransforms) {
            readArray<GfMatrix4d>(value, transforms_);
        }
    }
}

AffineD InstancerPrim::instanceTransform(std::size_t index) const {
    GfMatrix4d matrix(1.0);
    if (index < transforms_.size()) {
        matrix = transforms_[index];
    }
    if (index < scales_.size()) {
        matrix *= GfMatrix4d(1.0).SetScale(scales_[index]);
    }
    if (index < rotations_.size()) {
        matrix *= GfMatrix4d(1.0).SetRotate(rotations_[index].GetNormalized());
    }
    if (index < translations_.size()) {
        matrix *= GfMatrix4d(1.0).SetTranslate(translations_[index]);
    }
    return toAffine(matrix);
}

std::vector<AffineD> InstancerPrim::computeTransforms(const SdfPath& prototypeId) const {
    HdSceneDelegate* const delegate = GetDelegate();
    if (!delegate->GetVisible(GetId())) {
        return {};
    }
    const AffineD base = toAffine(delegate->GetInstancerTransform(GetId()));
    const VtIntArray indices = delegate->GetInstanceIndices(GetId(), prototypeId);
    std::vector<AffineD> own;
    own.reserve(indices.size());
    for (const int index : indices) {
        if (index >= 0) {
            own.push_back(concatenate(instanceTransform(static_cast<std::size_t>(index)), base));
        }
    }
    if (GetParentId().IsEmpty()) {
        return own;
    }
    const auto* const parent =
        dynamic_cast<InstancerPrim*>(delegate->GetRenderIndex().GetInstancer(GetParentId()));
    if (parent == nullptr) {
        return own;
    }
    const std::vector<AffineD> outer = parent->computeTransforms(GetId());
    std::vector<AffineD> all;
    all.reserve(own.size() * outer.size());
    for (const AffineD& placement : outer) {
        for (const AffineD& transform : own) {
            all.push_back(concatenate(transform, placement));
        }
    }
    return all;
}

void dropUnusable(Geometry& geometry, Diagnostics& diagnostics) {
    std::vector<AffineD>& transforms = geometry.transforms;
    const std::size_t total = transforms.size();
    std::size_t kept = 0;
    const bool numbered = !geometry.instanceIds.empty();
    std::vector<std::int32_t> ids;
    for (std::size_t i = 0; i < total; ++i) {
        if (isFinite(transforms[i]) && transforms[i].determinant() != 0.0) {
            ids.push_back(numbered ? geometry.instanceIds[i] : static_cast<std::int32_t>(i));
            transforms[kept++] = transforms[i];
        }
    }
    if (kept == total) {
        return;
    }
    transforms.resize(kept);
    geometry.instanceIds = std::move(ids);
    diagnostics.warn(geometry.path,
                     std::to_string(total - kept) + " of " + std::to_string(total) +
                         " transforms are singular or not finite; what they place is not "
                         "rendered. Author scales that are not zero.");
}

} // namespace mbfeat
