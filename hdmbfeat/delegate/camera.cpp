#include "delegate/camera.h"

#include <cmath>

#include "delegate/conversions.h"

namespace mbfeat {

namespace {

// UsdGeomCamera's defaults, in tenths of a scene unit as HdCamera has them: only ratios matter.
constexpr float kDefaultAperture = 2.0955F;
constexpr float kDefaultFocalLength = 5.0F;

// GfCamera's default clipping range, which the free camera of the frame recorder has whatever the
// size of the stage: small ones would lose their front to it. This much nearer is far enough.
const GfRange1f kUnsetClippingRange(1.0F, 1000000.0F);
constexpr float kFreeCameraNear = 1e-4F;

/// Hosts put cameras of their own below a root that starts with an underscore.
bool isHostCamera(const HdCamera& prim) {
    return prim.GetId().GetString().rfind("/_", 0) == 0;
}

struct Lens {
    float horizontalAperture, verticalAperture, focalLength;
};

bool isUsable(float length) {
    return std::isfinite(length) && length > 0.0F;
}

Lens usableLens(const HdCamera& prim, double imageAspect, Diagnostics& diagnostics) {
    Lens lens{prim.GetHorizontalAperture(), prim.GetVerticalAperture(), prim.GetFocalLength()};
    const std::string path = prim.GetId().GetString();
    if (!isUsable(lens.horizontalAperture) || !isUsable(lens.verticalAperture)) {
        if (isUsable(lens.horizontalAperture)) {
            lens.verticalAperture = lens.horizontalAperture / static_cast<float>(imageAspect);
        } else if (isUsable(lens.verticalAperture)) {
            lens.horizontalAperture = lens.verticalAperture * static_cast<float>(imageAspect);
        } else {
            lens.horizontalAperture = kDefaultAperture;
            lens.verticalAperture = kDefaultAperture / static_cast<float>(imageAspect);
        }
        diagnostics.warn(path, "an aperture is zero, negative or not finite; the image's shape "
                               "and, where both are, an aperture of 20.955 mm are used. Author "
                               "horizontalAperture and verticalAperture.");
    }
    if (prim.GetProjection() == HdCamera::Perspective && !isUsable(lens.focalLength)) {
        lens.focalLength = kDefaultFocalLength / kDefaultAperture * lens.horizontalAperture;
        diagnostics.warn(path, "focalLength is zero, negative or not finite; the default field of "
                               "view is used. Author focalLength.");
    }
    return lens;
}

void setLens(const HdCamera& prim, const Lens& lens, const CameraRequest& request, Camera& camera) {
    // HdCamera's lengths are scene units already. On the plane z = -1 a filmback of the focal
    // length away shrinks by it; orthographic filmbacks are scene units themselves.
    const double scale = camera.orthographic ? 1.0 : 1.0 / lens.focalLength;
    const GfVec2d center(prim.GetHorizontalApertureOffset(), prim.GetVerticalApertureOffset());
    const GfVec2d half(0.5 * lens.horizontalAperture, 0.5 * lens.verticalAperture);
    const GfRange2d window =
        CameraUtilConformedWindow(GfRange2d((center - half) * scale, (center + half) * scale),
                                  request.conform, request.imageAspect);
    camera.windowMin = {static_cast<float>(window.GetMin()[0]),
                        static_cast<float>(window.GetMin()[1])};
    camera.windowMax = {static_cast<float>(window.GetMax()[0]),
                        static_cast<float>(window.GetMax()[1])};
}

void setClipping(const HdCamera& prim, Camera& camera, Diagnostics& diagnostics) {
    const GfRange1f& clipping = prim.GetClippingRange();
    if (clipping.GetMax() > clipping.GetMin()) {
        const bool unset = isHostCamera(prim) && clipping == kUnsetClippingRange;
        camera.nearClip = unset ? kFreeCameraNear : clipping.GetMin();
        camera.farClip = clipping.GetMax();
    } else if (clipping != GfRange1f()) { // that is one that nobody set
        diagnostics.warn(prim.GetId().GetString(),
                         "the near end of clippingRange is not before its far end; nothing is "
                         "clipped. Author a clippingRange of near, then far.");
    }
}

void setDepthOfField(const HdCamera& prim, const Lens& lens, Camera& camera,
                     Diagnostics& diagnostics) {
    const float fStop = prim.GetFStop();
    if (!isUsable(fStop) || camera.orthographic) {
        return;
    }
    if (!isUsable(prim.GetFocusDistance())) {
        diagnostics.warn(prim.GetId().GetString(),
                         "fStop is authored but focusDistance is not above 0; everything is "
                         "rendered in focus. Author focusDistance.");
        return;
    }
    camera.lensRadius = lens.focalLength / (2.0F * fStop);
    camera.focusDistance = prim.GetFocusDistance();
}

void reportIgnored(const HdCamera& prim, Diagnostics& diagnostics) {
    const std::string path = prim.GetId().GetString();
    if (!prim.GetClipPlanes().empty()) {
        diagnostics.warn(path, "clippingPlanes are not supported; nothing is clipped but by "
                               "clippingRange.");
    }
    const TfToken distortion = prim.GetLensDistortionType();
    if (!distortion.IsEmpty() && distortion != "standard") {
        diagnostics.warn(path, "a lens distortion of the type " + distortion.GetString() +
                                   " is not supported; the image is not distorted.");
    }
    if (prim.GetShutterClose() > prim.GetShutterOpen()) {
        // Cameras often have one, and often nothing moves: worth a word, but not a warning.
        diagnostics.report(Severity::kInfo, path,
                           "its shutter is open for a while, but motion blur is not supported; "
                           "everything stands where it is at the frame's time.");
    }
}

} // namespace

Camera translateCamera(const HdCamera& prim, const CameraRequest& request,
                       Diagnostics& diagnostics) {
    Camera camera;
    camera.toWorld = toAffine(prim.GetTransform());
    if (!isFinite(camera.toWorld) || camera.toWorld.determinant() == 0.0) {
        diagnostics.warn(prim.GetId().GetString(),
                         "its transform is singular or not finite; it stands at the origin and "
                         "looks along -z. Author scales that are not zero.");
        camera.toWorld = AffineD();
    }
    camera.orthographic = prim.GetProjection() == HdCamera::Orthographic;
    const Lens lens = usableLens(prim, request.imageAspect, diagnostics);
    setLens(prim, lens, request, camera);

    reportIgnored(prim, diagnostics);
    setClipping(prim, camera, diagnostics);
    if (request.depthOfField) {
        setDepthOfField(prim, lens, camera, diagnostics);
    }
    const float scale = prim.GetLinearExposureScale();
    camera.exposureScale = request.exposure && std::isfinite(scale) && scale > 0.0F ? scale : 1.0F;
    return camera;
}

} // namespace mbfeat
