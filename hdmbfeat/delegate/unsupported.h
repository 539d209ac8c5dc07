// Prims that are not rendered: Hydra is told that we take them, so that each that a stage uses can
// be named.
#pragma once

#include "pxr/pxr.h"

#include <string>

#include "core/diagnostics.h"
#include "pxr/imaging/hd/rprim.h"
#include "pxr/imaging/hd/sprim.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class RenderParam;

/// Types of prims that are seen, and of lights, that are only named.
const TfTokenVector& unsupportedRprimTypes();
const TfTokenVector& unsupportedSprimTypes();
bool isUnsupportedRprim(const TfToken& typeId);
bool isUnsupportedSprim(const TfToken& typeId);

/// Curves and the like: pulls no data, and says that it is not rendered while it is visible.
class UnsupportedRprim final : public HdRprim {
public:
    UnsupportedRprim(const TfToken& typeId, const SdfPath& id, RenderParam& param);
    ~UnsupportedRprim() override;

    HdDirtyBits GetInitialDirtyBitsMask() const override;
    void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam, HdDirtyBits* dirtyBits,
              const TfToken& reprToken) override;
    const TfTokenVector& GetBuiltinPrimvarNames() const override;

protected:
    HdDirtyBits _PropagateDirtyBits(HdDirtyBits bits) const override { return bits; }
    void _InitRepr(const TfToken& reprToken, HdDirtyBits* dirtyBits) override;

private:
    std::string type_;
    RenderParam& param_;
    Diagnostics messages_;
};

/// Lights that are not lit, and light filters.
class UnsupportedSprim final : public HdSprim {
public:
    UnsupportedSprim(const TfToken& typeId, const SdfPath& id, RenderParam& param);
    ~UnsupportedSprim() override;

    HdDirtyBits GetInitialDirtyBitsMask() const override;
    void Sync(HdSceneDelegate* delegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;

private:
    std::string type_;
    RenderParam& param_;
    Diagnostics messages_;
};

} // namespace mbfeat
