// The delegate's render settings: all sources layered, and the hosts' own switches beside them.
#pragma once

#include "pxr/pxr.h"

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/diagnostics.h"
#include "core/settings.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/base/vt/value.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// Precedence, rising: defaults, the host's SetRenderSetting, the active settings prim, the
/// environment, the command line (Host::overrides). One thread.
class SettingsStack {
public:
    explicit SettingsStack(Diagnostics& diagnostics);

    /// A setting of the host. Names of other renderers and hosts are left alone.
    void setFromHost(const TfToken& key, const VtValue& value);
    /// Replaces what the settings prim says by its `mbfeat:*` settings. `primPath` is for messages.
    void setFromPrim(const std::string& primPath, const VtDictionary& settings);
    void clearPrim();
    /// Takes over the command line's settings where they changed.
    void refreshOverrides();

    RenderOptions options() const { return resolveOptions(settings_); }
    std::vector<Settings::Resolved> resolved() const { return settings_.resolved(); }

    /// False when the host wants one finished image instead of progressive refinement.
    bool isInteractive() const { return interactive_; }
    /// Whether dome lights show in the background.
    bool isDomeVisible() const { return domeVisible_; }

    /// Grows with every change.
    std::uint64_t version() const { return version_; }

private:
    void set(SettingSource source, const std::string& subject, const std::string& name,
             const SettingValue& value, Diagnostics& messages);

    Diagnostics& diagnostics_;
    std::map<std::string, Diagnostics> hostMessages_; ///< by setting: of the last value
    Diagnostics primMessages_, overrideMessages_;
    Settings settings_;
    std::vector<std::pair<std::string, std::string>> overrides_;
    std::vector<std::pair<std::string, std::string>> primSettings_;
    bool interactive_ = true;
    bool domeVisible_ = true;
    std::uint64_t version_ = 0;
};

} // namespace mbfeat
