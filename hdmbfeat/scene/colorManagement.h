// Colour spaces and displays, through OpenColorIO, which stays behind this header.
//
// Names of colour spaces: those of the config with their aliases, the colour space tokens of
// OpenUSD and MaterialX ("lin_rec709_scene", "srgb_texture", "acescg" ...) and the roles of the
// config. "" is linear Rec.709, the rendering space unless another is chosen.
//
// Threads: everything is immutable once made and may be used from any thread.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbfeat {

/// The sRGB transfer curve (IEC 61966-2-1), extended beyond [0, 1] by its own formula and to
/// negative values by symmetry.
double decodeSrgb(double encoded);
double encodeSrgb(double linear);

/// In place on interleaved texels of 1..4 channels; alpha (channel 1 of two, 3 of four) is kept.
void decodeSrgb(float* values, std::size_t texels, int channels);
void encodeSrgb(float* values, std::size_t texels, int channels);

/// A conversion between two colour spaces, or to a display.
class ColorTransform {
public:
    virtual ~ColorTransform() = default;
    /// True when it changes nothing.
    virtual bool isIdentity() const = 0;
    /// In place on interleaved texels of three or four channels; alpha is kept.
    virtual void apply(float* values, std::size_t texels, int channels) const = 0;
};

/// What a space name means where no config is needed.
enum class WellKnownSpace {
    kOther,
    kRaw,          ///< "raw", "data", "identity", "unknown": values that are no colours
    kSrgb,         ///< sRGB-encoded Rec.709: "sRGB", "srgb_texture", "srgb_rec709_scene" ...
    kLinearRec709, ///< "", "lin_rec709", "lin_rec709_scene", "lin_srgb" ...
};
WellKnownSpace wellKnownSpace(const std::string& name);

/// An OpenColorIO config.
class ColorConfig {
    struct Impl;

public:
    explicit ColorConfig(std::unique_ptr<Impl> impl);
    /// The config of the OCIO environment variable (a file, or ocio://NAME of a built-in ACES
    /// config), else that of MBFEAT_OCIO_CONFIG, else the ACES CG config in the folder
    /// MBFEAT_OCIO_DIR or beside the library, else builtIn(). One that cannot be used is reported
    /// and passed over.
    static std::shared_ptr<const ColorConfig> fromEnvironment(Diagnostics& diagnostics);

    /// A config file, or ocio://NAME for NAME.ocio in those folders ("default",
    /// "cg-config-latest" and "studio-config-latest" are understood).
    static Result<std::shared_ptr<const ColorConfig>> open(const std::string& file);

    /// A small ACES 1.3 config that needs no file: ACES and common linear and texture spaces, an
    /// sRGB and a Rec.709 display with the ACES SDR, untone-mapped and raw views.
    static std::shared_ptr<const ColorConfig> builtIn();

    ~ColorConfig();
    ColorConfig(const ColorConfig&) = delete;
    ColorConfig& operator=(const ColorConfig&) = delete;

    /// Where it came from, for headers and messages: a file, or "built-in ACES".
    const std::string& source() const;
    std::vector<std::string> colorSpaces() const;
    std::vector<std::string> displays() const;
    std::vector<std::string> views(const std::string& display) const;
    std::string defaultDisplay() const;
    std::string defaultView(const std::string& display) const;

    /// The config's own name of the space, or "" when it has none such.
    std::string resolve(const std::string& name) const;

    /// The conversion between two spaces; cached. Where this config lacks one of them the
    /// built-in one is asked. Errors name the space and list what there is.
    Result<std::shared_ptr<const ColorTransform>> transform(const std::string& from,
                                                            const std::string& to) const;

    /// The conversion from a space to what `display` shows in `view`; "" is the default one.
    Result<std::shared_ptr<const ColorTransform>> displayTransform(const std::string& from,
                                                                   const std::string& display,
                                                                   const std::string& view) const;

    /// The name of the well-known chromaticities (CIE xy of red, green, blue and white), as a
    /// space name that transform() understands; "" when they are none of these.
    static std::string spaceOfChromaticities(const float (&xy)[8]);

private:
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
