// The denoiser: models, reconstruction from arrays, the splat.
#include "denoise/denoiser.h"

#include <algorithm>
#include <memory>

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "bindings.h"
#include "core/parallel.h"
#include "denoise/splat.h"
#include "film/deepReader.h"

namespace mbfeat {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Array = nb::ndarray<float, nb::c_contig, nb::device::cpu>;
using PathArray = nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using CountArray = nb::ndarray<const std::uint32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using MatrixArray = nb::ndarray<const float, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;

struct ModelHandle {
    std::shared_ptr<const DenoiseModel> model;
};

nb::object denoisePaths(const ModelHandle& handle, const PathArray& paths,
                        const std::vector<std::string>& fields, const MatrixArray& worldToCamera,
                        const std::optional<CountArray>& counts, ShownFeatures shown, int threads,
                        int tile, double memory, const std::vector<std::string>& lights) {
    PathSamples samples;
    samples.height = static_cast<int>(paths.shape(0));
    samples.width = static_cast<int>(paths.shape(1));
    samples.capacity = static_cast<int>(paths.shape(2));
    samples.data = paths.data();
    samples.fields = fields;
    std::copy_n(worldToCamera.data(), 9, samples.worldToCamera);
    if (paths.shape(3) != fields.size()) {
        throw BindingError({"paths", "they have " + std::to_string(paths.shape(3)) +
                                         " values each, but " + std::to_string(fields.size()) +
                                         " fields are named"});
    }
    if (counts) {
        if (counts->shape(0) != paths.shape(0) || counts->shape(1) != paths.shape(1)) {
            throw BindingError({"counts", "their size is not that of the image"});
        }
        samples.counts.assign(counts->data(), counts->data() + counts->size());
        for (std::uint32_t& count : samples.counts) {
            count = std::min(count, static_cast<std::uint32_t>(samples.capacity));
        }
    }
    DenoiseOptions options;
    options.threads = threads;
    options.tile = tile;
    options.memory = memory;
    options.shown = shown;
    options.lights = lights;
    Result<DenoiseResult> result = [&] {
        const nb::gil_scoped_release release;
        return denoise(handle.model, samples, options);
    }();
    DenoiseResult found = unwrap(std::move(result));
    nb::dict about;
    about["tiles"] = found.tiles;
    about["tile_size"] = found.tileSize;
    about["repaired"] = found.repaired;
    about["empty"] = found.empty;
    about["gather_seconds"] = found.gatherSeconds;
    about["inference_seconds"] = found.inferenceSeconds;
    about["splat_seconds"] = found.splatSeconds;
    return nb::make_tuple(
        ownedArray(std::move(found.image), {lights.size(), 3, paths.shape(0), paths.shape(1)}),
        about);
}

nb::object denoiseFile(const std::string& path, const std::string& model, DenoiseFeatures features,
                       int threads, int tile, double memory, const std::vector<std::string>& aovs) {
    DenoiseSettings settings;
    settings.enabled = true;
    settings.model = model;
    settings.features = features;
    settings.tile = tile;
    settings.memory = memory;
    Result<DenoisedFile> result = [&] {
        const nb::gil_scoped_release release;
        return denoiseDeepFile(path, settings, threads, aovs);
    }();
    DenoisedFile file = unwrap(std::move(result));
    return nb::make_tuple(FilmHandle{file.film}, std::move(file.report));
}

nb::object splatArrays(const Array& hidden, const Array& light, const Array& weight,
                       const Array& bias, const std::optional<Array>& presence, bool apart,
                       SplatLanes lanes, int threads, const std::optional<Array>& alike,
                       const std::optional<Array>& scales) {
    SplatInput input;
    const bool ranks = hidden.ndim() == 4 && light.ndim() == 4 && weight.ndim() == 2 &&
                       bias.ndim() == 1 && (!presence || presence->ndim() == 3) &&
                       (!alike || alike->ndim() == 4) &&
                       (!scales || (alike && scales->ndim() == 4));
    if (!ranks) {
        throw BindingError({"splat", "hidden and light have four dimensions, weight two, bias one, "
                                     "presence three, alike and scales four"});
    }
    input.units = static_cast<int>(hidden.shape(0));
    input.channels = static_cast<int>(hidden.shape(1));
    input.height = static_cast<int>(hidden.shape(2));
    input.width = static_cast<int>(hidden.shape(3));
    input.lights = static_cast<int>(light.shape(1));
    while (static_cast<std::size_t>(input.kernel) * static_cast<std::size_t>(input.kernel) <
           bias.size()) {
        input.kernel += 2;
    }
    const auto taps =
        static_cast<std::size_t>(input.kernel) * static_cast<std::size_t>(input.kernel);
    const std::size_t plane = hidden.shape(2) * hidden.shape(3);
    const std::size_t groups = scales ? scales->shape(1) : 0;
    const int guided = groups <= guides::kCount ? guides::ofGroups(static_cast<int>(groups)) : 0;
    const bool fits =
        taps == bias.size() && weight.size() == taps * hidden.shape(1) &&
        light.size() == hidden.shape(0) * light.shape(1) * plane &&
        (!presence || presence->size() == hidden.shape(0) * plane) &&
        (!alike || alike->size() == hidden.shape(0) * alike->shape(1) * plane) &&
        (!scales || (guided > 0 && alike->shape(1) >= static_cast<std::size_t>(guided) &&
                     scales->size() == hidden.shape(0) * groups * plane));
    if (!fits) {
        throw BindingError({"splat", "the sizes of its arrays contradict each other"});
    }
    input.hidden = hidden.data();
    input.light = light.data();
    input.weight = weight.data();
    input.bias = bias.data();
    input.alikeChannels = alike ? static_cast<int>(alike->shape(1)) : 0;
    input.alike = alike ? alike->data() : nullptr;
    input.guides = guided;
    input.scales = scales ? scales->data() : nullptr;
    input.presence = presence ? presence->data() : nullptr;
    input.apart = apart;
    std::vector<float> image(light.shape(1) * plane);
    {
        const nb::gil_scoped_release release;
        ThreadPool pool(threads);
        splat(input, {0, 0, input.width, input.height}, image.data(), pool, nullptr, lanes);
    }
    return nb::cast(
        ownedArray(std::move(image), {light.shape(1), hidden.shape(2), hidden.shape(3)}));
}

} // namespace

