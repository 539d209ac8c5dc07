#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/interface.h"

#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

/// A device that the application owns (a GPU interface); a CPU delegate ignores it.
class HdDriver {
public:
    TfToken name;
    VtValue driver;
};
HYDRA_INTERFACE_SIZE(HdDriver, 24, 8);

using HdDriverVector = std::vector<HdDriver*>;

HYDRA_INTERFACE_CLOSE_SCOPE
