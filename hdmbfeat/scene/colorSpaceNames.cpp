#include "scene/colorSpaceNames.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "scene/colorManagement.h"

namespace mbfeat {

namespace {

std::string lowerCase(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

bool isOneOf(const std::string& name, std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&name](const char* candidate) { return name == candidate; });
}

} // namespace

// clang-format off
#define MBFEAT_REC709 {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290}
#define MBFEAT_AP1 {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767}
#define MBFEAT_P3 {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290}
#define MBFEAT_ADOBE {0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290}
const std::vector<KnownSpace>& knownSpaces() {
    static const std::vector<KnownSpace> spaces = {
        {{"Linear Rec.709 (sRGB)", "lin_rec709", "lin_rec709_scene", "lin_rec709_srgb", "lin_srgb",
          "linear_rec709", "linear_srgb", "Utility - Linear - Rec.709", "Utility - Linear - sRGB"},
         MBFEAT_REC709, TransferCurve::kLinear},
        {{"sRGB - Texture", "srgb_tx", "srgb_texture", "srgb_rec709_scene", "srgb_rec709",
          "Utility - sRGB - Texture", "Input - Generic - sRGB - Texture", "sRGB"},
         MBFEAT_REC709, TransferCurve::kSrgb},
        {{"Gamma 1.8 Rec.709 - Texture", "g18_rec709", "g18_rec709_tx", "g18_rec709_scene"},
         MBFEAT_REC709, TransferCurve::kGamma18},
        {{"Gamma 2.2 Rec.709 - Texture", "g22_rec709", "g22_rec709_tx", "g22_rec709_scene"},
         MBFEAT_REC709, TransferCurve::kGamma22},
        {{"ACES2065-1", "lin_ap0", "lin_ap0_scene", "aces2065_1", "ACES - ACES2065-1"},
         {0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767}, TransferCurve::kLinear},
        {{"ACEScg", "lin_ap1", "lin_ap1_scene", "ACES - ACEScg"},
         MBFEAT_AP1, TransferCurve::kLinear},
        {{"sRGB Encoded AP1 - Texture", "srgb_ap1", "srgb_encoded_ap1_tx", "srgb_ap1_scene"},
         MBFEAT_AP1, TransferCurve::kSrgb},
        {{"Gamma 2.2 AP1 - Texture", "g22_ap1", "g22_ap1_tx", "g22_ap1_scene"},
         MBFEAT_AP1, TransferCurve::kGamma22},
        {{"Linear Rec.2020", "lin_rec2020", "lin_rec2020_scene", "Utility - Linear - Rec.2020"},
         {0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290}, TransferCurve::kLinear},
        {{"Linear P3-D65", "lin_p3d65", "lin_p3d65_scene", "lin_displayp3", "lin_displayp3_scene",
          "Utility - Linear - P3-D65"},
         MBFEAT_P3, TransferCurve::kLinear},
        {{"sRGB Encoded P3-D65 - Texture", "srgb_p3d65_scene", "srgb_displayp3",
          "srgb_displayp3_scene", "srgb_encoded_p3d65_tx"},
         MBFEAT_P3, TransferCurve::kSrgb},
        {{"Linear AdobeRGB", "lin_adobergb", "lin_adobergb_scene"},
         MBFEAT_ADOBE, TransferCurve::kLinear},
        {{"AdobeRGB - Texture", "adobergb", "g22_adobergb_scene", "g22_adobergb"},
         MBFEAT_ADOBE, TransferCurve::kAdobe},
        {{"Linear CIE-XYZ-D65", "lin_ciexyzd65_scene", "lin_ciexyzd65"},
         {1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0}, TransferCurve::kLinear},
    };
    return spaces;
}
#undef MBFEAT_REC709
#undef MBFEAT_AP1
#undef MBFEAT_P3
#undef MBFEAT_ADOBE
// clang-format on

const KnownSpace* findKnownSpace(const std::string& name) {
    const std::string wanted = lowerCase(name);
    for (const KnownSpace& space : knownSpaces()) {
        for (const std::string& candidate : space.names) {
            if (lowerCase(candidate) == wanted) {
                return &space;
            }
        }
    }
    return nullptr;
}

WellKnownSpace wellKnownSpace(const std::string& name) {
    if (name.empty()) {
        return WellKnownSpace::kLinearRec709;
    }
    if (isOneOf(lowerCase(name), {"raw", "data", "identity", "unknown", "none", "utility - raw"})) {
        return WellKnownSpace::kRaw;
    }
    const KnownSpace* space = findKnownSpace(name);
    return space == &knownSpaces()[0]   ? WellKnownSpace::kLinearRec709
           : space == &knownSpaces()[1] ? WellKnownSpace::kSrgb
                                        : WellKnownSpace::kOther;
}

std::string ColorConfig::spaceOfChromaticities(const float (&xy)[8]) {
    constexpr double kTolerance = 1e-3; // files round
    for (const KnownSpace& space : knownSpaces()) {
        bool same = space.curve == TransferCurve::kLinear;
        for (int i = 0; i < 8; ++i) {
            same = same && std::abs(static_cast<double>(xy[i]) - space.xy[i]) < kTolerance;
        }
        if (same) {
            return space.names[1];
        }
    }
    return {};
}

double decodeSrgb(double encoded) {
    const double x = std::abs(encoded);
    const double y = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    return std::copysign(y, encoded);
}

double encodeSrgb(double linear) {
    const double x = std::abs(linear);
    const double y = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
    return std::copysign(y, linear);
}

namespace {

template <class Curve>
void applyCurve(float* values, std::size_t texels, int channels, const Curve& curve) {
    const int colors = channels == 2 || channels == 4 ? channels - 1 : channels;
    for (std::size_t i = 0; i < texels; ++i) {
        float* texel = values + i * static_cast<std::size_t>(channels);
        for (int c = 0; c < colors; ++c) {
            texel[c] = static_cast<float>(curve(static_cast<double>(texel[c])));
        }
    }
}

} // namespace

void decodeSrgb(float* values, std::size_t texels, int channels) {
    applyCurve(values, texels, channels, [](double v) { return decodeSrgb(v); });
}

void encodeSrgb(float* values, std::size_t texels, int channels) {
    applyCurve(values, texels, channels, [](double v) { return encodeSrgb(v); });
}

} // namespace mbfeat
