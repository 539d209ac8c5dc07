#include "core/settings.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <system_error>

#include <unistd.h>

#include "core/editDistance.h"
#include "core/text.h"

namespace mbfeat {

namespace {

constexpr std::string_view kPrefix = "mbfeat:";
constexpr std::string_view kEnvironmentPrefix = "MBFEAT_";

// Largest integer up to which every one is a double: bounds of integer settings are doubles, and
// USD files written by scripts often hold doubles.
constexpr double kLargestInteger = 9007199254740991.0;

// Variables of that prefix that say where things lie; they are no settings.
constexpr std::array<std::string_view, 10> kOtherVariables = {
    "MBFEAT_USD_ROOT",   "MBFEAT_OCIO_DIR",    "MBFEAT_OCIO_CONFIG", "MBFEAT_BUILD_DIR",
    "MBFEAT_PXR",        "MBFEAT_BPY_WHEEL",   "MBFEAT_PYTHON",      "MBFEAT_ARCH",
    "MBFEAT_SKIP_BUILD", "MBFEAT_ONNXRUNTIME",
};

SettingDescriptor makeInteger(std::string name, std::string label, std::int64_t defaultValue,
                              double minimum, double maximum, std::string doc) {
    return {std::move(name), std::move(label), defaultValue, minimum, maximum, {}, std::move(doc)};
}

SettingDescriptor makeReal(std::string name, std::string label, double defaultValue, double minimum,
                           double maximum, std::string doc) {
    return {std::move(name), std::move(label), defaultValue, minimum, maximum, {}, std::move(doc)};
}

SettingDescriptor makeSwitch(std::string name, std::string label, bool defaultValue,
                             std::string doc) {
    return {std::move(name), std::move(label), defaultValue, 0.0, 1.0, {}, std::move(doc)};
}

SettingDescriptor makeText(std::string name, std::string label, std::string defaultValue,
                           std::vector<std::string> allowed, std::string doc) {
    return {std::move(name),    std::move(label), std::move(defaultValue), 0.0, 0.0,
            std::move(allowed), std::move(doc)};
}

std::vector<SettingDescriptor> makeSettingTable() {
    const RenderOptions defaults;
    SettingDescriptor effects = makeText(
        "mbfeat:effects", "Effects", "auto", {},
        "What paths are traced for: `auto` is what the scene calls for, `full` everything, with "
        "the "
        "same image. `+NAME` handles an effect although nothing calls for it, `-NAME` takes one "
        "away from the scene; several are separated by commas. For the names see `mbfeat "
        "effects`.");
    effects.check = [](const std::string& text) -> Status {
        const Result<EffectRequest> request = parseEffects(text);
        return request ? Status() : Status(request.error());
    };
    return {
        makeInteger("mbfeat:samplesPerPixel", "Samples per pixel", defaults.samplesPerPixel, 1,
                    1048576,
                    "Light paths traced through each pixel; with `mbfeat:targetError` or "
                    "`mbfeat:timeLimit` the most that a pixel gets."),
        makeReal("mbfeat:targetError", "Target error", defaults.targetError, 0.0, 1000.0,
                 "Relative error to stop at, 0.02 for 2 %; 0 is none. The error of a pixel is "
                 "sqrt(variance / (mean^2 + 0.01)) of its mean radiance; the root mean square of "
                 "all pixels and the 95th percentile have to be under the target."),
        makeReal("mbfeat:timeLimit", "Time limit", defaults.timeLimit, 0.0, 1e9,
                 "Seconds after which the render stops with what it has, building included, "
                 "writing and pauses not; 0 is none. Every pixel gets at least one sample."),
        makeSwitch("mbfeat:adaptive", "Adaptive sampling", defaults.adaptive,
                   "With `mbfeat:targetError`: blocks of 16 by 16 pixels that are under the target "
                   "get no more samples. Off gives every pixel the same number."),
        makeInteger("mbfeat:maxBounces", "Maximum bounces", defaults.maxBounces, 0, kMostBounces,
                    "Scattering events after the camera ray; 0 shows emission alone."),
        makeInteger("mbfeat:maxDiffuseBounces", "Maximum diffuse bounces", defaults.maxDiffuse, 0,
                    kMostBounces,
                    "Of these, at most so many diffuse ones, direct light included: 1 leaves out "
                    "light between diffuse surfaces, 0 makes them black. Loses energy where it "
                    "is below maxBounces."),
        makeInteger("mbfeat:maxReflectionBounces", "Maximum reflections", defaults.maxReflection, 0,
                    kMostBounces,
                    "Of these, at most so many glossy and specular reflections. Loses energy where "
                    "it is below maxBounces."),
        makeInteger("mbfeat:maxTransmissionBounces", "Maximum transmissions",
                    defaults.maxTransmission, 0, kMostBounces,
                    "Of these, at most so many transmissions: a pane of glass takes two. Loses "
                    "energy where it is below maxBounces."),
        makeSwitch("mbfeat:caustics", "Caustics", defaults.caustics,
                   "Whether mirrors, glass and glossy surfaces of roughness up to 0.3 throw light "
                   "on what is diffuse or rougher. Off loses that light, and its noise."),
        makeSwitch("mbfeat:blur", "Blur", defaults.blur,
                   "Whether cameras have depth of field; off makes them pinholes."),
        std::move(effects),
        makeInteger("mbfeat:seed", "Seed", static_cast<std::int64_t>(defaults.seed), 0,
                    kLargestInteger,
                    "Key of the random numbers; images of different seeds have independent noise."),
        makeInteger("mbfeat:threads", "Threads", defaults.threads, 0, 1024,
                    "Render threads; 0 is one for each core. The image does not depend on it."),
        makeText("mbfeat:pixelFilter", "Pixel filter", "blackmanHarris",
                 {"box", "triangle", "gaussian", "blackmanHarris", "mitchell"},
                 "Pixel reconstruction filter."),
        makeReal(
            "mbfeat:pixelFilterWidth", "Pixel filter width", 0.0, 0.0, 16.0,
            "Full width of the pixel filter, in pixels; 0 is the filter's own: box 1, triangle "
            "2, gaussian and blackmanHarris 3, mitchell 4."),
        makeInteger(
            "mbfeat:russianRouletteStart", "Russian roulette start", defaults.russianRouletteStart,
            0, 1024,
            "Russian roulette may end a path at the scatterings after this number of diffuse "
            "or rough ones: mirrors and clear or finely ground glass do not count."),
        makeInteger(
            "mbfeat:splitting", "Splitting", defaults.splitting, 0, 16,
            "Paths that a path becomes at the first surface that scatters diffusely or is "
            "rough: less noise from indirect light for one shared way there; 0 is 1, 2 or "
            "4, by the noise and the rays of each in a small trial, and 1 in viewers and where "
            "24,576 samples in all are not sure to be taken: with a target error 16 a pixel are, "
            "with a time limit one. Where the image as a whole is under its target after those "
            "16, paths stay whole. It is 1 where path features or contributions are recorded, or "
            "light is clamped. EXR headers have it as `mbfeat:branches`, the summary where it "
            "is not 1."),
        makeReal("mbfeat:clampDirect", "Clamp direct", defaults.clampDirect, 0.0, 1e30,
                 "Largest value that light seen directly or at the first hit adds to a sample, in "
                 "radiance; 0 is no clamp. A clamp loses energy."),
        makeReal("mbfeat:clampIndirect", "Clamp indirect", defaults.clampIndirect, 0.0, 1e30,
                 "Largest value that light after more bounces adds to a sample, in radiance; 0 is "
                 "no clamp. A clamp loses energy."),
        makeSwitch("mbfeat:robust", "Robust traversal", defaults.robust,
                   "Watertight ray traversal at the edges of triangles; off is faster."),
        makeText("mbfeat:kernel", "Kernel", "auto", {"auto", "scalar", "avx2", "avx512"},
                 "Implementation of the integrator: `auto` is the widest vectors that the "
                 "processor has, `scalar` the reference. The image does not depend on it."),
        makeInteger("mbfeat:tileSize", "Tile size", defaults.tileSize, 0, 1024,
                    "Side of the tiles that threads render, in pixels; 0 fits it to the image and "
                    "the samples. The image does not depend on it."),
        makeText("mbfeat:viewAov", "Show AOV", defaults.viewAov, {},
                 "Name of the AOV that viewers get as `color`; empty is the image itself."),
        makeText("mbfeat:onError", "On error", "warn", {"warn", "abort"},
                 "What bad scene data does: `warn` leaves out the datum or prim and goes on, "
                 "`abort` ends the render with an error."),
        makeReal("mbfeat:pathSampleMemory", "Path sample memory", defaults.pathSampleMemory, 0.0,
                 65536.0, "Memory that per-path samples may take, in GiB."),
    };
}

std::vector<SettingDescriptor> makeDenoiseSettingTable() {
    const DenoiseSettings defaults;
    SettingDescriptor model =
        makeText("mbfeat:denoise:model", "Model", defaults.model, {},
                 "ONNX file with the trained network, or the name of one that MBFeat comes with; "
                 "empty is its default one.");
    model.isAsset = true;
    return {
        makeSwitch("mbfeat:denoise:enabled", "Denoise", defaults.enabled,
                   "Whether the image is reconstructed by the network. A RenderPass of passType "
                   "denoise switches it on, unless its own mbfeat:denoise:enabled is false."),
        std::move(model),
        makeText("mbfeat:denoise:features", "Features", "auto",
                 {"auto", "none", "firstHit", "multiBounce"},
                 "Path features given to the network: `auto` is what it was trained with, `none` "
                 "the radiance alone, `firstHit` those of vertex 0, `multiBounce` those of all "
                 "six vertices."),
        makeInteger("mbfeat:denoise:tile", "Tile", defaults.tile, 0, 16384,
                    "Side of the tiles that are reconstructed at a time, in pixels; 0 fits them to "
                    "mbfeat:denoise:memory. The image does not depend on it."),
        makeReal("mbfeat:denoise:memory", "Denoise memory", defaults.memory, 0.015625, 65536.0,
                 "Memory that the network may take at a time, in GiB."),
        makeSwitch("mbfeat:denoise:combine", "Combine", defaults.combine,
                   "From 16 samples a pixel on, take over as much from the rendered image as it "
                   "differs from the reconstruction by more than noise explains."),
    };
}

const SettingDescriptor* findSetting(std::string_view name) {
    for (const std::vector<SettingDescriptor>* table : {&settingTable(), &denoiseSettingTable()}) {
        const auto found = std::find_if(table->begin(), table->end(),
                                        [&](const SettingDescriptor& d) { return d.name == name; });
        if (found != table->end()) {
            return &*found;
        }
    }
    return nullptr;
}

std::vector<std::string> settingNames() {
    std::vector<std::string> names;
    for (const std::vector<SettingDescriptor>* table : {&settingTable(), &denoiseSettingTable()}) {
        for (const SettingDescriptor& descriptor : *table) {
            names.push_back(descriptor.name);
        }
    }
    return names;
}

/// The table's name that is nearest to a wrong one, which may lack the prefix.
std::string nearestSetting(const std::string& name) {
    if (name.compare(0, kPrefix.size(), kPrefix) == 0) {
        return nearestName(name, settingNames());
    }
    return nearestName(std::string(kPrefix) + name, settingNames());
}

template <class T>
std::optional<T> parseNumber(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') {
        text.remove_prefix(1);
    }
    T number{};
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, number);
    if (error != std::errc() || rest != end) {
        return std::nullopt;
    }
    return number;
}

