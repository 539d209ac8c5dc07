#pragma once

#include "pxr/base/gf/matrix4d.h"
#include "pxr/base/gf/range3d.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/base/vt/types.h"
#include "pxr/base/vt/value.h"
#include "pxr/imaging/hd/aov.h"
#include "pxr/imaging/hd/basisCurvesTopology.h"
#include "pxr/imaging/hd/enums.h"
#include "pxr/imaging/hd/meshTopology.h"
#include "pxr/imaging/hd/repr.h"
#include "pxr/imaging/hd/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/imaging/pxOsd/subdivTags.h"
#include "pxr/usd/sdf/path.h"

#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

HYDRA_INTERFACE_OPEN_SCOPE

class HdExtComputationContext;
class HdRenderIndex;
struct HdModelDrawMode;
struct HdSyncRequestVector;
struct HdVolumeFieldDescriptor;

using HdIdVectorSharedPtr = std::shared_ptr<SdfPathVector>;
using HdInstancerContext = std::vector<std::pair<SdfPath, int>>;
using HdVolumeFieldDescriptorVector = std::vector<HdVolumeFieldDescriptor>;

/// How a prim is to be displayed. Trivially copyable: the library returns it in registers.
struct HdDisplayStyle {
    HdDisplayStyle() : HdDisplayStyle(0) {}
    explicit HdDisplayStyle(int refineLevel_, bool flatShading = false, bool displacement = true,
                            bool inOverlay = false, bool occludedSelection = false,
                            bool pointsShading = false, bool materialIsFinal_ = false)
        : refineLevel(refineLevel_),
          flatShadingEnabled(flatShading),
          displacementEnabled(displacement),
          displayInOverlay(inOverlay),
          occludedSelectionShowsThrough(occludedSelection),
          pointsShadingEnabled(pointsShading),
          materialIsFinal(materialIsFinal_) {}
    HdDisplayStyle(const HdDisplayStyle&) = default;
    ~HdDisplayStyle() = default;

    bool operator==(const HdDisplayStyle& other) const {
        return refineLevel == other.refineLevel && flatShadingEnabled == other.flatShadingEnabled &&
               displacementEnabled == other.displacementEnabled &&
               displayInOverlay == other.displayInOverlay &&
               occludedSelectionShowsThrough == other.occludedSelectionShowsThrough &&
               pointsShadingEnabled == other.pointsShadingEnabled &&
               materialIsFinal == other.materialIsFinal;
    }
    bool operator!=(const HdDisplayStyle& other) const { return !(*this == other); }

    int refineLevel;
    bool flatShadingEnabled;
    bool displacementEnabled;
    bool displayInOverlay;
    bool occludedSelectionShowsThrough;
    bool pointsShadingEnabled;
    bool materialIsFinal;
};
HYDRA_INTERFACE_SIZE(HdDisplayStyle, 12, 4);
static_assert(std::is_trivially_copyable_v<HdDisplayStyle>);

/// Name, interpolation and role of one primvar. The constructors are user-provided on purpose:
/// HdExtComputationPrimvarDescriptor lies partly in this class's tail padding.
struct HdPrimvarDescriptor {
    HdPrimvarDescriptor() : interpolation(HdInterpolationConstant), indexed(false) {}
    HdPrimvarDescriptor(const TfToken& name_, HdInterpolation interpolation_,
                        const TfToken& role_ = TfToken(), bool indexed_ = false)
        : name(name_),
          interpolation(interpolation_),
          role(role_),
          indexed(indexed_) {}

    bool operator==(const HdPrimvarDescriptor& other) const {
        return name == other.name && interpolation == other.interpolation && role == other.role &&
               indexed == other.indexed;
    }
    bool operator!=(const HdPrimvarDescriptor& other) const { return !(*this == other); }

    TfToken name;
    HdInterpolation interpolation;
    TfToken role;
    bool indexed;
};
HYDRA_INTERFACE_SIZE(HdPrimvarDescriptor, 32, 8);

using HdPrimvarDescriptorVector = std::vector<HdPrimvarDescriptor>;

/// A primvar that a computation makes.
struct HdExtComputationPrimvarDescriptor : public HdPrimvarDescriptor {
    HdExtComputationPrimvarDescriptor() : valueType{HdTypeInvalid, 0} {}
    HdExtComputationPrimvarDescriptor(const TfToken& name_, HdInterpolation interpolation_,
                                      const TfToken& role_, const SdfPath& sourceComputationId_,
                                      const TfToken& sourceComputationOutputName_,
                                      const HdTupleType& valueType_)
        : HdPrimvarDescriptor(name_, interpolation_, role_),
          sourceComputationId(sourceComputationId_),
          sourceComputationOutputName(sourceComputationOutputName_),
          valueType(valueType_) {}

