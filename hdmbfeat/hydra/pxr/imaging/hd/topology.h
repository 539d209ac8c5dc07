#pragma once

#include "pxr/imaging/interface.h"

#include <cstdint>

HYDRA_INTERFACE_OPEN_SCOPE

/// Root of the topologies. Inline in the library too, which has no vtable of it.
class HdTopology {
public:
    using ID = uint64_t;

    HdTopology() = default;
    HdTopology(const HdTopology&) = default;
    HdTopology& operator=(const HdTopology&) = default;
    virtual ~HdTopology() = default;
    virtual ID ComputeHash() const = 0;
};
HYDRA_INTERFACE_SIZE(HdTopology, 8, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
