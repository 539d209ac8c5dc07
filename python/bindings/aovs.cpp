// The table of AOVs and the layout of kept paths.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"
#include "film/aovTable.h"

namespace mbfeat {

namespace nb = nanobind;
using namespace nb::literals;

void bindAovs(nb::module_& module) {
    nb::enum_<AovReduction>(module, "AovReduction", "How a pixel's samples become its value.")
        .value("MEAN", AovReduction::kMean)
        .value("NEAREST", AovReduction::kNearest)
        .value("SUM", AovReduction::kSum)
        .value("VARIANCE", AovReduction::kVariance);

    nb::class_<AovDescriptor>(module, "AovDescriptor", "One row of the table of AOVs.")
        .def_ro("name", &AovDescriptor::name)
        .def_ro("channels", &AovDescriptor::channels)
        .def_ro("reduction", &AovDescriptor::reduction)
        .def_ro("clear_value", &AovDescriptor::clearValue)
        .def_ro("vertex", &AovDescriptor::vertex)
        .def_ro("doc", &AovDescriptor::doc)
        .def_prop_ro("is_integer", [](const AovDescriptor& d) { return d.type == AovType::kInt; });

    module.def("aov_table", &aovTable, nb::rv_policy::copy,
               "Every AOV with a fixed name, in layout order.");
    module.def("find_aov", &findAov, "name"_a,
               "The descriptor of a name, `primvars:*` included; None if there is no such AOV.");
    module.def("nearest_aov_name", &nearestAovName, "name"_a);

    nb::class_<PathSampleField>(module, "PathSampleField", "One float of a kept path.")
        .def_ro("name", &PathSampleField::name)
        .def_ro("is_integer", &PathSampleField::isInteger);
    module.def("path_sample_fields", &pathSampleFields, "extended"_a = false,
               "Layout of a kept path; a deep EXR has these channels.");
}

} // namespace mbfeat