    bool operator==(const HdExtComputationPrimvarDescriptor& other) const {
        return HdPrimvarDescriptor::operator==(other) &&
               sourceComputationId == other.sourceComputationId &&
               sourceComputationOutputName == other.sourceComputationOutputName &&
               valueType == other.valueType;
    }
    bool operator!=(const HdExtComputationPrimvarDescriptor& other) const {
        return !(*this == other);
    }

    SdfPath sourceComputationId;
    TfToken sourceComputationOutputName;
    HdTupleType valueType;
};
HYDRA_INTERFACE_SIZE(HdExtComputationPrimvarDescriptor, 64, 8);

using HdExtComputationPrimvarDescriptorVector = std::vector<HdExtComputationPrimvarDescriptor>;

/// A computation's input that another computation's output feeds.
struct HdExtComputationInputDescriptor {
    HdExtComputationInputDescriptor() = default;
    HdExtComputationInputDescriptor(const TfToken& name_, const SdfPath& sourceComputationId_,
                                    const TfToken& sourceComputationOutputName_)
        : name(name_),
          sourceComputationId(sourceComputationId_),
          sourceComputationOutputName(sourceComputationOutputName_) {}

    bool operator==(const HdExtComputationInputDescriptor& other) const {
        return name == other.name && sourceComputationId == other.sourceComputationId &&
               sourceComputationOutputName == other.sourceComputationOutputName;
    }
    bool operator!=(const HdExtComputationInputDescriptor& other) const {
        return !(*this == other);
    }

    TfToken name;
    SdfPath sourceComputationId;
    TfToken sourceComputationOutputName;
};
HYDRA_INTERFACE_SIZE(HdExtComputationInputDescriptor, 24, 8);

using HdExtComputationInputDescriptorVector = std::vector<HdExtComputationInputDescriptor>;

struct HdExtComputationOutputDescriptor {
    HdExtComputationOutputDescriptor() : valueType{HdTypeInvalid, 0} {}
    HdExtComputationOutputDescriptor(const TfToken& name_, const HdTupleType& valueType_)
        : name(name_),
          valueType(valueType_) {}

    bool operator==(const HdExtComputationOutputDescriptor& other) const {
        return name == other.name && valueType == other.valueType;
    }
    bool operator!=(const HdExtComputationOutputDescriptor& other) const {
        return !(*this == other);
    }

    TfToken name;
    HdTupleType valueType;
};
HYDRA_INTERFACE_SIZE(HdExtComputationOutputDescriptor, 24, 8);

using HdExtComputationOutputDescriptorVector = std::vector<HdExtComputationOutputDescriptor>;

/// Where prims pull their data from. The Sample... functions fill at most maxSampleCount samples
/// and return how many there are, which may be more, or none (then take the unsampled value).
/// Sample times are frames relative to the current one; they bracket the range and may lie outside
/// it. Prefer the forms with a time range: the others sample the current camera's shutter, but
/// transforms of a host in scene-index mode come as one sample only.
class HdSceneDelegate {
public:
    HdSceneDelegate(HdRenderIndex* parentIndex, const SdfPath& delegateID);
    virtual ~HdSceneDelegate();

    HdRenderIndex& GetRenderIndex() { return *_index; }
    const SdfPath& GetDelegateID() const { return _delegateID; }

    virtual void Sync(HdSyncRequestVector* request);
    virtual void PostSyncCleanup();
    virtual bool IsEnabled(const TfToken& option) const;

    virtual HdMeshTopology GetMeshTopology(const SdfPath& id);
    virtual HdBasisCurvesTopology GetBasisCurvesTopology(const SdfPath& id);
    virtual PxOsdSubdivTags GetSubdivTags(const SdfPath& id);
    virtual GfRange3d GetExtent(const SdfPath& id);
    virtual GfMatrix4d GetTransform(const SdfPath& id);
    virtual bool GetVisible(const SdfPath& id);
    virtual bool GetDoubleSided(const SdfPath& id);
    virtual HdCullStyle GetCullStyle(const SdfPath& id);
    virtual VtValue GetShadingStyle(const SdfPath& id);
    virtual HdDisplayStyle GetDisplayStyle(const SdfPath& id);
    virtual VtValue Get(const SdfPath& id, const TfToken& key);
    /// The values without repetition, and indices into them (left empty if the primvar is not
    /// indexed).
    virtual VtValue GetIndexedPrimvar(const SdfPath& id, const TfToken& key,
                                      VtIntArray* outIndices);
    virtual HdReprSelector GetReprSelector(const SdfPath& id);
    virtual TfToken GetRenderTag(const SdfPath& id);
    /// Light and shadow links of the prim.
    virtual VtArray<TfToken> GetCategories(const SdfPath& id);
    virtual std::vector<VtArray<TfToken>> GetInstanceCategories(const SdfPath& instancerId);
    virtual HdIdVectorSharedPtr GetCoordSysBindings(const SdfPath& id);
    virtual HdModelDrawMode GetModelDrawMode(const SdfPath& id);

