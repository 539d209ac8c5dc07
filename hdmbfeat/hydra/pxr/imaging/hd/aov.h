#pragma once

#include "pxr/base/gf/vec3i.h"
#include "pxr/base/tf/hashmap.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

class HdRenderBuffer;

using HdAovSettingsMap = TfHashMap<TfToken, VtValue, TfToken::HashFunctor>;

/// What a delegate would like an AOV's buffer to be; HdFormatInvalid says that it has no such AOV.
struct HdAovDescriptor {
    HdAovDescriptor() : format(HdFormatInvalid), multiSampled(false) {}
    HdAovDescriptor(HdFormat format_, bool multiSampled_, const VtValue& clearValue_)
        : format(format_),
          multiSampled(multiSampled_),
          clearValue(clearValue_) {}

    HdFormat format;
    bool multiSampled;
    VtValue clearValue;
    HdAovSettingsMap aovSettings;
};
HYDRA_INTERFACE_SIZE(HdAovDescriptor, 64, 8);

using HdAovDescriptorList = std::vector<HdAovDescriptor>;

/// One AOV bound to a render pass. The buffer may be null: then look renderBufferId up in the
/// index.
struct HdRenderPassAovBinding {
    HdRenderPassAovBinding() : renderBuffer(nullptr) {}

    TfToken aovName;
    HdRenderBuffer* renderBuffer;
    SdfPath renderBufferId;
    VtValue clearValue;
    HdAovSettingsMap aovSettings;
};
HYDRA_INTERFACE_SIZE(HdRenderPassAovBinding, 80, 8);

using HdRenderPassAovBindingVector = std::vector<HdRenderPassAovBinding>;

/// Size (pixels) and format of a render buffer.
struct HdRenderBufferDescriptor {
    HdRenderBufferDescriptor() : dimensions(0), format(HdFormatInvalid), multiSampled(false) {}
    HdRenderBufferDescriptor(const GfVec3i& dimensions_, HdFormat format_, bool multiSampled_)
        : dimensions(dimensions_),
          format(format_),
          multiSampled(multiSampled_) {}

    bool operator==(const HdRenderBufferDescriptor& other) const {
        return dimensions == other.dimensions && format == other.format &&
               multiSampled == other.multiSampled;
    }
    bool operator!=(const HdRenderBufferDescriptor& other) const { return !(*this == other); }

    GfVec3i dimensions;
    HdFormat format;
    bool multiSampled;
};
HYDRA_INTERFACE_SIZE(HdRenderBufferDescriptor, 20, 4);

/// An AOV's name without its prefix (primvars:, lpe:, shader:), and which prefix it had.
struct HdParsedAovToken {
    HdParsedAovToken();
    explicit HdParsedAovToken(const TfToken& aovName);

    TfToken name;
    bool isPrimvar : 1;
    bool isLpe : 1;
    bool isShader : 1;
};
HYDRA_INTERFACE_SIZE(HdParsedAovToken, 16, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
