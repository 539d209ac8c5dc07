// Polygon meshes as plain data: triangulated, validated, in object space.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/affine.h"
#include "core/vec.h"

namespace mbfeat {

/// How the values of an attribute map to a triangle mesh.
enum class Interpolation : std::uint8_t {
    kConstant,    ///< one value
    kUniform,     ///< one value a source face (index Mesh::triangleFaces)
    kVertex,      ///< one value a point (USD's varying too)
    kFaceVarying, ///< one value a triangle corner: 3 * triangle + corner
};

/// Surface attribute, up to four floats wide. The number of values has been checked against the
/// mesh, so look-ups need no bounds check.
struct Attribute {
    Interpolation interpolation = Interpolation::kConstant;
    int width = 0; ///< 1..4; 0 means the attribute is absent
    std::vector<float> values;

    explicit operator bool() const { return width > 0; }
};

struct NamedAttribute {
    std::string name;
    Attribute attribute;
};

/// Three point indices, counter-clockwise seen from the front (left-handed meshes were reversed
/// when they were triangulated).
struct Triangle {
    std::uint32_t v[3];
};

/// Immutable once handed to the Scene; shared by every instance.
struct Mesh {
    std::vector<Float3> points;      ///< object space, finite
    std::vector<Triangle> triangles; ///< indices < points.size()
    /// Source face of each triangle. Empty when every source face is a triangle in order.
    std::vector<std::uint32_t> triangleFaces;
    /// Slot in MeshInstance::materials of each triangle. Empty when there is one slot.
    std::vector<std::uint16_t> triangleMaterials;
    Attribute normals; ///< width 3, object space, not normalised; absent: faceted
    std::vector<NamedAttribute> primvars; ///< others by name ("st", "displayColor", ...)
    bool doubleSided = false;

    std::uint32_t faceOf(std::uint32_t triangle) const {
        return triangleFaces.empty() ? triangle : triangleFaces[triangle];
    }
    std::uint32_t materialSlotOf(std::uint32_t triangle) const {
        return triangleMaterials.empty() ? 0U : triangleMaterials[triangle];
    }
    const Attribute* findPrimvar(const std::string& name) const {
        for (const NamedAttribute& primvar : primvars) {
            if (primvar.name == name) {
                return &primvar.attribute;
            }
        }
        return nullptr;
    }
};

/// Whether two meshes hold the same bytes.
bool isSame(const Mesh& a, const Mesh& b);

} // namespace mbfeat
