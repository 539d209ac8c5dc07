// Products and reports: writing files, and checking them.
#include "film/product.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"

namespace mbfeat {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

std::vector<std::string> problems(const ProductSpec& product) {
    std::vector<std::string> texts;
    for (const Error& error : validateProduct(product)) {
        texts.push_back(error.subject + ": " + error.text);
    }
    return texts;
}

std::vector<std::string> write(const ProductSpec& product, const FilmHandle& handle,
                               const RenderReport& report) {
    Status status;
    Diagnostics diagnostics;
    {
        const nb::gil_scoped_release release;
        status = writeProduct(product, *handle.film, report, &diagnostics);
    }
    check(status);
    std::vector<std::string> warnings;
    for (const Message& message : diagnostics.messages()) {
        warnings.push_back(message.subject + ": " + message.text);
    }
    return warnings;
}

nb::object toDict(const RenderReport& report) {
    return nb::module_::import_("json").attr("loads")(report.json());
}

nb::list settings(const RenderReport& report) {
    nb::list rows;
    for (const Settings::Resolved& row : report.settings) {
        rows.append(nb::make_tuple(row.name, toString(row.value), row.source));
    }
    return rows;
}

void bindReport(nb::module_& module) {
    nb::class_<SamplingOutcome>(module, "SamplingOutcome",
                                "The samples that pixels got, and why they got no more.")
        .def(nb::init<>())
        .def_ro("fewest", &SamplingOutcome::fewest)
        .def_ro("mean", &SamplingOutcome::mean)
        .def_ro("most", &SamplingOutcome::most)
        .def_prop_ro(
            "stopped", [](const SamplingOutcome& o) { return stopReasonName(o.stop); },
            "samples, targetError, timeLimit or interrupted.")
        .def_prop_ro(
            "error",
            [](const SamplingOutcome& o) {
                return o.error ? std::optional<double>(o.error->whole) : std::nullopt;
            },
            "Estimated relative error of the image; None where it was not asked for.")
        .def_prop_ro(
            "error95",
            [](const SamplingOutcome& o) {
                return o.error ? std::optional<double>(o.error->percentile95) : std::nullopt;
            },
            "The same of the 95th percentile of the pixels.");
    nb::class_<RenderReport>(module, "RenderReport", "What a render was and did.")
        .def(nb::init<>())
        .def_ro("frame", &RenderReport::frame)
        .def_ro("samples_per_pixel", &RenderReport::samplesPerPixel)
        .def_ro("sampling", &RenderReport::sampling)
        .def_ro("branches", &RenderReport::branches,
                "Paths that one splits into, by view; 0 of what is not seen.")
        .def_ro("seconds", &RenderReport::seconds)
        .def_ro("written", &RenderReport::written)
        .def_ro("errors", &RenderReport::errors)
        .def_ro("warnings", &RenderReport::warnings)
        .def_ro("interrupted", &RenderReport::interrupted)
        .def_prop_ro("total_seconds", &RenderReport::totalSeconds)
        .def_prop_ro("settings", &settings,
                     nb::sig("def settings(self) -> list[tuple[str, str, SettingSource]]"),
                     "Name, value as text, and who set it, in table order.")
        .def_prop_ro("effects", [](const RenderReport& r) { return r.census.present; })
        .def_prop_ro("triangles", [](const RenderReport& r) { return r.census.triangles; })
        .def_prop_ro("instances", [](const RenderReport& r) { return r.census.instances; })
        .def_prop_ro("lights", [](const RenderReport& r) { return r.census.lights; })
        .def_prop_ro("paths", [](const RenderReport& r) { return r.trace.paths; })
        .def_prop_ro("rays",
                     [](const RenderReport& r) { return r.trace.rays + r.trace.shadowRays; })
        .def_prop_ro("non_finite", [](const RenderReport& r) { return r.trace.nonFinite; })
        .def("json", &RenderReport::json)
        .def("to_dict", &toDict, nb::sig("def to_dict(self) -> dict[str, object]"),
             "The report as plain Python values.")
        .def("header_attributes", &RenderReport::headerAttributes);
}

void bindLayout(nb::module_& module) {
    nb::class_<AovLayoutEntry>(module, "AovLayoutEntry", "The channels of one AOV in a file.")
        .def_ro("aov", &AovLayoutEntry::aov)
        .def_ro("layer", &AovLayoutEntry::layer)
        .def_ro("type", &AovLayoutEntry::type)
        .def_ro("vertex", &AovLayoutEntry::vertex)
        .def_ro("channels", &AovLayoutEntry::channels)
        .def_ro("doc", &AovLayoutEntry::doc)
        .def_ro("bytes", &AovLayoutEntry::bytes)
        .def_ro("part", &AovLayoutEntry::part);
    nb::class_<AovLayout>(module, "AovLayout", "What is in a file, or will be.")
        .def_ro("deep", &AovLayout::deep)
        .def_ro("parts", &AovLayout::parts)
        .def_ro("compression", &AovLayout::compression)
        .def_ro("layers", &AovLayout::layers)
        .def_ro("attributes", &AovLayout::attributes)
        .def_prop_ro("bytes", &AovLayout::bytes, "Of a pixel or deep sample, uncompressed.")
        .def_prop_ro(
            "resolution",
            [](const AovLayout& l) { return nb::make_tuple(l.window.width, l.window.height); },
            nb::sig("def resolution(self) -> tuple[int, int]"))
        .def_prop_ro(
            "data_window",
            [](const AovLayout& l) {
                const PixelRect& r = l.window.data;
                return nb::make_tuple(r.x, r.y, r.width, r.height);
            },
            nb::sig("def data_window(self) -> tuple[int, int, int, int]"));
    module.def("describe_product", &describeProduct, "product"_a,
               "The layout that write_product gives a product.");
    module.def(
        "describe_product_file",
        [](const std::string& path) { return unwrap(describeProductFile(path)); }, "path"_a,
        "The layout of an EXR file, ours or not; Error when it cannot be read.");
}

} // namespace

