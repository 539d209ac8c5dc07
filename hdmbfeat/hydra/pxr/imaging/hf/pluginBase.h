#pragma once

#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// Root of every class that a plug-in registry creates by name.
class HfPluginBase {
public:
    virtual ~HfPluginBase();

protected:
    HfPluginBase() = default;

private:
    HfPluginBase(const HfPluginBase&) = delete;
    HfPluginBase& operator=(const HfPluginBase&) = delete;
};
HYDRA_INTERFACE_SIZE(HfPluginBase, 8, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