std::optional<bool> asBool(const SettingValue& value) {
    if (const bool* const flag = std::get_if<bool>(&value)) {
        return *flag;
    }
    std::string text = toString(value);
    text = trimmed(text);
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    for (const char* const name : {"true", "1", "on", "yes"}) {
        if (text == name) {
            return true;
        }
    }
    for (const char* const name : {"false", "0", "off", "no"}) {
        if (text == name) {
            return false;
        }
    }
    return std::nullopt;
}

std::optional<double> asReal(const SettingValue& value) {
    if (const double* const real = std::get_if<double>(&value)) {
        return *real;
    }
    if (const std::int64_t* const integer = std::get_if<std::int64_t>(&value)) {
        return static_cast<double>(*integer);
    }
    if (const std::string* const text = std::get_if<std::string>(&value)) {
        return parseNumber<double>(trimmed(*text));
    }
    return std::nullopt;
}

std::optional<std::int64_t> asInteger(const SettingValue& value) {
    if (const std::int64_t* const integer = std::get_if<std::int64_t>(&value)) {
        return *integer;
    }
    if (const std::string* const text = std::get_if<std::string>(&value)) {
        if (const std::optional<std::int64_t> integer = parseNumber<std::int64_t>(trimmed(*text))) {
            return integer;
        }
    }
    const std::optional<double> real = asReal(value);
    if (!real || !(std::abs(*real) <= kLargestInteger) || std::floor(*real) != *real) {
        return std::nullopt;
    }
    return static_cast<std::int64_t>(*real);
}

