#include "scene/colorManagement.h"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <map>
#include <mutex>
#include <utility>

#include "core/library.h"
#include "scene/colorBuiltIn.h"
#include "scene/colorSpaceNames.h"

namespace mbfeat {

namespace {

constexpr const char* kBuiltInSource = "built-in ACES";
constexpr const char* kDefaultConfig = "cg-config-v1.0.0_aces-v1.3_ocio-v2.1";
constexpr const char* kStudioConfig = "studio-config-v1.0.0_aces-v1.3_ocio-v2.1";
constexpr const char* kScheme = "ocio://";

std::string environment(const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
}

bool isReadable(const std::string& path) {
    return std::ifstream(path).good();
}

/// Where the files of OpenColorIO's own ACES configs may be: a folder that is named, or the one
/// that is installed beside the folder of this library.
std::vector<std::string> configFolders() {
    std::vector<std::string> folders;
    if (std::string named = environment("MBFEAT_OCIO_DIR"); !named.empty()) {
        folders.push_back(std::move(named));
    }
    folders.push_back(libraryFolder() + "/../ocio");
    return folders;
}

/// The file of a config of that name (without ".ocio"), or "".
std::string findConfigFile(const std::string& name) {
    for (const std::string& folder : configFolders()) {
        std::string file = folder + "/" + name + ".ocio";
        if (isReadable(file)) {
            return file;
        }
    }
    return {};
}

std::string joined(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) {
        text += (text.empty() ? "'" : ", '") + name + "'";
    }
    return text.empty() ? "none" : text;
}

class OcioTransform final : public ColorTransform {
public:
    OcioTransform(const OCIO::ConstProcessorRcPtr& processor, OCIO::OptimizationFlags flags)
        : identity_(processor->isNoOp()),
          cpu_(processor->getOptimizedCPUProcessor(flags)) {}

    bool isIdentity() const override { return identity_; }

    void apply(float* values, std::size_t texels, int channels) const override {
        // Chunks keep the size within what OpenColorIO counts with.
        constexpr std::size_t kChunk = std::size_t(1) << 24;
        for (std::size_t first = 0; first < texels && !identity_; first += kChunk) {
            const std::size_t count = std::min(kChunk, texels - first);
            OCIO::PackedImageDesc image(values + first * static_cast<std::size_t>(channels),
                                        static_cast<long>(count), 1, channels);
            cpu_->apply(image);
        }
    }

private:
    bool identity_;
    OCIO::ConstCPUProcessorRcPtr cpu_;
};

/// One transform after another.
class ChainedTransform final : public ColorTransform {
public:
    ChainedTransform(std::shared_ptr<const ColorTransform> first,
                     std::shared_ptr<const ColorTransform> second)
        : first_(std::move(first)),
          second_(std::move(second)) {}
    bool isIdentity() const override { return first_->isIdentity() && second_->isIdentity(); }
    void apply(float* values, std::size_t texels, int channels) const override {
        first_->apply(values, texels, channels);
        second_->apply(values, texels, channels);
    }

private:
    std::shared_ptr<const ColorTransform> first_, second_;
};

std::shared_ptr<const ColorTransform> makeTransform(const OCIO::ConstProcessorRcPtr& processor,
                                                    OCIO::OptimizationFlags flags) {
    return std::make_shared<OcioTransform>(processor, flags);
}

/// The config's name for the space, by its own names, aliases and roles, then by the other names
/// of the same space.
std::string resolveIn(const OCIO::ConstConfigRcPtr& config, const std::string& name) {
    const std::string wanted = name.empty() ? "lin_rec709" : name;
    const auto canonical = [&config](const std::string& candidate) {
        const OCIO::ConstColorSpaceRcPtr space = config->getColorSpace(candidate.c_str());
        return std::string(space ? space->getName() : "");
    };
    std::string found = canonical(wanted);
    const KnownSpace* known = found.empty() ? findKnownSpace(wanted) : nullptr;
    if (known != nullptr) {
        for (const std::string& alias : known->names) {
            found = canonical(alias);
            if (!found.empty()) {
                break;
            }
        }
    }
    return found;
}

} // namespace