void bindProducts(nb::module_& module) {
    bindReport(module);
    nb::enum_<PixelType>(module, "PixelType")
        .value("HALF", PixelType::kHalf)
        .value("FLOAT", PixelType::kFloat)
        .value("UINT", PixelType::kUInt);

    nb::class_<ProductLayer>(module, "ProductLayer", "One RenderVar of a product.")
        .def(
            "__init__",
            [](ProductLayer* self, std::string aov, std::string layer, PixelType pixelType) {
                new (self) ProductLayer{std::move(aov), std::move(layer), pixelType};
            },
            "aov"_a, "layer"_a = "", "pixel_type"_a = PixelType::kFloat)
        .def_rw("aov", &ProductLayer::aov)
        .def_rw("layer", &ProductLayer::layer)
        .def_rw("pixel_type", &ProductLayer::pixelType);

    nb::class_<ProductSpec>(module, "ProductSpec", "What goes into a file.")
        .def(
            "__init__",
            [](ProductSpec* self, std::string path, std::vector<ProductLayer> layers, bool deep) {
                new (self) ProductSpec{};
                self->path = std::move(path);
                self->layers = std::move(layers);
                self->deep = deep;
            },
            "path"_a, "layers"_a = std::vector<ProductLayer>(), "deep"_a = false)
        .def_rw("path", &ProductSpec::path)
        .def_rw("prim_path", &ProductSpec::primPath)
        .def_rw("deep", &ProductSpec::deep)
        .def_rw("layers", &ProductSpec::layers)
        .def_rw("compression", &ProductSpec::compression)
        .def_rw("multi_part", &ProductSpec::multiPart)
        .def_rw("attributes", &ProductSpec::attributes);

    bindLayout(module);
    module.def("validate_product", &problems, "product"_a,
               "What is wrong with a product, each naming prim or file.");
    module.def("write_product", &write, "product"_a, "film"_a, "report"_a,
               "Writes the file beside its target and renames it; returns warnings. Error when it "
               "cannot.");
    module.def("check_product_file", &checkProductFile, "path"_a,
               "What differs between the file's channels and the AOV table; empty: nothing.");
}

} // namespace mbfeat
