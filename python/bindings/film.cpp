// Films: AOVs as arrays, and kept paths without a copy.
#include "film/film.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "bindings.h"

namespace mbfeat {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

// Kept paths of a film made in Python, bytes. Films of renders obey mbfeat:pathSampleMemory.
constexpr std::size_t kPathSampleLimit = std::size_t{4} << 30U;

using PathArray = nb::ndarray<nb::numpy, const float, nb::ndim<4>>;

int boundIndex(const Film& film, const std::string& name) {
    const int index = film.findBound(name);
    if (index < 0) {
        std::string bound;
        for (const AovDescriptor& aov : film.aovs()) {
            bound += (bound.empty() ? "" : ", ") + aov.name;
        }
        throw BindingError({name, "the film does not hold this AOV; it holds " + bound});
    }
    return index;
}

nb::object resolve(const FilmHandle& handle, const std::string& name) {
    const Film& film = *handle.film;
    const int index = boundIndex(film, name);
    const AovDescriptor& aov = film.aovs()[static_cast<std::size_t>(index)];
    const auto height = static_cast<std::size_t>(film.window().data.height);
    const auto width = static_cast<std::size_t>(film.window().data.width);
    const auto channels = static_cast<std::size_t>(aov.width());
    if (aov.type == AovType::kInt) {
        std::vector<std::int32_t> values(height * width * channels);
        {
            const nb::gil_scoped_release release;
            film.resolveInt(index, values.data());
        }
        return nb::cast(ownedArray(std::move(values), {height, width, channels}));
    }
    std::vector<float> values(height * width * channels);
    {
        const nb::gil_scoped_release release;
        film.resolve(index, values.data());
    }
    return nb::cast(ownedArray(std::move(values), {height, width, channels}));
}

nb::object pathSamples(const FilmHandle& handle) {
    const Film& film = *handle.film;
    if (film.pathSamples() == nullptr) {
        return nb::none();
    }
    // The capsule holds a reference to the film: the array may outlive every other one.
    auto reference = std::make_unique<std::shared_ptr<const Film>>(handle.film);
    nb::capsule owner(reference.get(), [](void* p) noexcept {
        const std::unique_ptr<std::shared_ptr<const Film>> freed(
            static_cast<std::shared_ptr<const Film>*>(p));
    });
    reference.release(); // NOLINT(bugprone-unused-return-value): the capsule owns it now
    return nb::cast(PathArray(film.pathSamples(),
                              {static_cast<std::size_t>(film.window().data.height),
                               static_cast<std::size_t>(film.window().data.width),
                               static_cast<std::size_t>(film.pathSampleCapacity()),
                               film.pathSampleLayout().size()},
                              owner));
}

nb::object sampleCounts(const FilmHandle& handle) {
    const PixelRect& data = handle.film->window().data;
    const auto width = static_cast<std::size_t>(data.width);
    const auto height = static_cast<std::size_t>(data.height);
    std::vector<std::int32_t> counts(width * height);
    for (int y = 0; y < data.height; ++y) {
        for (int x = 0; x < data.width; ++x) {
            counts[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
                static_cast<std::int32_t>(handle.film->sampleCount(data.x + x, data.y + y));
        }
    }
    return nb::cast(ownedArray(std::move(counts), {height, width}));
}

OwnFilm makeFilm(int width, int height, const std::vector<std::string>& aovs, bool keepPathSamples,
                 bool extended, int samplesPerPixel) {
    FilmRequest request;
    request.window.width = width;
    request.window.height = height;
    request.window.data = {0, 0, width, height};
    request.aovs = aovs;
    request.keepPathSamples = keepPathSamples;
    request.extendedPathSamples = extended;
    request.samplesPerPixel = samplesPerPixel;
    OwnFilm own;
    own.writable = unwrap(Film::create(request, kPathSampleLimit));
    own.film = own.writable;
    return own;
}

void addSample(OwnFilm& own, int x, int y, const PathRecord& record) {
    const PixelRect& data = own.film->window().data;
    if (x < data.x || y < data.y || x >= data.x + data.width || y >= data.y + data.height) {
        throw BindingError({"pixel (" + std::to_string(x) + ", " + std::to_string(y) + ")",
                            "it lies outside the film's data window"});
    }
    own.writable->add(x, y, record);
}

/// A float3 of the record as a Python tuple, both ways.
template <Float3 PathRecord::*member>
void bindFloat3(nb::class_<PathRecord>& record, const char* name) {
    record.def_prop_rw(
        name,
        [](const PathRecord& r) {
            const Float3& v = r.*member;
            return nb::make_tuple(v.x, v.y, v.z);
        },
        [](PathRecord& r, const nb::tuple& v) {
            r.*member = Float3(nb::cast<float>(v[0]), nb::cast<float>(v[1]), nb::cast<float>(v[2]));
        });
}

void bindRecord(nb::module_& module) {
    nb::class_<PathRecord> record(module, "PathRecord", "What one light path met on its way.");
    record.def(nb::init<>())
        .def_rw("alpha", &PathRecord::alpha)
        .def_rw("filter_weight", &PathRecord::filterWeight)
        .def_rw("vertex_count", &PathRecord::vertexCount)
        .def_rw("prim_id", &PathRecord::primId)
        .def_rw("instance_id", &PathRecord::instanceId)
        .def_rw("element_id", &PathRecord::elementId)
        .def_rw("depth", &PathRecord::depth)
        .def_rw("camera_depth", &PathRecord::cameraDepth)
        .def_rw("distance", &PathRecord::distance)
        .def_rw("non_finite", &PathRecord::nonFinite)
        .def_prop_rw(
            "subpixel",
            [](const PathRecord& r) { return nb::make_tuple(r.subpixel.x, r.subpixel.y); },
            [](PathRecord& r, const nb::tuple& v) {
                r.subpixel = Float2(nb::cast<float>(v[0]), nb::cast<float>(v[1]));
            })
        .def(
            "set_features",
            [](PathRecord& r, int vertex, const std::vector<float>& values) {
                if (vertex < 0 || vertex >= kFeatureVertices || values.size() != 9) {
                    throw BindingError({"vertex " + std::to_string(vertex),
                                        "vertices are 0..5 and have nine values"});
                }
                const auto at = [&](std::size_t i) {
                    return Float3(values[i], values[i + 1], values[i + 2]);
                };
                r.features[vertex] = {at(0), at(3), at(6)};
            },
            "vertex"_a, "values"_a, "Sets albedo, normal and direct of a vertex, nine values.");
    bindFloat3<&PathRecord::radiance>(record, "radiance");
    bindFloat3<&PathRecord::normal>(record, "normal");
    bindFloat3<&PathRecord::emission>(record, "emission");
    bindFloat3<&PathRecord::tail>(record, "tail");
}

} // namespace

void bindFilm(nb::module_& module) {
    bindRecord(module);
    nb::class_<FilmHandle>(module, "Film", "A film: what samples added up to, per pixel and AOV.")
        .def_prop_ro(
            "resolution",
            [](const FilmHandle& h) {
                return nb::make_tuple(h.film->window().width, h.film->window().height);
            },
            nb::sig("def resolution(self) -> tuple[int, int]"),
            "Width and height of the display window, pixels.")
        .def_prop_ro(
            "data_window",
            [](const FilmHandle& h) {
                const PixelRect& r = h.film->window().data;
                return nb::make_tuple(r.x, r.y, r.width, r.height);
            },
            nb::sig("def data_window(self) -> tuple[int, int, int, int]"),
            "x, y, width and height of what was rendered, display-window pixels.")
        .def_prop_ro("pixel_aspect_ratio",
                     [](const FilmHandle& h) { return h.film->window().pixelAspectRatio; })
        .def_prop_ro("aovs", [](const FilmHandle& h) { return h.film->aovs(); })
        .def_prop_ro("bytes", [](const FilmHandle& h) { return h.film->bytes(); })
        .def("resolve", &resolve, "aov"_a,
             nb::sig("def resolve(self, aov: str) -> NDArray[numpy.float32 | numpy.int32]"),
             "The AOV's values as a new array [height, width, channels], float32, or int32 for "
             "ids; row 0 is the top. Error when the film does not hold it.")
        .def_prop_ro("sample_counts", &sampleCounts,
                     nb::sig("def sample_counts(self) -> NDArray[numpy.int32]"),
                     "int32 [height, width]")
        .def_prop_ro("path_samples", &pathSamples,
                     nb::sig("def path_samples(self) -> NDArray[numpy.float32] | None"),
                     "Kept paths, float32 [height, width, samples, fields], or None. It is the "
                     "film's own memory, read-only, and keeps the film alive.")
        .def_prop_ro("path_sample_layout",
                     [](const FilmHandle& h) { return h.film->pathSampleLayout(); });

    nb::class_<OwnFilm, FilmHandle>(module, "OwnFilm", "A film to add samples to.")
        .def("add", &addSample, "x"_a, "y"_a, "record"_a)
        .def("clear", [](OwnFilm& own) { own.writable->clear(); });
    module.def(
        "make_film", &makeFilm, "width"_a, "height"_a, "aovs"_a = std::vector<std::string>(),
        "keep_path_samples"_a = false, "extended"_a = false, "samples_per_pixel"_a = 0,
        "An empty film; Error for an empty window, names that are no AOVs or given twice, and "
        "for more kept paths than 4 GiB.");
}

} // namespace mbfeat
