// Render settings: one table of what can be set, and the resolution of who set it.
//
// Every `mbfeat:*` name is an entry of settingTable(). Descriptors of the render delegate, the USD
// schema, the environment variables, the command line, the docs and the tests come from it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/diagnostics.h"
#include "core/effects.h"

namespace mbfeat {

using SettingValue = std::variant<bool, std::int64_t, double, std::string>;

/// In rising precedence.
enum class SettingSource : std::uint8_t { kDefault, kHost, kPrim, kEnvironment, kCommandLine };
/// "default", "host", "prim", "environment", "command line".
const char* settingSourceName(SettingSource source);

struct SettingDescriptor {
    std::string name;  ///< "mbfeat:samplesPerPixel"
    std::string label; ///< "Samples per pixel", for menus
    SettingValue defaultValue;
    double minimum = 0.0, maximum = 0.0; ///< inclusive, for numbers
    std::vector<std::string> allowed;    ///< for tokens: the valid values; empty: free text
    std::string doc;                     ///< one sentence, with the unit
    bool isAsset = false;                ///< a text that names a file
    Status (*check)(const std::string&) = nullptr; ///< of a free text: what is wrong with it
};

/// What a render is told, RenderOptions below.
const std::vector<SettingDescriptor>& settingTable();

/// What the denoiser is told (`mbfeat:denoise:*`), on a RenderPass or RenderSettings prim, or like
/// any other setting.
const std::vector<SettingDescriptor>& denoiseSettingTable();

/// "MBFEAT_SAMPLES_PER_PIXEL" for "mbfeat:samplesPerPixel".
std::string settingEnvironmentName(const std::string& name);

/// The layered values. Not thread-safe: the owner guards it.
class Settings {
public:
    /// Sets a value; a text is parsed, and numbers are converted where nothing is lost. An unknown
    /// name or a bad value is an error that names the nearest valid one and changes nothing.
    Status set(SettingSource source, const std::string& name, const SettingValue& value);
    /// Drops what that source set (the settings prim changed).
    void clear(SettingSource source);
    /// Reads the MBFEAT_* variables of the table; one error for each bad or unknown one.
    std::vector<Error> readEnvironment();

    const SettingValue& value(const std::string& name) const; ///< name is in the table
    SettingSource source(const std::string& name) const;

    struct Resolved {
        std::string name;
        SettingValue value;
        SettingSource source;
    };
    /// All settings in table order, those of the denoiser where it is on, for headers and reports.
    std::vector<Resolved> resolved() const;

private:
    std::map<std::string, std::map<SettingSource, SettingValue>> layers_;
};

/// The value as it is written in headers and on command lines.
std::string toString(const SettingValue& value);

enum class PixelFilter : std::uint8_t { kBox, kTriangle, kGaussian, kBlackmanHarris, kMitchell };
enum class OnError : std::uint8_t { kWarn, kAbort };
/// Implementations of the integrator. All give the same image.
enum class Kernel : std::uint8_t { kAuto, kScalar, kAvx2, kAvx512 };

/// Which features of paths the denoiser's network is shown.
enum class DenoiseFeatures : std::uint8_t { kAuto, kNone, kFirstHit, kMultiBounce };

struct DenoiseSettings {
    bool enabled = false;
    std::string model; ///< a file, or the name of one that MBFeat comes with; empty: the default
    DenoiseFeatures features = DenoiseFeatures::kAuto;
    int tile = 0;        ///< pixels on a side; 0: from `memory`
    double memory = 3.0; ///< GiB
    bool combine = true; ///< take over from the rendered image where it is the better one
};

/// The largest number of bounces that can be asked for.
inline constexpr int kMostBounces = 1024;

/// RenderOptions::splitting that leaves the choice to a trial, see integrate/splitting.h.
inline constexpr int kFittedSplitting = 0;

/// The resolved settings with C++ types, as the renderer wants them.
struct RenderOptions {
    int samplesPerPixel = 64; ///< of every pixel; with a target or a time limit: the most
    double targetError = 0.0; ///< relative error to stop at, see film/errorEstimate.h; 0: none
    double timeLimit = 0.0;   ///< seconds; 0: none
    bool adaptive = true;     ///< with a target: parts that reached it get no more samples
    int maxBounces = 12;      ///< scattering events after the camera ray; 0 sees emission only
    // Of these the kind's own: diffuse, reflection by anything else, transmission.
    int maxDiffuse = kMostBounces, maxReflection = kMostBounces, maxTransmission = kMostBounces;
    bool caustics = true; ///< light that sharp surfaces throw on wide ones
    bool blur = true;     ///< depth of field
    EffectRequest effects;
    std::uint64_t seed = 0;
    int threads = 0; ///< 0: one a core
    PixelFilter pixelFilter = PixelFilter::kBlackmanHarris;
    float pixelFilterWidth = 3.0F; ///< full width, pixels
    int russianRouletteStart = 2;  ///< wide scatterings after which a path may be ended
    int splitting = 0;        ///< paths that one becomes at its first wide surface; 0: as it pays
    float clampDirect = 0.0F; ///< largest sample value, 0: no clamp (biased when on)
    float clampIndirect = 0.0F;
    bool robust = true; ///< Embree's watertight traversal
    Kernel kernel = Kernel::kAuto;
    int tileSize = 0;    ///< pixels on a side; 0: fitted
    std::string viewAov; ///< AOV shown as `color`; empty: the image itself
    OnError onError = OnError::kWarn;
    double pathSampleMemory = 4.0; ///< GiB that per-path samples may take
    DenoiseSettings denoise;

    /// Whether paths have to look at what kinds of scattering they have gone through.
    bool limitsKinds() const {
        return !caustics || maxDiffuse < maxBounces || maxReflection < maxBounces ||
               maxTransmission < maxBounces;
    }
};

/// Whether the error is to be estimated, from two halves of the samples.
inline bool estimatesError(const RenderOptions& options) {
    return options.targetError > 0.0 || options.timeLimit > 0.0;
}

RenderOptions resolveOptions(const Settings& settings);

} // namespace mbfeat
