// The table of settings, and their layers.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"
#include "core/effects.h"
#include "core/settings.h"

namespace mbfeat {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

std::vector<std::string> readEnvironment(Settings& settings) {
    std::vector<std::string> messages;
    for (const Error& error : settings.readEnvironment()) {
        messages.push_back(error.subject + ": " + error.text);
    }
    return messages;
}

} // namespace

void bindSettings(nb::module_& module) {
    nb::enum_<SettingSource>(module, "SettingSource", "Who set a value, in rising precedence.")
        .value("DEFAULT", SettingSource::kDefault)
        .value("HOST", SettingSource::kHost)
        .value("PRIM", SettingSource::kPrim)
        .value("ENVIRONMENT", SettingSource::kEnvironment)
        .value("COMMAND_LINE", SettingSource::kCommandLine);

    nb::class_<SettingDescriptor>(module, "SettingDescriptor", "One row of a table of settings.")
        .def_ro("name", &SettingDescriptor::name)
        .def_ro("label", &SettingDescriptor::label)
        .def_ro("default", &SettingDescriptor::defaultValue)
        .def_ro("minimum", &SettingDescriptor::minimum)
        .def_ro("maximum", &SettingDescriptor::maximum)
        .def_ro("allowed", &SettingDescriptor::allowed)
        .def_ro("doc", &SettingDescriptor::doc)
        .def_ro("is_asset", &SettingDescriptor::isAsset)
        .def_prop_ro("environment",
                     [](const SettingDescriptor& d) { return settingEnvironmentName(d.name); });

    module.def("setting_table", &settingTable, nb::rv_policy::copy, "Settings of a render.");
    module.def("denoise_setting_table", &denoiseSettingTable, nb::rv_policy::copy,
               "Settings of a denoise pass.");

    nb::class_<EffectDescriptor>(module, "EffectDescriptor", "One row of the table of effects.")
        .def_prop_ro("name", [](const EffectDescriptor& e) { return std::string(e.name); })
        .def_prop_ro(
            "doc", [](const EffectDescriptor& e) { return std::string(e.doc); },
            "When a scene calls for it.")
        .def_prop_ro(
            "without",
            [](const EffectDescriptor& e) {
                return std::string(e.without != nullptr ? e.without : "");
            },
            "What stands in its place where mbfeat:effects takes it away; empty: it cannot be.");
    module.def(
        "effect_table",
        [] { return std::vector<EffectDescriptor>(effectTable().begin(), effectTable().end()); },
        "Effects that scenes may call for.");

    nb::class_<Settings>(module, "Settings", "Values of the settings, layered by who set them.")
        .def(nb::init<>())
        .def(
            "set",
            [](Settings& settings, SettingSource source, const std::string& name,
               const SettingValue& value) { check(settings.set(source, name, value)); },
            "source"_a, "name"_a, "value"_a,
            "Sets a value; Error for an unknown name or a bad value, which changes nothing.")
        .def("clear", &Settings::clear, "source"_a)
        .def("read_environment", &readEnvironment,
             "Reads the MBFEAT_* variables of this process; returns what is wrong with them.")
        .def("value", &Settings::value, "name"_a, nb::rv_policy::copy)
        .def("source", &Settings::source, "name"_a)
        .def(
            "resolved",
            [](const Settings& settings) {
                nb::list rows;
                for (const Settings::Resolved& row : settings.resolved()) {
                    rows.append(nb::make_tuple(row.name, row.value, row.source));
                }
                return rows;
            },
            nb::sig("def resolved(self) -> list[tuple[str, bool | int | float | str, "
                    "SettingSource]]"));
}

} // namespace mbfeat