std::string quoted(const std::string& text) {
    return "\"" + text + "\"";
}

std::string listed(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) {
        text += (text.empty() ? "" : ", ") + word;
    }
    return text;
}

std::string rangeText(const SettingDescriptor& descriptor, const char* kind) {
    return std::string(kind) + " from " + toString(SettingValue(descriptor.minimum)) + " to " +
           toString(SettingValue(descriptor.maximum));
}

bool inRange(const SettingDescriptor& descriptor, double number) {
    return number >= descriptor.minimum && number <= descriptor.maximum;
}

/// The value in the setting's own type, or an error text that says what would be right.
Result<SettingValue> converted(const SettingDescriptor& descriptor, const SettingValue& value) {
    const auto wrong = [&](const std::string& expected) {
        return Error{descriptor.name, quoted(toString(value)) + " is not " + expected};
    };
    if (std::holds_alternative<bool>(descriptor.defaultValue)) {
        const std::optional<bool> flag = asBool(value);
        return flag ? Result<SettingValue>(SettingValue(*flag)) : wrong("true or false");
    }
    if (std::holds_alternative<std::int64_t>(descriptor.defaultValue)) {
        const std::optional<std::int64_t> integer = asInteger(value);
        if (!integer || !inRange(descriptor, static_cast<double>(*integer))) {
            return wrong(rangeText(descriptor, "an integer"));
        }
        return SettingValue(*integer);
    }
    if (std::holds_alternative<double>(descriptor.defaultValue)) {
        const std::optional<double> real = asReal(value);
        if (!real || !inRange(descriptor, *real)) { // inRange is false for a NaN
            return wrong(rangeText(descriptor, "a number"));
        }
        return SettingValue(*real);
    }
    const std::string* const text = std::get_if<std::string>(&value);
    if (text == nullptr) {
        return wrong("a text");
    }
    const std::string word(trimmed(*text));
    const std::vector<std::string>& allowed = descriptor.allowed;
    if (!allowed.empty() && std::find(allowed.begin(), allowed.end(), word) == allowed.end()) {
        return wrong("one of " + listed(allowed) + "; the nearest is " +
                     quoted(nearestName(word, allowed)));
    }
    if (descriptor.check != nullptr) {
        if (Status problem = descriptor.check(word)) {
            return *std::move(problem);
        }
    }
    return SettingValue(word);
}

