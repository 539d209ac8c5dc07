#pragma once

#include "pxr/base/gf/vec3i.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/aov.h"
#include "pxr/imaging/hd/bprim.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// An image that a render pass fills. Applications destroy and re-create all buffers of a pass when
/// AOVs or the size change: never keep a pointer across frames.
class HdRenderBuffer : public HdBprim {
public:
    enum DirtyBits : HdDirtyBits {
        Clean = 0,
        DirtyDescription = 1 << 0,
        AllDirty = DirtyDescription
    };

    explicit HdRenderBuffer(const SdfPath& id);
    ~HdRenderBuffer() override;

    HdDirtyBits GetInitialDirtyBitsMask() const override;
    /// Reads the descriptor, calls Allocate and clears the bits.
    void Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;
    /// Calls _Deallocate.
    void Finalize(HdRenderParam* renderParam) override;

    /// Makes room for dimensions pixels; false if it cannot.
    virtual bool Allocate(const GfVec3i& dimensions, HdFormat format, bool multiSampled) = 0;
    virtual unsigned int GetWidth() const = 0;
    virtual unsigned int GetHeight() const = 0;
    virtual unsigned int GetDepth() const = 0;
    virtual HdFormat GetFormat() const = 0;
    virtual bool IsMultiSampled() const = 0;
    /// Pixels for reading or writing, bottom row first; valid until the matching Unmap.
    virtual void* Map() = 0;
    virtual void Unmap() = 0;
    virtual bool IsMapped() const = 0;
    /// Makes the latest samples visible through Map.
    virtual void Resolve() = 0;
    virtual bool IsConverged() const = 0;
    /// A GPU resource; empty for a CPU delegate.
    virtual VtValue GetResource(bool multiSampled) const;

protected:
    virtual void _Deallocate() = 0;
};
HYDRA_INTERFACE_SIZE(HdRenderBuffer, 16, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
