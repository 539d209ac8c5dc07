#include "delegate/settingsStack.h"

#include <iterator>
#include <map>

#include "delegate/tokens.h"
#include "delegate/values.h"
#include "film/host.h"

namespace mbfeat {

namespace {

constexpr const char* kPrefix = "mbfeat:";

bool startsWith(const std::string& text, const char* prefix) {
    return text.rfind(prefix, 0) == 0;
}

} // namespace

SettingsStack::SettingsStack(Diagnostics& diagnostics)
    : diagnostics_(diagnostics),
      primMessages_(diagnostics),
      overrideMessages_(diagnostics) {
    for (const Error& error : settings_.readEnvironment()) {
        diagnostics_.warn(error.subject, error.text);
    }
    refreshOverrides();
}

void SettingsStack::set(SettingSource source, const std::string& subject, const std::string& name,
                        const SettingValue& value, Diagnostics& messages) {
    if (const Status status = settings_.set(source, name, value)) {
        messages.warn(subject.empty() ? status->subject : subject,
                      subject.empty() ? status->text : status->subject + ": " + status->text);
    }
}

void SettingsStack::setFromHost(const TfToken& key, const VtValue& value) {
    if (key == tokens().enableInteractive) {
        const bool on = asBool(value, true);
        version_ += on != interactive_ ? 1 : 0;
        interactive_ = on;
        return;
    }
    if (key == tokens().domeLightCameraVisibility) {
        const bool on = asBool(value, true);
        version_ += on != domeVisible_ ? 1 : 0;
        domeVisible_ = on;
        return;
    }
    if (!startsWith(key.GetString(), kPrefix)) {
        return;
    }
    Diagnostics& messages = hostMessages_.try_emplace(key.GetString(), diagnostics_).first->second;
    messages.withdraw();
    if (const std::optional<SettingValue> setting = asSetting(value)) {
        set(SettingSource::kHost, "", key.GetString(), *setting, messages);
        ++version_;
    } else {
        messages.warn(key.GetString(), "a value of type " + value.GetTypeName() +
                                           " fits no setting (host); it is ignored. Give a "
                                           "number, a bool or a text.");
    }
}

void SettingsStack::setFromPrim(const std::string& primPath, const VtDictionary& settings) {
    std::map<std::string, VtValue> found = flattened(settings);
    for (auto it = found.begin(); it != found.end();) {
        it = startsWith(it->first, kPrefix) ? std::next(it) : found.erase(it);
    }
    std::vector<std::pair<std::string, std::string>> texts{{"prim", primPath}};
    for (const auto& [name, value] : found) {
        texts.emplace_back(name, describe(value));
    }
    if (texts == primSettings_) {
        return;
    }
    primSettings_ = std::move(texts);
    primMessages_.withdraw();
    settings_.clear(SettingSource::kPrim);
    for (const auto& [name, value] : found) {
        const std::optional<SettingValue> setting = asSetting(value);
        if (setting) {
            set(SettingSource::kPrim, primPath, name, *setting, primMessages_);
        } else {
            primMessages_.warn(primPath, name + " has type " + value.GetTypeName() +
                                             ", which fits no setting; it is ignored. Author a "
                                             "number, a bool or a token.");
        }
    }
    ++version_;
}

void SettingsStack::clearPrim() {
    if (primSettings_.empty()) {
        return;
    }
    primSettings_.clear();
    primMessages_.withdraw();
    settings_.clear(SettingSource::kPrim);
    ++version_;
}

void SettingsStack::refreshOverrides() {
    std::vector<std::pair<std::string, std::string>> overrides = Host::instance().overrides();
    if (overrides == overrides_) {
        return;
    }
    overrides_ = std::move(overrides);
    overrideMessages_.withdraw();
    settings_.clear(SettingSource::kCommandLine);
    for (const auto& [name, value] : overrides_) {
        set(SettingSource::kCommandLine, "", name, value, overrideMessages_);
    }
    ++version_;
}

} // namespace mbfeat
