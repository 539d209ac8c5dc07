#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/interface.h"

#include <string>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

using HdCommandArgs = VtDictionary;

/// One named argument of a delegate command and its default.
struct HdCommandArgDescriptor {
    HdCommandArgDescriptor();
    HdCommandArgDescriptor(const TfToken& name, const VtValue& value)
        : argName(name),
          defaultValue(value) {}

    const TfToken argName;
    const VtValue defaultValue;
};
HYDRA_INTERFACE_SIZE(HdCommandArgDescriptor, 24, 8);

using HdCommandArgDescriptors = std::vector<HdCommandArgDescriptor>;

/// A command that an application may invoke on the delegate.
struct HdCommandDescriptor {
    HdCommandDescriptor();
    explicit HdCommandDescriptor(const TfToken& name, const std::string& description = "",
                                 const HdCommandArgDescriptors& args = HdCommandArgDescriptors())
        : commandName(name),
          commandDescription(description),
          commandArgs(args) {}

    const TfToken commandName;
    const std::string commandDescription;
    const HdCommandArgDescriptors commandArgs;
};
HYDRA_INTERFACE_SIZE(HdCommandDescriptor, 64, 8);

using HdCommandDescriptors = std::vector<HdCommandDescriptor>;

HYDRA_INTERFACE_CLOSE_SCOPE
