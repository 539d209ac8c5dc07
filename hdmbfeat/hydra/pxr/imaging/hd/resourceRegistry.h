#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/imaging/interface.h"

#include <memory>
#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

class HdResourceRegistry;
using HdResourceRegistrySharedPtr = std::shared_ptr<HdResourceRegistry>;

/// Where a delegate may keep resources that outlive a sync. A CPU delegate returns a plain one.
class HdResourceRegistry {
public:
    HdResourceRegistry();
    virtual ~HdResourceRegistry();

    void Commit();
    void GarbageCollect();
    virtual void InvalidateShaderRegistry();
    virtual void ReloadResource(const TfToken& resourceType, const std::string& path);
    virtual VtDictionary GetResourceAllocation() const;

protected:
    virtual void _Commit();
    virtual void _GarbageCollect();

private:
    HdResourceRegistry(const HdResourceRegistry&) = delete;
    HdResourceRegistry& operator=(const HdResourceRegistry&) = delete;
};
HYDRA_INTERFACE_SIZE(HdResourceRegistry, 8, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
