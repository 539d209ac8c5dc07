#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/sceneDelegate.h"
#include "pxr/imaging/hd/sprim.h"
#include "pxr/imaging/interface.h"

#include <cstddef>
#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

/// A computation that makes primvars, such as skinning. Used as it is; Sync fills it.
class HdExtComputation : public HdSprim {
public:
    enum DirtyBits : HdDirtyBits {
        Clean = 0,
        DirtyInputDesc = 1 << 0,
        DirtyOutputDesc = 1 << 1,
        DirtyElementCount = 1 << 2,
        DirtySceneInput = 1 << 3,
        DirtyCompInput = 1 << 4,
        DirtyKernel = 1 << 5,
        DirtyDispatchCount = 1 << 6,
        AllDirty = DirtyInputDesc | DirtyOutputDesc | DirtyElementCount | DirtySceneInput |
                   DirtyCompInput | DirtyKernel | DirtyDispatchCount
    };

    explicit HdExtComputation(const SdfPath& id);
    ~HdExtComputation() override;

    void Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam,
              HdDirtyBits* dirtyBits) override;
    HdDirtyBits GetInitialDirtyBitsMask() const override;

    size_t GetDispatchCount() const;
    size_t GetElementCount() const { return _elementCount; }
    const TfTokenVector& GetSceneInputNames() const { return _sceneInputNames; }
    TfTokenVector GetOutputNames() const;
    const HdExtComputationInputDescriptorVector& GetComputationInputs() const {
        return _computationInputs;
    }
    const HdExtComputationOutputDescriptorVector& GetComputationOutputs() const {
        return _computationOutputs;
    }
    const std::string& GetGpuKernelSource() const { return _gpuKernelSource; }
    bool IsInputAggregation() const;

protected:
    void _Sync(HdSceneDelegate* sceneDelegate, HdRenderParam* renderParam, HdDirtyBits* dirtyBits);
    static bool _IsEnabledSharedExtComputationData();

private:
    HdExtComputation() = delete;
    HdExtComputation(const HdExtComputation&) = delete;
    HdExtComputation& operator=(const HdExtComputation&) = delete;

    size_t _dispatchCount;
    size_t _elementCount;
    TfTokenVector _sceneInputNames;
    HdExtComputationInputDescriptorVector _computationInputs;
    HdExtComputationOutputDescriptorVector _computationOutputs;
    std::string _gpuKernelSource;
};
HYDRA_INTERFACE_SIZE(HdExtComputation, 136, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