struct ColorConfig::Impl {
    OCIO::ConstConfigRcPtr config;
    std::string source;
    mutable std::mutex mutex;
    mutable std::map<std::pair<std::string, std::string>, std::shared_ptr<const ColorTransform>>
        transforms;
};

ColorConfig::ColorConfig(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

ColorConfig::~ColorConfig() = default;

std::shared_ptr<const ColorConfig> ColorConfig::builtIn() {
    static const std::shared_ptr<const ColorConfig> config = [] {
        auto impl = std::make_unique<Impl>();
        impl->source = kBuiltInSource;
        try {
            impl->config = makeBuiltInConfig();
        } catch (const std::exception&) {
            impl->config = OCIO::Config::CreateRaw();
        }
        return std::shared_ptr<const ColorConfig>(std::make_shared<ColorConfig>(std::move(impl)));
    }();
    return config;
}

Result<std::shared_ptr<const ColorConfig>> ColorConfig::open(const std::string& file) {
    std::string path = file;
    if (file.rfind(kScheme, 0) == 0) {
        std::string name = file.substr(std::string(kScheme).size());
        if (name == "default" || name == "cg-config-latest") {
            name = kDefaultConfig;
        } else if (name == "studio-config-latest") {
            name = kStudioConfig;
        }
        path = findConfigFile(name);
        if (path.empty()) {
            return Error{file, "is not among the built-in configs that are installed; use '" +
                                   std::string(kScheme) + kDefaultConfig + "', '" + kScheme +
                                   kStudioConfig + "' or the path of a config file"};
        }
    }
    try {
        auto impl = std::make_unique<Impl>();
        impl->config = OCIO::Config::CreateFromFile(path.c_str());
        impl->config->validate();
        impl->source = path;
        return std::shared_ptr<const ColorConfig>(std::make_shared<ColorConfig>(std::move(impl)));
    } catch (const std::exception& e) {
        return Error{path, std::string("cannot be used as an OpenColorIO config: ") + e.what()};
    }
}

std::shared_ptr<const ColorConfig> ColorConfig::fromEnvironment(Diagnostics& diagnostics) {
    for (const char* variable : {"OCIO", "MBFEAT_OCIO_CONFIG"}) {
        const std::string file = environment(variable);
        if (file.empty()) {
            continue;
        }
        auto config = open(file);
        if (config) {
            return config.value();
        }
        diagnostics.warn(variable, "'" + config.error().subject + "' " + config.error().text +
                                       "; the built-in ACES config is used instead");
    }
    if (const std::string file = findConfigFile(kDefaultConfig); !file.empty()) {
        auto config = open(file);
        if (config) {
            return config.value();
        }
        diagnostics.warn(file, config.error().text + "; the built-in ACES config is used instead");
    }
    return builtIn();
}

const std::string& ColorConfig::source() const {
    return impl_->source;
}

std::vector<std::string> ColorConfig::colorSpaces() const {
    const int count = impl_->config->getNumColorSpaces();
    std::vector<std::string> names;
    names.reserve(static_cast<std::size_t>(std::max(count, 0)));
    for (int i = 0; i < count; ++i) {
        names.emplace_back(impl_->config->getColorSpaceNameByIndex(i));
    }
    return names;
}

std::vector<std::string> ColorConfig::displays() const {
    const int count = impl_->config->getNumDisplays();
    std::vector<std::string> names;
    names.reserve(static_cast<std::size_t>(std::max(count, 0)));
    for (int i = 0; i < count; ++i) {
        names.emplace_back(impl_->config->getDisplay(i));
    }
    return names;
}

std::vector<std::string> ColorConfig::views(const std::string& display) const {
    const int count = impl_->config->getNumViews(display.c_str());
    std::vector<std::string> names;
    names.reserve(static_cast<std::size_t>(std::max(count, 0)));
    for (int i = 0; i < count; ++i) {
        names.emplace_back(impl_->config->getView(display.c_str(), i));
    }
    return names;
}

std::string ColorConfig::defaultDisplay() const {
    return impl_->config->getDefaultDisplay();
}

std::string ColorConfig::defaultView(const std::string& display) const {
    return impl_->config->getDefaultView(display.c_str());
}

std::string ColorConfig::resolve(const std::string& name) const {
    return resolveIn(impl_->config, name);
}

Result<std::shared_ptr<const ColorTransform>> ColorConfig::transform(const std::string& from,
                                                                     const std::string& to) const {
    const std::lock_guard lock(impl_->mutex);
    std::shared_ptr<const ColorTransform>& cached = impl_->transforms[{from, to}];
    if (cached) {
        return cached;
    }
    const OCIO::ConstConfigRcPtr& own = impl_->config;
    const OCIO::ConstConfigRcPtr& other = builtIn()->impl_->config;
    // Where one of the two names is unknown to this config, that end is looked up in the built-in
    // one, and the two configs are joined at ACES2065-1.
    const auto locate = [&](const std::string& name) {
        std::string found = resolveIn(own, name);
        return found.empty() ? std::make_pair(other, resolveIn(other, name))
                             : std::make_pair(own, std::move(found));
    };
    const auto [sourceConfig, source] = locate(from);
    const auto [targetConfig, target] = locate(to);
    for (const auto* end : {&source, &target}) {
        if (end->empty()) {
            return Error{end == &source ? from : to, "is not a colour space of the config " +
                                                         impl_->source + ", which has " +
                                                         joined(colorSpaces())};
        }
    }
    try {
        const OCIO::ConstProcessorRcPtr processor =
            sourceConfig == targetConfig
                ? sourceConfig->getProcessor(source.c_str(), target.c_str())
                : OCIO::Config::GetProcessorFromConfigs(sourceConfig, source.c_str(), targetConfig,
                                                        target.c_str());
        cached = makeTransform(processor, OCIO::OPTIMIZATION_LOSSLESS);
        return cached;
    } catch (const std::exception& e) {
        return Error{from + " to " + to,
                     "cannot be converted with the config " + impl_->source + ": " + e.what()};
    }
}

Result<std::shared_ptr<const ColorTransform>>
ColorConfig::displayTransform(const std::string& from, const std::string& display,
                              const std::string& view) const {
    const auto contains = [](const std::vector<std::string>& names, const std::string& name) {
        return std::find(names.begin(), names.end(), name) != names.end();
    };
    const std::string device = display.empty() ? defaultDisplay() : display;
    if (!contains(displays(), device)) {
        return Error{device, "is not a display of the config " + impl_->source + ", which has " +
                                 joined(displays())};
    }
    const std::string look = view.empty() ? defaultView(device) : view;
    if (!contains(views(device), look)) {
        return Error{look, "is not a view of the display '" + device + "', which has " +
                               joined(views(device))};
    }
    std::string source = resolve(from);
    std::shared_ptr<const ColorTransform> before;
    if (source.empty()) {
        source = resolve("scene_linear");
        auto bridge = transform(from, source);
        if (!bridge) {
            return bridge.error();
        }
        before = bridge.value();
    }
    try {
        const auto description = OCIO::DisplayViewTransform::Create();
        description->setSrc(source.c_str());
        description->setDisplay(device.c_str());
        description->setView(look.c_str());
        auto shown =
            makeTransform(impl_->config->getProcessor(description), OCIO::OPTIMIZATION_DEFAULT);
        return before ? std::make_shared<const ChainedTransform>(before, shown) : shown;
    } catch (const std::exception& e) {
        return Error{device + ", " + look,
                     "cannot be shown with the config " + impl_->source + ": " + e.what()};
    }
}

} // namespace mbfeat
