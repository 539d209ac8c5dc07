// Images for people to look at: the sRGB curve, OpenColorIO displays, files.
#include "scene/colorManagement.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"
#include "film/imageWriter.h"

namespace mbfeat {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using ImageArray = nb::ndarray<float, nb::shape<-1, -1, -1>, nb::c_contig, nb::device::cpu>;

/// A config as Python holds it.
struct ConfigHandle {
    std::shared_ptr<const ColorConfig> config;
};

std::size_t texelsOf(const ImageArray& image, int fewest, int most) {
    const auto channels = static_cast<int>(image.shape(2));
    if (channels < fewest || channels > most) {
        throw BindingError({"image", "it has " + std::to_string(channels) + " channels; from " +
                                         std::to_string(fewest) + " to " + std::to_string(most) +
                                         " are wanted"});
    }
    return image.shape(0) * image.shape(1);
}

void toDisplay(const ConfigHandle& handle, const ImageArray& image, const std::string& from,
               const std::string& display, const std::string& view) {
    const std::size_t texels = texelsOf(image, 3, 4);
    const std::shared_ptr<const ColorTransform> transform =
        unwrap(handle.config->displayTransform(from, display, view));
    const nb::gil_scoped_release release;
    transform->apply(image.data(), texels, static_cast<int>(image.shape(2)));
}

void writeImage(const std::string& path, const ImageArray& image) {
    texelsOf(image, 1, 4);
    Status status;
    {
        const nb::gil_scoped_release release;
        status =
            writeImageFile(path, static_cast<int>(image.shape(1)), static_cast<int>(image.shape(0)),
                           static_cast<int>(image.shape(2)), image.data());
    }
    check(status);
}

std::pair<ConfigHandle, std::vector<std::string>> fromEnvironment() {
    Diagnostics diagnostics;
    ConfigHandle handle{ColorConfig::fromEnvironment(diagnostics)};
    std::vector<std::string> warnings;
    for (const Message& message : diagnostics.messages()) {
        warnings.push_back(message.subject + ": " + message.text);
    }
    return {std::move(handle), std::move(warnings)};
}

} // namespace

void bindColor(nb::module_& module) {
    nb::class_<ConfigHandle>(module, "ColorConfig", "An OpenColorIO config.")
        .def_static(
            "open",
            [](const std::string& file) { return ConfigHandle{unwrap(ColorConfig::open(file))}; },
            "file"_a, "A config file or ocio://NAME; Error when it cannot be used.")
        .def_static("from_environment", &fromEnvironment,
                    "The config that $OCIO or the set-up names, and what is wrong with it.")
        .def_prop_ro("source", [](const ConfigHandle& h) { return h.config->source(); })
        .def_prop_ro("displays", [](const ConfigHandle& h) { return h.config->displays(); })
        .def_prop_ro("default_display",
                     [](const ConfigHandle& h) { return h.config->defaultDisplay(); })
        .def(
            "views",
            [](const ConfigHandle& h, const std::string& display) {
                return h.config->views(display);
            },
            "display"_a)
        .def(
            "default_view",
            [](const ConfigHandle& h, const std::string& display) {
                return h.config->defaultView(display);
            },
            "display"_a)
        .def(
            "to_display", &toDisplay, "image"_a, "from_space"_a = "", "display"_a = "",
            "view"_a = "",
            "In place on float32 [height, width, 3 or 4]: from a colour space (\"\" is linear "
            "Rec.709) to what the display shows in the view (\"\" is the default). Alpha is kept.");

    module.def(
        "encode_srgb",
        [](const ImageArray& image) {
            encodeSrgb(image.data(), texelsOf(image, 1, 4), static_cast<int>(image.shape(2)));
        },
        "image"_a, "The sRGB curve in place on linear float32 [height, width, channels].");
    module.def("write_image", &writeImage, "path"_a, "image"_a,
               "Writes float32 [height, width, 1..4 channels], row 0 at the top, in the format of "
               "the path's extension, whole or not at all; Error when it cannot. Eight-bit formats "
               "clamp to 0..1.");
    module.def("image_extensions", &imageFileExtensions, "Extensions that write_image knows.");
}

} // namespace mbfeat
