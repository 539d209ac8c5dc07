#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/interface.h"

HYDRA_INTERFACE_OPEN_SCOPE

/// The delegate's own state, handed to every Sync. The four queries belong to applications; a
/// subclass's own virtual functions come after them.
class HdRenderParam {
public:
    HdRenderParam() = default;
    virtual ~HdRenderParam();

    /// The library's answers: false, an empty value, false.
    virtual bool SetArbitraryValue(const TfToken& key, const VtValue& value);
    virtual VtValue GetArbitraryValue(const TfToken& key) const;
    virtual bool HasArbitraryValue(const TfToken& key) const;
    /// The library's answer is false: a subclass says when it is usable.
    virtual bool IsValid() const;

private:
    HdRenderParam(const HdRenderParam&) = delete;
    HdRenderParam& operator=(const HdRenderParam&) = delete;
};
HYDRA_INTERFACE_SIZE(HdRenderParam, 8, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
