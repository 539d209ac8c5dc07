#include "scene/mesh.h"

#include <algorithm>
#include <cstring>

namespace mbfeat {

namespace {

template <class T>
bool sameBytes(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool isSame(const Attribute& a, const Attribute& b) {
    return a.interpolation == b.interpolation && a.width == b.width &&
           sameBytes(a.values, b.values);
}

} // namespace

bool isSame(const Mesh& a, const Mesh& b) {
    return a.doubleSided == b.doubleSided && sameBytes(a.points, b.points) &&
           sameBytes(a.triangles, b.triangles) && sameBytes(a.triangleFaces, b.triangleFaces) &&
           sameBytes(a.triangleMaterials, b.triangleMaterials) && isSame(a.normals, b.normals) &&
           std::equal(a.primvars.begin(), a.primvars.end(), b.primvars.begin(), b.primvars.end(),
                      [](const NamedAttribute& p, const NamedAttribute& q) {
                          return p.name == q.name && isSame(p.attribute, q.attribute);
                      });
}

} // namespace mbfeat
