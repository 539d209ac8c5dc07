#pragma once

#include "pxr/base/gf/matrix4d.h"
#include "pxr/base/gf/vec4d.h"
#include "pxr/base/gf/vec4f.h"
#include "pxr/imaging/cameraUtil/framing.h"
#include "pxr/imaging/hd/aov.h"
#include "pxr/imaging/interface.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

class HdCamera;
class HdResourceRegistry;

/// Camera, framing and AOV bindings of one execution of a render pass.
class HdRenderPassState {
public:
    using ClipPlanesVector = std::vector<GfVec4d>;

    HdRenderPassState();
    virtual ~HdRenderPassState();

    virtual void Prepare(const std::shared_ptr<HdResourceRegistry>& resourceRegistry);

    void SetCamera(const HdCamera* camera);
    void SetOverrideWindowPolicy(
        const std::optional<CameraUtilConformWindowPolicy>& overrideWindowPolicy);
    void SetFraming(const CameraUtilFraming& framing);
    /// Also resets the framing to invalid.
    void SetViewport(const GfVec4d& viewport);

    const HdCamera* GetCamera() const { return _camera; }
    const CameraUtilFraming& GetFraming() const { return _framing; }
    const std::optional<CameraUtilConformWindowPolicy>& GetOverrideWindowPolicy() const {
        return _overrideWindowPolicy;
    }
    /// x, y, width, height in pixels, y up; meant for an invalid framing only.
    const GfVec4f& GetViewport() const { return _viewport; }
    /// The override if there is one, else the camera's.
    CameraUtilConformWindowPolicy GetWindowPolicy() const;
    GfMatrix4d GetImageToWorldMatrix() const;

    virtual GfMatrix4d GetWorldToViewMatrix() const;
    /// With framing and window policy applied.
    virtual GfMatrix4d GetProjectionMatrix() const;
    virtual const ClipPlanesVector& GetClipPlanes() const;

    void SetLightingEnabled(bool enabled);
    bool GetLightingEnabled() const { return _lightingEnabled; }
    void SetClippingEnabled(bool enabled);
    bool GetClippingEnabled() const { return _clippingEnabled; }
    void SetEnableExposureCompensation(bool enabled);
    bool GetEnableExposureCompensation() const { return _enableExposureCompensation; }

    void SetAovBindings(const HdRenderPassAovBindingVector& aovBindings);
    const HdRenderPassAovBindingVector& GetAovBindings() const;
    void SetAovInputBindings(const HdRenderPassAovBindingVector& aovBindings);
    const HdRenderPassAovBindingVector& GetAovInputBindings() const;

private:
    const HdCamera* _camera;
    GfVec4f _viewport;
    CameraUtilFraming _framing;
    std::optional<CameraUtilConformWindowPolicy> _overrideWindowPolicy;
    std::byte _opaqueStyle[52];
    bool _lightingEnabled;
    bool _clippingEnabled;
    bool _enableExposureCompensation;
    alignas(4) std::byte _opaqueRaster[252];
};
HYDRA_INTERFACE_SIZE(HdRenderPassState, 384, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