    virtual size_t SampleTransform(const SdfPath& id, size_t maxSampleCount, float* sampleTimes,
                                   GfMatrix4d* sampleValues);
    virtual size_t SampleTransform(const SdfPath& id, float startTime, float endTime,
                                   size_t maxSampleCount, float* sampleTimes,
                                   GfMatrix4d* sampleValues);
    virtual size_t SampleInstancerTransform(const SdfPath& instancerId, size_t maxSampleCount,
                                            float* sampleTimes, GfMatrix4d* sampleValues);
    virtual size_t SampleInstancerTransform(const SdfPath& instancerId, float startTime,
                                            float endTime, size_t maxSampleCount,
                                            float* sampleTimes, GfMatrix4d* sampleValues);
    virtual size_t SamplePrimvar(const SdfPath& id, const TfToken& key, size_t maxSampleCount,
                                 float* sampleTimes, VtValue* sampleValues);
    virtual size_t SamplePrimvar(const SdfPath& id, const TfToken& key, float startTime,
                                 float endTime, size_t maxSampleCount, float* sampleTimes,
                                 VtValue* sampleValues);
    virtual size_t SampleIndexedPrimvar(const SdfPath& id, const TfToken& key,
                                        size_t maxSampleCount, float* sampleTimes,
                                        VtValue* sampleValues, VtIntArray* sampleIndices);
    virtual size_t SampleIndexedPrimvar(const SdfPath& id, const TfToken& key, float startTime,
                                        float endTime, size_t maxSampleCount, float* sampleTimes,
                                        VtValue* sampleValues, VtIntArray* sampleIndices);

    /// For each instance that draws the prototype, its index into the instancer's primvars.
    virtual VtIntArray GetInstanceIndices(const SdfPath& instancerId, const SdfPath& prototypeId);
    virtual GfMatrix4d GetInstancerTransform(const SdfPath& instancerId);
    virtual SdfPath GetInstancerId(const SdfPath& primId);
    virtual SdfPathVector GetInstancerPrototypes(const SdfPath& instancerId);

    /// Path in the application's scene.
    virtual SdfPath GetScenePrimPath(const SdfPath& rprimId, int instanceIndex,
                                     HdInstancerContext* instancerContext = nullptr);
    virtual SdfPathVector
    GetScenePrimPaths(const SdfPath& rprimId, std::vector<int> instanceIndices,
                      std::vector<HdInstancerContext>* instancerContexts = nullptr);

    virtual SdfPath GetMaterialId(const SdfPath& rprimId);
    /// Holds an HdMaterialNetworkMap.
    virtual VtValue GetMaterialResource(const SdfPath& materialId);
    virtual HdRenderBufferDescriptor GetRenderBufferDescriptor(const SdfPath& id);
    virtual VtValue GetLightParamValue(const SdfPath& id, const TfToken& paramName);
    virtual VtValue GetCameraParamValue(const SdfPath& cameraId, const TfToken& paramName);
    virtual HdVolumeFieldDescriptorVector GetVolumeFieldDescriptors(const SdfPath& volumeId);

    virtual TfTokenVector GetExtComputationSceneInputNames(const SdfPath& computationId);
    virtual HdExtComputationInputDescriptorVector
    GetExtComputationInputDescriptors(const SdfPath& computationId);
    virtual HdExtComputationOutputDescriptorVector
    GetExtComputationOutputDescriptors(const SdfPath& computationId);
    virtual HdExtComputationPrimvarDescriptorVector
    GetExtComputationPrimvarDescriptors(const SdfPath& id, HdInterpolation interpolationMode);
    virtual VtValue GetExtComputationInput(const SdfPath& computationId, const TfToken& input);
    virtual size_t SampleExtComputationInput(const SdfPath& computationId, const TfToken& input,
                                             size_t maxSampleCount, float* sampleTimes,
                                             VtValue* sampleValues);
    virtual size_t SampleExtComputationInput(const SdfPath& computationId, const TfToken& input,
                                             float startTime, float endTime, size_t maxSampleCount,
                                             float* sampleTimes, VtValue* sampleValues);
    virtual std::string GetExtComputationKernel(const SdfPath& computationId);
    virtual void InvokeExtComputation(const SdfPath& computationId,
                                      HdExtComputationContext* context);

    virtual HdPrimvarDescriptorVector GetPrimvarDescriptors(const SdfPath& id,
                                                            HdInterpolation interpolation);
    virtual TfTokenVector GetTaskRenderTags(const SdfPath& taskId);

private:
    HdSceneDelegate() = delete;
    HdSceneDelegate(HdSceneDelegate&) = delete;
    HdSceneDelegate& operator=(HdSceneDelegate&) = delete;

    HdRenderIndex* _index;
    SdfPath _delegateID;
};
HYDRA_INTERFACE_SIZE(HdSceneDelegate, 24, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
