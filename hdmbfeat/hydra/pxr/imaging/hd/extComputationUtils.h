#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/sceneDelegate.h"
#include "pxr/imaging/interface.h"

#include <unordered_map>

HYDRA_INTERFACE_OPEN_SCOPE

class HdExtComputationUtils {
public:
    using ValueStore = std::unordered_map<TfToken, VtValue, TfToken::HashFunctor>;

    /// Runs the computations behind the primvars, at the current frame; values by primvar name.
    static ValueStore
    GetComputedPrimvarValues(const HdExtComputationPrimvarDescriptorVector& compPrimvars,
                             HdSceneDelegate* sceneDelegate);
};
HYDRA_INTERFACE_SIZE(HdExtComputationUtils, 1, 1);

HYDRA_INTERFACE_CLOSE_SCOPE