template <class T>
T get(const Settings& settings, const char* name) {
    return std::get<T>(settings.value(name));
}

int getInt(const Settings& settings, const char* name) {
    return static_cast<int>(get<std::int64_t>(settings, name));
}

float getFloat(const Settings& settings, const char* name) {
    return static_cast<float>(get<double>(settings, name));
}

/// Index of a token among the allowed ones, which are in the order of their enumeration.
template <class Enum>
Enum getEnum(const Settings& settings, const char* name) {
    const std::vector<std::string>& allowed = findSetting(name)->allowed;
    const auto found = std::find(allowed.begin(), allowed.end(), get<std::string>(settings, name));
    return static_cast<Enum>(found - allowed.begin());
}

} // namespace

const char* settingSourceName(SettingSource source) {
    constexpr std::array<const char*, 5> kNames = {"default", "host", "prim", "environment",
                                                   "command line"};
    return kNames[static_cast<std::size_t>(source)];
}

const std::vector<SettingDescriptor>& settingTable() {
    static const std::vector<SettingDescriptor> table = makeSettingTable();
    return table;
}

const std::vector<SettingDescriptor>& denoiseSettingTable() {
    static const std::vector<SettingDescriptor> table = makeDenoiseSettingTable();
    return table;
}

std::string settingEnvironmentName(const std::string& name) {
    const std::string_view own = name.compare(0, kPrefix.size(), kPrefix) == 0
                                     ? std::string_view(name).substr(kPrefix.size())
                                     : std::string_view(name);
    std::string result(kEnvironmentPrefix);
    for (const char c : own) {
        const auto byte = static_cast<unsigned char>(c);
        if (std::isupper(byte) != 0) {
            result += '_';
        }
        result += c == ':' ? '_' : static_cast<char>(std::toupper(byte));
    }
    return result;
}

