#include "delegate/meshSource.h"

#include "delegate/tokens.h"
#include "pxr/imaging/hd/extComputationUtils.h"

namespace mbfeat {

namespace {

RawInterpolation toRaw(HdInterpolation interpolation) {
    switch (interpolation) {
    case HdInterpolationUniform:
        return RawInterpolation::kUniform;
    case HdInterpolationVarying:
        return RawInterpolation::kVarying;
    case HdInterpolationVertex:
        return RawInterpolation::kVertex;
    case HdInterpolationFaceVarying:
        return RawInterpolation::kFaceVarying;
    default:
        return RawInterpolation::kConstant;
    }
}

constexpr HdInterpolation kInterpolations[] = {HdInterpolationConstant, HdInterpolationUniform,
                                               HdInterpolationVarying, HdInterpolationVertex,
                                               HdInterpolationFaceVarying};

} // namespace

MeshSource::MeshSource(const HdMesh& prim, HdSceneDelegate* delegate,
                       const HdMeshTopology& topology, const std::vector<std::uint16_t>& slots,
                       const std::set<std::string>& wanted, Diagnostics& diagnostics) {
    raw_.path = prim.GetId().GetString();
    raw_.doubleSided = prim.IsDoubleSided(delegate);
    addTopology(topology, slots);
    addComputedPrimvars(prim, delegate);
    addPrimvars(prim, delegate, wanted, diagnostics);
    const bool flat = prim.GetDisplayStyle(delegate).flatShadingEnabled;
    if (flat) {
        raw_.normals = RawAttribute();
    }
    // A bilinear surface refines to its own flat faces.
    raw_.smoothNormals =
        !flat && topology.GetScheme() != tokens().none && topology.GetScheme() != tokens().bilinear;
}

ArrayView<int> MeshSource::keep(const VtIntArray& array) {
    integers_.push_back(array);
    return {integers_.back().cdata(), integers_.back().size()};
}

void MeshSource::addTopology(const HdMeshTopology& topology,
                             const std::vector<std::uint16_t>& slots) {
    raw_.faceVertexCounts = keep(topology.GetFaceVertexCounts());
    raw_.faceVertexIndices = keep(topology.GetFaceVertexIndices());
    raw_.leftHanded = topology.GetOrientation() == tokens().leftHanded;
    VtIntArray holes = topology.GetHoleIndices();
    for (const int face : topology.GetInvisibleFaces()) {
        holes.push_back(face);
    }
    raw_.holeIndices = keep(holes);
    const HdGeomSubsets& subsets = topology.GetGeomSubsets();
    for (std::size_t i = 0; i < subsets.size() && i < slots.size(); ++i) {
        RawSubset subset;
        subset.path = subsets[i].id.GetString();
        subset.faces = keep(subsets[i].indices);
        subset.slot = slots[i];
        raw_.subsets.push_back(std::move(subset));
    }
}

void MeshSource::addComputedPrimvars(const HdMesh& prim, HdSceneDelegate* delegate) {
    HdExtComputationPrimvarDescriptorVector wanted;
    for (const HdExtComputationPrimvarDescriptor& descriptor :
         delegate->GetExtComputationPrimvarDescriptors(prim.GetId(), HdInterpolationVertex)) {
        if (descriptor.name == tokens().points || descriptor.name == tokens().normals) {
            wanted.push_back(descriptor);
        }
    }
    if (wanted.empty()) {
        return;
    }
    for (const auto& [name, value] :
         HdExtComputationUtils::GetComputedPrimvarValues(wanted, delegate)) {
        floats_.emplace_back(value);
        const FloatArray& array = floats_.back();
        if (array.width() != 3) {
            continue;
        }
        computed_.insert(name.GetString());
        if (name == tokens().points) {
            raw_.points = array.view();
        } else {
            raw_.normals = {"normals", RawInterpolation::kVertex, 3, array.view(), false, {}};
        }
    }
}

void MeshSource::addPrimvars(const HdMesh& prim, HdSceneDelegate* delegate,
                             const std::set<std::string>& wanted, Diagnostics& diagnostics) {
    for (const HdInterpolation interpolation : kInterpolations) {
        for (const HdPrimvarDescriptor& descriptor :
             prim.GetPrimvarDescriptors(delegate, interpolation)) {
            const std::string& name = descriptor.name.GetString();
            const bool isBuiltIn =
                descriptor.name == tokens().points || descriptor.name == tokens().normals;
            if (computed_.count(name) != 0 || (!isBuiltIn && wanted.count(name) == 0)) {
                continue;
            }
            VtIntArray indices;
            const VtValue value = prim.GetIndexedPrimvar(delegate, descriptor.name, &indices);
            addAttribute(name, interpolation, value, indices, diagnostics);
        }
    }
}

void MeshSource::addAttribute(const std::string& name, HdInterpolation interpolation,
                              const VtValue& value, const VtIntArray& indices,
                              Diagnostics& diagnostics) {
    floats_.emplace_back(value);
    const FloatArray& array = floats_.back();
    if (array.width() == 0) {
        diagnostics.warn(raw_.path, "primvar " + name + " has type " + value.GetTypeName() +
                                        ", which cannot be shaded with; it is ignored. Author "
                                        "floats or vectors of two to four floats.");
        return;
    }
    if (name == tokens().points.GetString()) {
        if (array.width() == 3) {
            raw_.points = array.view();
        }
        return;
    }
    RawAttribute attribute;
    attribute.name = name;
    attribute.interpolation = toRaw(interpolation);
    attribute.width = array.width();
    attribute.values = array.view();
    attribute.indexed = !indices.empty();
    if (attribute.indexed) {
        attribute.indices = keep(indices);
    }
    if (name != tokens().normals.GetString()) {
        raw_.primvars.push_back(std::move(attribute));
    } else if (array.width() == 3) {
        raw_.normals = std::move(attribute);
    }
}

} // namespace mbfeat
