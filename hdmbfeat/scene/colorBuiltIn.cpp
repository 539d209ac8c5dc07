#include "scene/colorBuiltIn.h"

#include "core/affine.h"
#include "scene/colorSpaceNames.h"

namespace mbfeat {

namespace {

constexpr const char* kToXyz = "UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD";
constexpr const char* kReference = "ACES2065-1";
constexpr const char* kFilmView = "ACES 1.0 - SDR Video";
constexpr const char* kPlainView = "Un-tone-mapped";

OCIO::TransformRcPtr
builtinTransform(const char* style,
                 OCIO::TransformDirection direction = OCIO::TRANSFORM_DIR_FORWARD) {
    const auto transform = OCIO::BuiltinTransform::Create();
    transform->setStyle(style);
    transform->setDirection(direction);
    return transform;
}

/// RGB to XYZ of given primaries, with Y = 1 for white (SMPTE RP 177).
OCIO::TransformRcPtr rgbToXyz(const double (&xy)[8]) {
    const auto xyz = [&xy](int i) {
        const double x = xy[2 * i];
        const double y = xy[2 * i + 1];
        return Double3(x, y, 1.0 - x - y);
    };
    AffineD primaries;
    primaries.x = xyz(0);
    primaries.y = xyz(1);
    primaries.z = xyz(2);
    const Double3 white = xyz(3) / xy[7];
    const Double3 scale = primaries.inverse().vector(white);
    const Double3 columns[3] = {primaries.x * scale.x, primaries.y * scale.y,
                                primaries.z * scale.z};
    double matrix[16] = {};
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            matrix[4 * row + column] = columns[column][row];
        }
    }
    matrix[15] = 1.0;
    const auto transform = OCIO::MatrixTransform::Create();
    transform->setMatrix(matrix);
    return transform;
}

void appendCurve(const OCIO::GroupTransformRcPtr& group, TransferCurve curve) {
    if (curve == TransferCurve::kLinear) {
        return;
    }
    if (curve == TransferCurve::kSrgb) {
        const auto transform = OCIO::ExponentWithLinearTransform::Create();
        transform->setGamma({2.4, 2.4, 2.4, 1.0});
        transform->setOffset({0.055, 0.055, 0.055, 0.0});
        transform->setNegativeStyle(OCIO::NEGATIVE_MIRROR);
        group->appendTransform(transform);
        return;
    }
    const double gamma = curve == TransferCurve::kGamma18   ? 1.8
                         : curve == TransferCurve::kGamma22 ? 2.2
                                                            : 563.0 / 256.0;
    const auto transform = OCIO::ExponentTransform::Create();
    transform->setValue({gamma, gamma, gamma, 1.0});
    transform->setNegativeStyle(OCIO::NEGATIVE_MIRROR);
    group->appendTransform(transform);
}

/// Spaces with the ACES white take the ACES matrices, others go through XYZ with D65.
void appendPrimaries(const OCIO::GroupTransformRcPtr& group, const KnownSpace& space) {
    const KnownSpace* acescg = findKnownSpace("ACEScg");
    if (space.names[0] == "ACES2065-1") {
        return;
    }
    if (space.xy[0] == acescg->xy[0]) {
        group->appendTransform(builtinTransform("ACEScg_to_ACES2065-1"));
        return;
    }
    if (space.names[0] != "Linear CIE-XYZ-D65") {
        group->appendTransform(rgbToXyz(space.xy));
    }
    group->appendTransform(builtinTransform(kToXyz, OCIO::TRANSFORM_DIR_INVERSE));
}

void addSceneSpaces(const OCIO::ConfigRcPtr& config) {
    for (const KnownSpace& known : knownSpaces()) {
        const auto space = OCIO::ColorSpace::Create(OCIO::REFERENCE_SPACE_SCENE);
        space->setName(known.names[0].c_str());
        for (std::size_t i = 1; i < known.names.size(); ++i) {
            space->addAlias(known.names[i].c_str());
        }
        const auto group = OCIO::GroupTransform::Create();
        appendCurve(group, known.curve);
        appendPrimaries(group, known);
        if (group->getNumTransforms() > 0) {
            space->setTransform(group, OCIO::COLORSPACE_DIR_TO_REFERENCE);
        }
        config->addColorSpace(space);
    }
    const auto raw = OCIO::ColorSpace::Create(OCIO::REFERENCE_SPACE_SCENE);
    raw->setName("Raw");
    raw->setIsData(true);
    config->addColorSpace(raw);
}

void addView(const OCIO::ConfigRcPtr& config, const char* name, const char* style) {
    const auto view = OCIO::ViewTransform::Create(OCIO::REFERENCE_SPACE_SCENE);
    view->setName(name);
    view->setTransform(builtinTransform(style), OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE);
    config->addViewTransform(view);
    config->addSharedView(name, name, OCIO::OCIO_VIEW_USE_DISPLAY_NAME, "", "", "");
}

void addDisplay(const OCIO::ConfigRcPtr& config, const char* name, const char* style) {
    const auto space = OCIO::ColorSpace::Create(OCIO::REFERENCE_SPACE_DISPLAY);
    space->setName(name);
    space->setTransform(builtinTransform(style), OCIO::COLORSPACE_DIR_FROM_REFERENCE);
    config->addColorSpace(space);
    config->addDisplaySharedView(name, kFilmView);
    config->addDisplaySharedView(name, kPlainView);
    config->addDisplayView(name, "Raw", "Raw", "");
}

} // namespace

OCIO::ConstConfigRcPtr makeBuiltInConfig() {
    const auto config = OCIO::Config::Create();
    config->setVersion(2, 1);
    addSceneSpaces(config);
    const auto xyz = OCIO::ColorSpace::Create(OCIO::REFERENCE_SPACE_DISPLAY);
    xyz->setName("CIE-XYZ-D65");
    config->addColorSpace(xyz);
    addView(config, kFilmView, "ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0");
    addView(config, kPlainView, kToXyz);
    config->setDefaultViewTransformName(kPlainView);
    addDisplay(config, "sRGB - Display", "DISPLAY - CIE-XYZ-D65_to_sRGB");
    addDisplay(config, "Rec.1886 Rec.709 - Display", "DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709");
    config->setActiveViews((std::string(kFilmView) + "," + kPlainView + ",Raw").c_str());
    config->setRole("aces_interchange", kReference);
    config->setRole("cie_xyz_d65_interchange", "CIE-XYZ-D65");
    config->setRole("scene_linear", "ACEScg");
    config->setRole("default", kReference);
    config->validate();
    return config;
}

} // namespace mbfeat
