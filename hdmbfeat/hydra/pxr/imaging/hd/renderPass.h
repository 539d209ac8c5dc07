#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/rprimCollection.h"
#include "pxr/imaging/interface.h"

#include <memory>

HYDRA_INTERFACE_OPEN_SCOPE

class HdRenderDelegate;
class HdRenderIndex;
class HdRenderPassState;

using HdRenderPassStateSharedPtr = std::shared_ptr<HdRenderPassState>;
using HdRenderPassSharedPtr = std::shared_ptr<class HdRenderPass>;

/// Draws one collection. Execute may be called many times for one image, until IsConverged.
class HdRenderPass {
public:
    HdRenderPass(HdRenderIndex* index, const HdRprimCollection& collection);
    virtual ~HdRenderPass();

    const HdRprimCollection& GetRprimCollection() const { return _collection; }
    void SetRprimCollection(const HdRprimCollection& collection);
    HdRenderIndex* GetRenderIndex() const { return _renderIndex; }

    void Sync();
    void Execute(const HdRenderPassStateSharedPtr& renderPassState,
                 const TfTokenVector& renderTags);

    /// The library's answer is true.
    virtual bool IsConverged() const;

protected:
    virtual void _Execute(const HdRenderPassStateSharedPtr& renderPassState,
                          const TfTokenVector& renderTags) = 0;
    virtual void _MarkCollectionDirty();
    virtual void _Sync();

private:
    HdRenderPass(const HdRenderPass&) = delete;
    HdRenderPass& operator=(const HdRenderPass&) = delete;

    HdRenderIndex* const _renderIndex;
    HdRprimCollection _collection;
};
HYDRA_INTERFACE_SIZE(HdRenderPass, 120, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