Status Settings::set(SettingSource source, const std::string& name, const SettingValue& value) {
    const SettingDescriptor* const descriptor = findSetting(name);
    const std::string origin = std::string(" (") + settingSourceName(source) + ")";
    if (descriptor == nullptr) {
        return Error{name, "there is no setting of that name" + origin +
                               "; it is ignored. The nearest is " + quoted(nearestSetting(name)) +
                               "."};
    }
    Result<SettingValue> result = converted(*descriptor, value);
    if (!result) {
        return Error{name, result.error().text + origin + "; it is ignored and " +
                               quoted(toString(this->value(name))) + " (" +
                               settingSourceName(this->source(name)) + ") stays."};
    }
    layers_[name][source] = std::move(result.value());
    return std::nullopt;
}

void Settings::clear(SettingSource source) {
    for (auto& [name, layers] : layers_) {
        layers.erase(source);
    }
}

std::vector<Error> Settings::readEnvironment() {
    clear(SettingSource::kEnvironment);
    std::map<std::string, std::string> names; // of settings, by variable
    std::vector<std::string> variables;
    for (const std::string& name : settingNames()) {
        variables.push_back(settingEnvironmentName(name));
        names[variables.back()] = name;
    }
    std::vector<Error> errors;
    for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
        const std::string_view text(*entry);
        const std::size_t equals = text.find('=');
        const std::string variable(text.substr(0, equals));
        const bool ours = variable.compare(0, kEnvironmentPrefix.size(), kEnvironmentPrefix) == 0;
        const bool other = std::find(kOtherVariables.begin(), kOtherVariables.end(), variable) !=
                           kOtherVariables.end();
        if (!ours || other || equals == std::string_view::npos) {
            continue;
        }
        const auto found = names.find(variable);
        if (found == names.end()) {
            errors.push_back({variable, "no setting has this environment variable; it is ignored. "
                                        "The nearest is " +
                                            quoted(nearestName(variable, variables)) + "."});
            continue;
        }
        const std::string value(text.substr(equals + 1));
        if (const Status status = set(SettingSource::kEnvironment, found->second, value)) {
            errors.push_back({variable, status->text});
        }
    }
    std::sort(errors.begin(), errors.end(),
              [](const Error& a, const Error& b) { return a.subject < b.subject; });
    return errors;
}

const SettingValue& Settings::value(const std::string& name) const {
    static const SettingValue nothing;
    const auto found = layers_.find(name);
    if (found != layers_.end() && !found->second.empty()) {
        return found->second.rbegin()->second;
    }
    const SettingDescriptor* const descriptor = findSetting(name);
    return descriptor != nullptr ? descriptor->defaultValue : nothing;
}

SettingSource Settings::source(const std::string& name) const {
    const auto found = layers_.find(name);
    const bool isSet = found != layers_.end() && !found->second.empty();
    return isSet ? found->second.rbegin()->first : SettingSource::kDefault;
}

std::vector<Settings::Resolved> Settings::resolved() const {
    std::vector<Resolved> result;
    const auto add = [&](const std::vector<SettingDescriptor>& table) {
        for (const SettingDescriptor& descriptor : table) {
            result.push_back({descriptor.name, value(descriptor.name), source(descriptor.name)});
        }
    };
    add(settingTable());
    if (get<bool>(*this, "mbfeat:denoise:enabled")) {
        add(denoiseSettingTable());
    }
    return result;
}

