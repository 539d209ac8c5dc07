#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/hd/types.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

#include <cstddef>
#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

/// Which prims are dirty and how. One a render index, made by it; nothing here constructs one.
class HdChangeTracker {
public:
    enum RprimDirtyBits : HdDirtyBits {
        Clean = 0,
        InitRepr = 1 << 0,
        Varying = 1 << 1,
        AllDirty = ~Varying,
        DirtyPrimID = 1 << 2,
        DirtyExtent = 1 << 3,
        DirtyDisplayStyle = 1 << 4,
        DirtyPoints = 1 << 5,
        DirtyPrimvar = 1 << 6,
        DirtyMaterialId = 1 << 7,
        DirtyTopology = 1 << 8,
        DirtyTransform = 1 << 9,
        DirtyVisibility = 1 << 10,
        DirtyNormals = 1 << 11,
        DirtyDoubleSided = 1 << 12,
        DirtyCullStyle = 1 << 13,
        DirtySubdivTags = 1 << 14,
        DirtyWidths = 1 << 15,
        DirtyInstancer = 1 << 16,
        DirtyInstanceIndex = 1 << 17,
        DirtyRepr = 1 << 18,
        DirtyRenderTag = 1 << 19,
        DirtyComputationPrimvarDesc = 1 << 20,
        DirtyCategories = 1 << 21,
        DirtyVolumeField = 1 << 22,
        AllSceneDirtyBits = ((1 << 23) - 1),
        NewRepr = 1 << 23,
        CustomBitsBegin = 1 << 24,
        CustomBitsEnd = 1 << 30,
        CustomBitsMask = 0x7f << 24
    };

    virtual ~HdChangeTracker();

    HdDirtyBits GetRprimDirtyBits(const SdfPath& id) const;
    void MarkRprimDirty(const SdfPath& id, HdDirtyBits bits = AllDirty);
    void MarkRprimClean(const SdfPath& id, HdDirtyBits newBits = Clean);
    void MarkAllRprimsDirty(HdDirtyBits bits);

    static bool IsDirty(HdDirtyBits dirtyBits) { return (dirtyBits & AllDirty) != 0; }
    static bool IsClean(HdDirtyBits dirtyBits) { return (dirtyBits & AllDirty) == 0; }
    static bool IsVarying(HdDirtyBits dirtyBits) { return (dirtyBits & Varying) != 0; }
    static bool IsExtentDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsDisplayStyleDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsSubdivTagsDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    /// The points, normals and widths bits count for the primvars of those names.
    static bool IsPrimvarDirty(HdDirtyBits dirtyBits, const SdfPath& id, const TfToken& name);
    static bool IsAnyPrimvarDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsTopologyDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsDoubleSidedDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsCullStyleDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsTransformDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsVisibilityDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsPrimIdDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsInstancerDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsInstanceIndexDirty(HdDirtyBits dirtyBits, const SdfPath& id);
    static bool IsReprDirty(HdDirtyBits dirtyBits, const SdfPath& id);

    HdDirtyBits GetInstancerDirtyBits(const SdfPath& id);
    void MarkInstancerDirty(const SdfPath& id, HdDirtyBits bits = AllDirty);
    void MarkInstancerClean(const SdfPath& id, HdDirtyBits newBits = Clean);
    void AddInstancerRprimDependency(const SdfPath& instancerId, const SdfPath& rprimId);
    void RemoveInstancerRprimDependency(const SdfPath& instancerId, const SdfPath& rprimId);
    void AddInstancerSprimDependency(const SdfPath& instancerId, const SdfPath& sprimId);
    void RemoveInstancerSprimDependency(const SdfPath& instancerId, const SdfPath& sprimId);

    HdDirtyBits GetSprimDirtyBits(const SdfPath& id);
    void MarkSprimDirty(const SdfPath& id, HdDirtyBits bits);
    void MarkSprimClean(const SdfPath& id, HdDirtyBits newBits = Clean);
    HdDirtyBits GetBprimDirtyBits(const SdfPath& id);
    void MarkBprimDirty(const SdfPath& id, HdDirtyBits bits);
    void MarkBprimClean(const SdfPath& id, HdDirtyBits newBits = Clean);

    unsigned int GetCollectionVersion(const TfToken& collectionName) const;
    unsigned int GetRenderTagVersion() const;
    unsigned int GetTaskRenderTagsVersion() const;
    unsigned int GetVisibilityChangeCount() const;
    unsigned int GetInstanceIndicesChangeCount() const;
    unsigned int GetVaryingStateVersion() const { return _varyingStateVersion; }
    unsigned int GetRprimIndexVersion() const { return _rprimIndexVersion; }
    unsigned int GetSprimIndexVersion() const { return _sprimIndexVersion; }
    unsigned int GetBprimIndexVersion() const { return _bprimIndexVersion; }
    unsigned int GetInstancerIndexVersion() const { return _instancerIndexVersion; }
    unsigned int GetSceneStateVersion() const { return _sceneStateVersion; }

    static std::string StringifyDirtyBits(HdDirtyBits dirtyBits);

private:
    HdChangeTracker() = delete;
    HdChangeTracker(const HdChangeTracker&) = delete;
    HdChangeTracker& operator=(const HdChangeTracker&) = delete;

    alignas(8) std::byte _opaqueMaps[3160];
    unsigned int _varyingStateVersion;
    unsigned int _rprimIndexVersion;
    unsigned int _sprimIndexVersion;
    unsigned int _bprimIndexVersion;
    unsigned int _instancerIndexVersion;
    unsigned int _sceneStateVersion;
    alignas(8) std::byte _opaqueCounts[24];
};
HYDRA_INTERFACE_SIZE(HdChangeTracker, 3216, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
