#pragma once

#include "pxr/base/vt/value.h"
#include "pxr/imaging/interface.h"

#include <cstddef>
#include <cstdint>

HYDRA_INTERFACE_OPEN_SCOPE

using HdDirtyBits = uint32_t;

enum HdType {
    HdTypeInvalid = -1,
    HdTypeBool = 0,
    HdTypeUInt8,
    HdTypeUInt16,
    HdTypeInt8,
    HdTypeInt16,
    HdTypeInt32,
    HdTypeInt32Vec2,
    HdTypeInt32Vec3,
    HdTypeInt32Vec4,
    HdTypeUInt32,
    HdTypeUInt32Vec2,
    HdTypeUInt32Vec3,
    HdTypeUInt32Vec4,
    HdTypeFloat,
    HdTypeFloatVec2,
    HdTypeFloatVec3,
    HdTypeFloatVec4,
    HdTypeFloatMat3,
    HdTypeFloatMat4,
    HdTypeDouble,
    HdTypeDoubleVec2,
    HdTypeDoubleVec3,
    HdTypeDoubleVec4,
    HdTypeDoubleMat3,
    HdTypeDoubleMat4,
    HdTypeHalfFloat,
    HdTypeHalfFloatVec2,
    HdTypeHalfFloatVec3,
    HdTypeHalfFloatVec4,
    HdTypeInt32_2_10_10_10_REV,
    HdTypeCount
};

/// A value type and how many of it make one element.
struct HdTupleType {
    HdType type;
    size_t count;

    bool operator<(const HdTupleType& other) const {
        return type < other.type || (type == other.type && count < other.count);
    }
    bool operator==(const HdTupleType& other) const {
        return type == other.type && count == other.count;
    }
    bool operator!=(const HdTupleType& other) const { return !(*this == other); }
};
HYDRA_INTERFACE_SIZE(HdTupleType, 16, 8);

/// Pixel formats of render buffers; consecutive values are 1 to 4 channels of one component type.
enum HdFormat {
    HdFormatInvalid = -1,
    HdFormatUNorm8 = 0,
    HdFormatUNorm8Vec2,
    HdFormatUNorm8Vec3,
    HdFormatUNorm8Vec4,
    HdFormatSNorm8,
    HdFormatSNorm8Vec2,
    HdFormatSNorm8Vec3,
    HdFormatSNorm8Vec4,
    HdFormatFloat16,
    HdFormatFloat16Vec2,
    HdFormatFloat16Vec3,
    HdFormatFloat16Vec4,
    HdFormatFloat32,
    HdFormatFloat32Vec2,
    HdFormatFloat32Vec3,
    HdFormatFloat32Vec4,
    HdFormatInt16,
    HdFormatInt16Vec2,
    HdFormatInt16Vec3,
    HdFormatInt16Vec4,
    HdFormatUInt16,
    HdFormatUInt16Vec2,
    HdFormatUInt16Vec3,
    HdFormatUInt16Vec4,
    HdFormatInt32,
    HdFormatInt32Vec2,
    HdFormatInt32Vec3,
    HdFormatInt32Vec4,
    HdFormatFloat32UInt8,
    HdFormatCount
};

HdType HdGetComponentType(HdType type);
size_t HdGetComponentCount(HdType type);
size_t HdDataSizeOfType(HdType type);           ///< Bytes.
size_t HdDataSizeOfTupleType(HdTupleType type); ///< Bytes.

/// Type and count of what the value holds (an array counts its elements); HdTypeInvalid if unknown.
HdTupleType HdGetValueTupleType(const VtValue& value);
/// Address of the first element inside the value, null for an unknown type.
const void* HdGetValueData(const VtValue& value);

HdFormat HdGetComponentFormat(HdFormat format);
size_t HdGetComponentCount(HdFormat format);
size_t HdDataSizeOfFormat(HdFormat format); ///< Bytes a pixel.

HYDRA_INTERFACE_CLOSE_SCOPE