std::string toString(const SettingValue& value) {
    if (const std::string* const text = std::get_if<std::string>(&value)) {
        return *text;
    }
    if (const bool* const flag = std::get_if<bool>(&value)) {
        return *flag ? "true" : "false";
    }
    std::array<char, 32> digits{};
    char* const begin = digits.data();
    char* const end = begin + digits.size();
    const std::int64_t* const integer = std::get_if<std::int64_t>(&value);
    const std::to_chars_result written = integer != nullptr
                                             ? std::to_chars(begin, end, *integer)
                                             : std::to_chars(begin, end, std::get<double>(value));
    return {begin, written.ptr};
}

namespace {

/// The width that a filter is meant to have, for a setting of 0.
float filterWidth(PixelFilter filter, float width) {
    if (width > 0.0F) {
        return width;
    }
    switch (filter) {
    case PixelFilter::kBox:
        return 1.0F;
    case PixelFilter::kTriangle:
        return 2.0F;
    case PixelFilter::kMitchell:
        return 4.0F;
    case PixelFilter::kGaussian:
    case PixelFilter::kBlackmanHarris:
        break;
    }
    return 3.0F;
}

} // namespace

RenderOptions resolveOptions(const Settings& settings) {
    RenderOptions options;
    options.samplesPerPixel = getInt(settings, "mbfeat:samplesPerPixel");
    options.targetError = get<double>(settings, "mbfeat:targetError");
    options.timeLimit = get<double>(settings, "mbfeat:timeLimit");
    options.adaptive = get<bool>(settings, "mbfeat:adaptive");
    options.maxBounces = getInt(settings, "mbfeat:maxBounces");
    options.maxDiffuse = getInt(settings, "mbfeat:maxDiffuseBounces");
    options.maxReflection = getInt(settings, "mbfeat:maxReflectionBounces");
    options.maxTransmission = getInt(settings, "mbfeat:maxTransmissionBounces");
    options.caustics = get<bool>(settings, "mbfeat:caustics");
    options.blur = get<bool>(settings, "mbfeat:blur");
    options.effects = parseEffects(get<std::string>(settings, "mbfeat:effects")).value();
    options.seed = static_cast<std::uint64_t>(get<std::int64_t>(settings, "mbfeat:seed"));
    options.threads = getInt(settings, "mbfeat:threads");
    options.pixelFilter = getEnum<PixelFilter>(settings, "mbfeat:pixelFilter");
    options.pixelFilterWidth =
        filterWidth(options.pixelFilter, getFloat(settings, "mbfeat:pixelFilterWidth"));
    options.russianRouletteStart = getInt(settings, "mbfeat:russianRouletteStart");
    options.splitting = getInt(settings, "mbfeat:splitting");
    options.clampDirect = getFloat(settings, "mbfeat:clampDirect");
    options.clampIndirect = getFloat(settings, "mbfeat:clampIndirect");
    options.robust = get<bool>(settings, "mbfeat:robust");
    options.kernel = getEnum<Kernel>(settings, "mbfeat:kernel");
    options.tileSize = getInt(settings, "mbfeat:tileSize");
    options.denoise.enabled = get<bool>(settings, "mbfeat:denoise:enabled");
    options.denoise.model = get<std::string>(settings, "mbfeat:denoise:model");
    options.denoise.features = getEnum<DenoiseFeatures>(settings, "mbfeat:denoise:features");
    options.denoise.tile = getInt(settings, "mbfeat:denoise:tile");
    options.denoise.memory = get<double>(settings, "mbfeat:denoise:memory");
    options.denoise.combine = get<bool>(settings, "mbfeat:denoise:combine");
    options.viewAov = get<std::string>(settings, "mbfeat:viewAov");
    options.onError = getEnum<OnError>(settings, "mbfeat:onError");
    options.pathSampleMemory = get<double>(settings, "mbfeat:pathSampleMemory");
    return options;
}

} // namespace mbfeat
