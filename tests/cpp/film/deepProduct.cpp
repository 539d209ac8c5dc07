#include <doctest/doctest.h>

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>

#include "film/product.h"
#include "film/records.h"
#include "film/temporaryDirectory.h"

using namespace mbfeat;

namespace {

constexpr int kCapacity = 3;

/// A film with overscan that keeps its paths; pixels have 0 to kCapacity of them.
std::unique_ptr<Film> makeDeepFilm(bool extended) {
    FilmRequest request;
    request.window = makeWindow(4, 16);
    request.window.data = {-1, -2, 6, 19};
    request.keepPathSamples = true;
    request.extendedPathSamples = extended;
    request.samplesPerPixel = kCapacity;
    auto film = std::make_unique<Film>(request);
    for (int i = 0; i < 6 * 19; ++i) {
        for (int s = 0; s < i % (kCapacity + 1); ++s) {
            film->add(-1 + i % 6, -2 + i / 6, makeRecord(10 * i + s));
        }
    }
    return film;
}

ProductSpec makeDeepProduct(const std::string& path) {
    ProductSpec product;
    product.path = path;
    product.primPath = "/Render/Paths";
    product.deep = true;
    return product;
}

/// One channel of all pixels, T[pixel][kCapacity]; also fills the counts.
template <class T>
std::vector<T> readDeep(const std::string& path, const std::string& channel, Imf::PixelType type,
                        std::vector<unsigned int>& counts) {
    Imf::DeepScanLineInputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const int width = window.max.x - window.min.x + 1;
    const auto pixels =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(window.max.y - window.min.y + 1);
    counts.assign(pixels, 0);
    std::vector<T> values(pixels * kCapacity);
    std::vector<char*> pointers(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        pointers[i] = reinterpret_cast<char*>(&values[i * kCapacity]);
    }
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(window.min.y) * width + window.min.x;
    const auto origin = [&](auto* data) {
        return reinterpret_cast<char*>(reinterpret_cast<std::intptr_t>(data) -
                                       first * static_cast<std::ptrdiff_t>(sizeof(*data)));
    };
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, origin(counts.data()), sizeof(unsigned),
                                             sizeof(unsigned) * static_cast<std::size_t>(width)));
    buffer.insert(channel,
                  Imf::DeepSlice(type, origin(pointers.data()), sizeof(char*),
                                 sizeof(char*) * static_cast<std::size_t>(width), sizeof(T)));
    file.setFrameBuffer(buffer);
    file.readPixelSampleCounts(window.min.y, window.max.y);
    file.readPixels(window.min.y, window.max.y);
    return values;
}

/// How many values of a field differ from the store.
std::size_t differences(const Film& film, const std::string& path, std::size_t field) {
    const auto& layout = film.pathSampleLayout();
    const PathSampleField& name = layout[field];
    std::vector<unsigned int> counts;
    std::vector<float> floats;
    std::vector<std::uint32_t> ints;
    if (name.isInteger) {
        ints = readDeep<std::uint32_t>(path, name.name, Imf::UINT, counts);
    } else {
        floats = readDeep<float>(path, name.name, Imf::FLOAT, counts);
    }
    std::size_t wrong = 0;
    for (std::size_t pixel = 0; pixel < counts.size(); ++pixel) {
        const auto expected = static_cast<unsigned int>(pixel % (kCapacity + 1));
        wrong += counts[pixel] != expected ? 1 : 0;
        for (std::size_t s = 0; s < counts[pixel]; ++s) {
            const std::size_t i = pixel * kCapacity + s;
            const float kept = film.pathSamples()[i * layout.size() + field];
            const float read = name.isInteger ? static_cast<float>(ints[i]) : floats[i];
            wrong += kept != read ? 1 : 0;
        }
    }
    return wrong;
}

} // namespace

TEST_CASE("a deep file read back equals the store, path by path") {
    const TemporaryDirectory directory;
    for (const bool extended : {false, true}) {
        const auto film = makeDeepFilm(extended);
        for (const char* compression : {"zips", "rle", "none", "zip"}) {
            CAPTURE(compression);
            ProductSpec product = makeDeepProduct(directory.file("paths.exr"));
            product.compression = compression;
            CHECK(validateProduct(product).empty());
            REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
            CHECK(checkProductFile(product.path).empty());
            for (std::size_t f = 0; f < film->pathSampleLayout().size(); ++f) {
                CAPTURE(film->pathSampleLayout()[f].name);
                CHECK(differences(*film, product.path, f) == 0);
            }
        }
    }
}

TEST_CASE("with equal weights the mean of a pixel's deep samples is color") {
    const auto film = makeDeepFilm(false);
    const std::size_t fields = film->pathSampleLayout().size();
    const std::size_t pixel = 3 * 6 + 5; // three samples
    const float* const samples = film->pathSamples() + pixel * kCapacity * fields;
    const double mean =
        (static_cast<double>(samples[0]) + samples[fields] + samples[2 * fields]) / 3;
    CHECK(valueOf(*film, "color", 5, 3)[0] == static_cast<float>(mean));
}

TEST_CASE("the layout of a deep file") {
    const TemporaryDirectory directory;
    const auto film = makeDeepFilm(true);
    ProductSpec product = makeDeepProduct(directory.file("paths.exr"));
    product.layers = {{"mbfeat:event:0", "mbfeat:event:0"}};
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    const auto read = describeProductFile(product.path);
    REQUIRE(read);
    const AovLayout wanted = describeProduct(product);
    CHECK(read.value().deep);
    CHECK(read.value().compression == "zips");
    CHECK(wanted.compression == "zips");
    CHECK(wanted.bytes() == 98 * 4);
    CHECK(read.value().bytes() == wanted.bytes());
    REQUIRE(read.value().layers.size() == wanted.layers.size());
    for (std::size_t i = 0; i < wanted.layers.size(); ++i) {
        CAPTURE(wanted.layers[i].layer);
        CHECK(read.value().layers[i].layer == wanted.layers[i].layer);
        CHECK(read.value().layers[i].aov == wanted.layers[i].aov);
        CHECK(read.value().layers[i].type == wanted.layers[i].type);
        CHECK(read.value().layers[i].channels == wanted.layers[i].channels);
        CHECK(read.value().layers[i].doc == wanted.layers[i].doc);
    }
    CHECK(wanted.layers[0].channels == std::vector<std::string>{"R", "G", "B", "A", "Z"});
    CHECK(wanted.layers[1].layer == "subpixel");
    CHECK(wanted.layers[2].type == "uint");
    CHECK(read.value().window.data.x == -1);
    CHECK(read.value().window.data.height == 19);
}

TEST_CASE("deep products that cannot be made are errors") {
    const TemporaryDirectory directory;
    ProductSpec product = makeDeepProduct(directory.file("paths.exr"));
    product.compression = "piz";
    REQUIRE(validateProduct(product).size() == 1);
    CHECK(validateProduct(product)[0].text.find("piz") != std::string::npos);

    FilmRequest request;
    request.window = makeWindow(2, 2);
    const Film film(request);
    const Status status =
        writeProduct(makeDeepProduct(directory.file("paths.exr")), film, RenderReport());
    REQUIRE(status);
    CHECK(status->text.find("did not keep its paths") != std::string::npos);
    CHECK(directory.fileCount() == 0);
}