void bindDenoise(nb::module_& module) {
    nb::enum_<ShownFeatures>(module, "ShownFeatures", "How much of paths a network is shown.")
        .value("ALL", ShownFeatures::kAll)
        .value("FIRST_HIT", ShownFeatures::kFirstHit)
        .value("NONE", ShownFeatures::kNone);
    nb::enum_<SplatLanes>(module, "SplatLanes", "What the splat is computed on.")
        .value("SCALAR", SplatLanes::kScalar)
        .value("NARROW", SplatLanes::kNarrow)
        .value("WIDE", SplatLanes::kWide);

    nb::class_<ModelHandle>(module, "DenoiseModel", "A trained network that is ready to run.")
        .def_static(
            "open",
            [](const std::string& name, int threads) {
                const nb::gil_scoped_release release;
                return ModelHandle{unwrap(DenoiseModel::open(name, threads))};
            },
            "name"_a = "", "threads"_a = 0,
            "An ONNX file, or the name of a model that MBFeat comes with; Error when it cannot be "
            "used.")
        .def_prop_ro("file", [](const ModelHandle& h) { return h.model->file(); })
        .def_prop_ro("features", [](const ModelHandle& h) { return h.model->contract().features; })
        .def_prop_ro("channels", [](const ModelHandle& h) { return h.model->contract().channels; })
        .def_prop_ro("is_layered",
                     [](const ModelHandle& h) {
                         return h.model->contract().kind == DenoiseContract::Kind::kLayered;
                     })
        .def_prop_ro("training", [](const ModelHandle& h) {
            return h.model->graph().metadata("mbfeat:training");
        });
    module.def("installed_models", &DenoiseModel::installed,
               "Names and files of the models that MBFeat comes with.");
    module.def(
        "denoise_paths", &denoisePaths, "model"_a, "paths"_a, "fields"_a, "world_to_camera"_a,
        "counts"_a = nb::none(), "shown"_a = ShownFeatures::kAll, "threads"_a = 0, "tile"_a = 0,
        "memory"_a = 1.0, "lights"_a = std::vector<std::string>{"R"},
        nb::sig("def denoise_paths(model: DenoiseModel, paths: NDArray[numpy.float32], fields: "
                "list[str], world_to_camera: NDArray[numpy.float32], counts: "
                "NDArray[numpy.uint32] | None = None, shown: ShownFeatures = ..., "
                "threads: int = 0, tile: int = 0, memory: float = 1.0, lights: list[str] = ['R']) "
                "-> tuple[NDArray[numpy.float32], dict[str, float]]"),
        "Image [lights, 3, height, width] of paths float32 [height, width, samples, fields], and "
        "what it took.");
    nb::enum_<DenoiseFeatures>(module, "DenoiseFeatures", "mbfeat:denoise:features.")
        .value("AUTO", DenoiseFeatures::kAuto)
        .value("NONE", DenoiseFeatures::kNone)
        .value("FIRST_HIT", DenoiseFeatures::kFirstHit)
        .value("MULTI_BOUNCE", DenoiseFeatures::kMultiBounce);
    module.def(
        "denoise_file", &denoiseFile, "path"_a, "model"_a = "",
        "features"_a = DenoiseFeatures::kAuto, "threads"_a = 0, "tile"_a = 0, "memory"_a = 1.0,
        "aovs"_a = std::vector<std::string>{},
        nb::sig("def denoise_file(path: str, model: str = '', features: DenoiseFeatures = ..., "
                "threads: int = 0, tile: int = 0, memory: float = 1.0, aovs: "
                "list[str] = []) -> tuple[Film, RenderReport]"),
        "Reconstructs from the paths of a deep product: the film, whose color is the result, and "
        "what it took. Error when it cannot.");
    module.def(
        "splat", &splatArrays, "hidden"_a, "light"_a, "weight"_a, "bias"_a,
        "presence"_a = nb::none(), "apart"_a = false, "lanes"_a = SplatLanes::kWide,
        "threads"_a = 0, "alike"_a = nb::none(), "scales"_a = nb::none(),
        nb::sig(
            "def splat(hidden: NDArray[numpy.float32], light: NDArray[numpy.float32], weight: "
            "NDArray[numpy.float32], bias: NDArray[numpy.float32], presence: "
            "NDArray[numpy.float32] | None = None, apart: bool = False, lanes: SplatLanes = ..., "
            "threads: int = 0, alike: NDArray[numpy.float32] | None = None, scales: "
            "NDArray[numpy.float32] | None = None) -> NDArray[numpy.float32]"),
        "Kernel splatting of hidden [units, channels, h, w] and light [units, lights, h, w] with "
        "weight [k k, channels] and bias [k k], and features alike [units, n, h, w] whose squared "
        "distances are taken off the logits, with scales [units, 3 or 4, h, w] the last seven or "
        "eight as guides: [lights, h, w].");
}

} // namespace mbfeat
