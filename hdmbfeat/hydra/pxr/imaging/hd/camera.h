#pragma once

#include "pxr/base/gf/matrix4d.h"
#include "pxr/base/gf/range1f.h"
#include "pxr/base/gf/vec2f.h"
#include "pxr/base/gf/vec4d.h"
#include "pxr/base/tf/token.h"
#include "pxr/imaging/cameraUtil/conformWindow.h"
#include "pxr/imaging/hd/sprim.h"
#include "pxr/imaging/interface.h"

#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

/// A camera. Apertures, focal length and distances are in scene units (a 50 mm lens is 5 in a scene
/// of centimetres); shutter times are frames relative to the current one.
class HdCamera : public HdSprim {
public:
    enum DirtyBits : HdDirtyBits {
        Clean = 0,
        DirtyTransform = 1 << 0,
        DirtyParams = 1 << 1,
        DirtyClipPlanes = 1 << 2,
        DirtyWindowPolicy = 1 << 3,
        AllDirty = DirtyTransform | DirtyParams | DirtyClipPlanes | DirtyWindowPolicy
    };
    enum Projection { Perspective = 0, Orthographic };

    explicit HdCamera(const SdfPath& id);
    ~HdCamera() override;

    /// Fills the members below. A subclass calls it with the bits before using them.
    void Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;
    HdDirtyBits GetInitialDirtyBitsMask() const override;

    /// Camera to world.
    const GfMatrix4d& GetTransform() const { return _transform; }
    Projection GetProjection() const { return _projection; }
    float GetHorizontalAperture() const { return _horizontalAperture; }
    float GetVerticalAperture() const { return _verticalAperture; }
    float GetHorizontalApertureOffset() const { return _horizontalApertureOffset; }
    float GetVerticalApertureOffset() const { return _verticalApertureOffset; }
    float GetFocalLength() const { return _focalLength; }
    const GfRange1f& GetClippingRange() const { return _clippingRange; }
    const std::vector<GfVec4d>& GetClipPlanes() const { return _clipPlanes; }

    float GetFStop() const { return _fStop; }
    float GetFocusDistance() const { return _focusDistance; }
    bool GetFocusOn() const { return _focusOn; }
    float GetDofAspect() const { return _dofAspect; }

    int GetSplitDiopterCount() const { return _splitDiopterCount; }
    float GetSplitDiopterAngle() const { return _splitDiopterAngle; }
    float GetSplitDiopterOffset1() const { return _splitDiopterOffset1; }
    float GetSplitDiopterWidth1() const { return _splitDiopterWidth1; }
    float GetSplitDiopterFocusDistance1() const { return _splitDiopterFocusDistance1; }
    float GetSplitDiopterOffset2() const { return _splitDiopterOffset2; }
    float GetSplitDiopterWidth2() const { return _splitDiopterWidth2; }
    float GetSplitDiopterFocusDistance2() const { return _splitDiopterFocusDistance2; }

    double GetShutterOpen() const { return _shutterOpen; }
    double GetShutterClose() const { return _shutterClose; }
    /// Stops; already part of the linear scale.
    float GetExposure() const { return _exposure; }
    /// Factor on radiance from exposure, exposure time, ISO, f-stop and responsivity together.
    float GetLinearExposureScale() const { return _linearExposureScale; }

    TfToken GetLensDistortionType() const { return _lensDistortionType; }
    float GetLensDistortionK1() const { return _lensDistortionK1; }
    float GetLensDistortionK2() const { return _lensDistortionK2; }
    const GfVec2f& GetLensDistortionCenter() const { return _lensDistortionCenter; }
    float GetLensDistortionAnaSq() const { return _lensDistortionAnaSq; }
    const GfVec2f& GetLensDistortionAsym() const { return _lensDistortionAsym; }
    float GetLensDistortionScale() const { return _lensDistortionScale; }
    float GetLensDistortionIor() const { return _lensDistortionIor; }

    const CameraUtilConformWindowPolicy& GetWindowPolicy() const { return _windowPolicy; }
    GfMatrix4d ComputeProjectionMatrix() const;

protected:
    GfMatrix4d _transform;
    Projection _projection;
    float _horizontalAperture;
    float _verticalAperture;
    float _horizontalApertureOffset;
    float _verticalApertureOffset;
    float _focalLength;
    GfRange1f _clippingRange;
    std::vector<GfVec4d> _clipPlanes;
    float _fStop;
    float _focusDistance;
    bool _focusOn;
    float _dofAspect;
    int _splitDiopterCount;
    float _splitDiopterAngle;
    float _splitDiopterOffset1;
    float _splitDiopterWidth1;
    float _splitDiopterFocusDistance1;
    float _splitDiopterOffset2;
    float _splitDiopterWidth2;
    float _splitDiopterFocusDistance2;
    double _shutterOpen;
    double _shutterClose;
    float _exposure;
    float _exposureTime;
    float _exposureIso;
    float _exposureFStop;
    float _exposureResponsivity;
    float _linearExposureScale;
    TfToken _lensDistortionType;
    float _lensDistortionK1;
    float _lensDistortionK2;
    GfVec2f _lensDistortionCenter;
    float _lensDistortionAnaSq;
    GfVec2f _lensDistortionAsym;
    float _lensDistortionScale;
    float _lensDistortionIor;
    CameraUtilConformWindowPolicy _windowPolicy;
};
HYDRA_INTERFACE_SIZE(HdCamera, 336, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
