#include "film/product.h"

#include <doctest/doctest.h>
#include <sys/resource.h>

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>

#include "film/records.h"
#include "film/temporaryDirectory.h"

using namespace mbfeat;

namespace {

/// A film in which every pixel has other values, two samples each but for an empty last pixel.
std::unique_ptr<Film> makeFilm(const ImageWindow& window, const std::vector<std::string>& aovs) {
    FilmRequest request;
    request.window = window;
    request.aovs = aovs;
    auto film = std::make_unique<Film>(request);
    const PixelRect& data = window.data;
    for (int i = 0; i + 1 < data.width * data.height; ++i) {
        film->add(data.x + i % data.width, data.y + i / data.width, makeRecord(i));
        film->add(data.x + i % data.width, data.y + i / data.width, makeRecord(i + 2));
    }
    return film;
}

ProductSpec makeProduct(const std::string& path, const std::vector<std::string>& aovs) {
    ProductSpec product;
    product.path = path;
    product.primPath = "/Render/Product";
    for (const std::string& aov : aovs) {
        product.layers.push_back({aov, aov, PixelType::kFloat});
    }
    return product;
}

std::vector<std::string> channelsOf(const Imf::Header& header) {
    std::vector<std::string> names;
    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
        names.emplace_back(channel.name());
    }
    return names;
}

/// The pixels of a channel as the type that holds them exactly.
template <class T>
std::vector<T> readChannel(Imf::MultiPartInputFile& file, int part, const std::string& channel,
                           Imf::PixelType type) {
    const Imath::Box2i window = file.header(part).dataWindow();
    const int width = window.max.x - window.min.x + 1;
    const int height = window.max.y - window.min.y + 1;
    std::vector<T> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    Imf::FrameBuffer buffer;
    buffer.insert(channel, Imf::Slice::Make(type, pixels.data(), window));
    Imf::InputPart input(file, part);
    input.setFrameBuffer(buffer);
    input.readPixels(window.min.y, window.max.y);
    return pixels;
}

std::string textAttribute(const Imf::Header& header, const std::string& name) {
    const auto* const attribute = header.findTypedAttribute<Imf::StringAttribute>(name);
    return attribute != nullptr ? attribute->value() : "(missing)";
}

/// Every channel of every layer of the file against the film.
void checkPixels(const ProductSpec& product, const Film& film) {
    Imf::MultiPartInputFile file(product.path.c_str());
    const AovLayout layout = describeProduct(product);
    const auto pixels = static_cast<std::size_t>(film.window().data.width) *
                        static_cast<std::size_t>(film.window().data.height);
    for (const AovLayoutEntry& layer : layout.layers) {
        const int index = film.findBound(layer.aov);
        const std::size_t width = layer.channels.size();
        std::vector<float> floats(pixels * width);
        std::vector<std::int32_t> ints(pixels * width);
        film.resolve(index, floats.data());
        film.resolveInt(index, ints.data());
        for (std::size_t c = 0; c < width; ++c) {
            CAPTURE(layer.channels[c]);
            const Imf::Channel* const channel =
                file.header(layer.part).channels().findChannel(layer.channels[c]);
            REQUIRE(channel != nullptr);
            std::size_t wrong = 0;
            if (layer.type == "uint") {
                CHECK(channel->type == Imf::UINT);
                const auto read =
                    readChannel<std::uint32_t>(file, layer.part, layer.channels[c], Imf::UINT);
                for (std::size_t i = 0; i < pixels; ++i) {
                    wrong += read[i] != static_cast<std::uint32_t>(ints[i * width + c]) ? 1 : 0;
                }
            } else {
                CHECK(channel->type == (layer.type == "half" ? Imf::HALF : Imf::FLOAT));
                const auto read =
                    readChannel<float>(file, layer.part, layer.channels[c], Imf::FLOAT);
                for (std::size_t i = 0; i < pixels; ++i) {
                    const float value = floats[i * width + c];
                    const float stored =
                        layer.type == "half" ? static_cast<float>(half(value)) : value;
                    wrong += read[i] != stored ? 1 : 0;
                }
            }
            CHECK(wrong == 0);
        }
    }
}

std::string readAll(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

} // namespace

TEST_CASE("all AOVs in one file: names, types, windows and exact values") {
    const TemporaryDirectory directory;
    ImageWindow window = makeWindow(6, 5);
    window.data = {-2, -1, 9, 8}; // overscan, and an odd size
    window.pixelAspectRatio = 2.0F;
    const auto film = makeFilm(window, allAovs());
    const ProductSpec product = makeProduct(directory.file("all.exr"), allAovs());
    CHECK(validateProduct(product).empty());
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    checkPixels(product, *film);
    CHECK(directory.fileCount() == 1);

    const Imf::MultiPartInputFile file(product.path.c_str());
    CHECK(file.parts() == 1);
    const Imf::Header& header = file.header(0);
    CHECK(header.displayWindow() == Imath::Box2i({0, 0}, {5, 4}));
    CHECK(header.dataWindow() == Imath::Box2i({-2, -1}, {6, 6}));
    CHECK(header.pixelAspectRatio() == 2.0F);
    CHECK(header.compression() == Imf::ZIP_COMPRESSION);
    const auto channels = channelsOf(header);
    CHECK(std::count(channels.begin(), channels.end(), "R") == 1);
    CHECK(std::count(channels.begin(), channels.end(), "mbfeat:normal:5.Z") == 1);
    CHECK(std::count(channels.begin(), channels.end(), "primvars:st.X") == 1);
    std::size_t expected = 0;
    for (const AovDescriptor& aov : film->aovs()) {
        expected += static_cast<std::size_t>(aov.width());
    }
    CHECK(channels.size() == expected);
    CHECK(textAttribute(header, "mbfeat:signedIntegers").find("0xFFFFFFFF") != std::string::npos);
    CHECK(textAttribute(header, "mbfeat:halfOverflow") == "(missing)");
}

TEST_CASE("the background of ids is 0xFFFFFFFF") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(2, 1), {"primId"});
    const ProductSpec product = makeProduct(directory.file("ids.exr"), {"primId"});
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    Imf::MultiPartInputFile file(product.path.c_str());
    CHECK(readChannel<std::uint32_t>(file, 0, "primId.Y", Imf::UINT) ==
          std::vector<std::uint32_t>{100U, 0xFFFFFFFFU});
}

TEST_CASE("a crop window smaller than the image") {
    const TemporaryDirectory directory;
    ImageWindow window = makeWindow(100, 300);
    window.data = {17, 33, 3, 201}; // more rows than are written at once
    const auto film = makeFilm(window, {"depth", "mbfeat:direct:2"});
    for (const char* compression : {"none", "rle", "zips", "zip", "piz"}) {
        CAPTURE(compression);
        ProductSpec product =
            makeProduct(directory.file("crop.exr"), {"color", "depth", "mbfeat:direct:2"});
        product.compression = compression;
        REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
        checkPixels(product, *film);
        CHECK(describeProductFile(product.path).value().compression == compression);
    }
    for (const char* compression : {"pxr24", "b44", "b44a", "dwaa", "dwab"}) {
        CAPTURE(compression);
        ProductSpec product = makeProduct(directory.file("lossy.exr"), {"color"});
        product.compression = compression;
        CHECK(validateProduct(product).empty());
        REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
        CHECK(describeProductFile(product.path).value().compression == compression);
    }
}

TEST_CASE("a multi-part file has one part a layer with the same channel names") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(5, 70), {"primId", "mbfeat:albedo:1"});
    ProductSpec product =
        makeProduct(directory.file("parts.exr"), {"color", "primId", "mbfeat:albedo:1"});
    product.layers[2].layer = "second";
    product.layers[2].pixelType = PixelType::kHalf;
    product.multiPart = true;
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    checkPixels(product, *film);
    const Imf::MultiPartInputFile file(product.path.c_str());
    REQUIRE(file.parts() == 3);
    CHECK(file.header(0).name() == "color");
    CHECK(file.header(1).name() == "primId");
    CHECK(file.header(2).name() == "second");
    CHECK(channelsOf(file.header(2)) ==
          std::vector<std::string>{"second.B", "second.G", "second.R"});
    CHECK(textAttribute(file.header(2), "mbfeat:aov:second") == "mbfeat:albedo:1");
    CHECK(checkProductFile(product.path).empty());
}

TEST_CASE("halves that overflow are clamped, counted in the header and reported") {
    const TemporaryDirectory directory;
    FilmRequest request;
    request.window = makeWindow(3, 1);
    Film film(request);
    PathRecord record;
    record.radiance = {1e6F, 65504.0F, -1e30F};
    film.add(0, 0, record);
    record.radiance = {1.0F, std::numeric_limits<float>::infinity(), 0.1F};
    film.add(1, 0, record);
    ProductSpec product = makeProduct(directory.file("half.exr"), {"color"});
    product.layers[0].pixelType = PixelType::kHalf;
    Diagnostics diagnostics;
    REQUIRE_FALSE(writeProduct(product, film, RenderReport(), &diagnostics));
    Imf::MultiPartInputFile file(product.path.c_str());
    CHECK(readChannel<float>(file, 0, "R", Imf::FLOAT) == std::vector<float>{65504.0F, 1.0F, 0.0F});
    CHECK(readChannel<float>(file, 0, "G", Imf::FLOAT) ==
          std::vector<float>{65504.0F, 65504.0F, 0.0F});
    CHECK(readChannel<float>(file, 0, "B", Imf::FLOAT)[0] == -65504.0F);
    CHECK(textAttribute(file.header(0), "mbfeat:halfOverflow").substr(0, 2) == "3 ");
    REQUIRE(diagnostics.messages().size() == 1);
    CHECK(diagnostics.messages()[0].subject == "/Render/Product");
    CHECK(diagnostics.messages()[0].text.find("3 values") != std::string::npos);
}

TEST_CASE("header attributes: the report's, standard ones with their types, others as text") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(2, 2), {});
    ProductSpec product = makeProduct(directory.file("header.exr"), {"color"});
    product.attributes = {
        {"artist", "Ada"},
        {"comment", "caf\xC3\xA9 \xFF"},
        {"focus", "2.5"},
        {"aperture", "wide"},
        {"chromaticities", "(0.64, 0.33) (0.3, 0.6) (0.15, 0.06) (0.3127, 0.329)"},
        {"dataWindow", "0 0 1 1"},
        {"mbfeat:version", "forged"},
        {"isoSpeed", "nan"},
        {"", "no name"},
        {std::string(300, 'n'), "long"},
        {"shot", "010"}};
    RenderReport report;
    report.version = "1.2.3";
    report.samplesPerPixel = 16;
    report.trace.nonFinite = 3;
    report.seconds = {{"sampling", 1.5}, {"write", std::nan("")}};
    report.census.present = {"textures", "environment"};
    report.settings = {{"mbfeat:seed", std::int64_t{7}, SettingSource::kCommandLine}};
    REQUIRE_FALSE(writeProduct(product, *film, report));
    const Imf::MultiPartInputFile file(product.path.c_str());
    const Imf::Header& header = file.header(0);
    CHECK(Imf::owner(header) == "Ada");
    CHECK(Imf::comments(header) == "caf\xC3\xA9 \xEF\xBF\xBD");
    CHECK(Imf::focus(header) == 2.5F);
    CHECK(Imf::chromaticities(header).green.y == 0.6F);
    CHECK(textAttribute(header, "product:aperture") == "wide");
    CHECK(textAttribute(header, "product:isoSpeed") == "nan");
    CHECK(textAttribute(header, "product:dataWindow") == "0 0 1 1");
    CHECK(textAttribute(header, "product:mbfeat:version") == "forged");
    CHECK(textAttribute(header, "shot") == "010");
    CHECK(textAttribute(header, std::string(255, 'n')) == "long");
    CHECK(textAttribute(header, "mbfeat:version") == "1.2.3");
    CHECK(textAttribute(header, "mbfeat:seed") == "7");
    CHECK(textAttribute(header, "mbfeat:setting:seed") == "7 (command line)");
    CHECK(textAttribute(header, "mbfeat:samplesPerPixel") == "16");
    CHECK(textAttribute(header, "mbfeat:nonFiniteSamples") == "3");
    CHECK(textAttribute(header, "mbfeat:effects") == "textures, environment");
    for (auto attribute = header.begin(); attribute != header.end(); ++attribute) {
        if (const auto* const number =
                dynamic_cast<const Imf::FloatAttribute*>(&attribute.attribute())) {
            CAPTURE(attribute.name());
            CHECK(std::isfinite(number->value()));
        }
    }
}

TEST_CASE("two layers or channels of one name are errors, not drops") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(2, 2), {"depth", "mbfeat:albedo:0", "cameraDepth"});
    const auto errorOf = [&](const std::vector<ProductLayer>& layers) {
        ProductSpec product = makeProduct(directory.file("twice.exr"), {});
        product.layers = layers;
        const auto errors = validateProduct(product);
        REQUIRE(errors.size() == 1);
        CHECK(errors[0].subject == "/Render/Product");
        CHECK(errors[0].text.find("twice.exr") != std::string::npos);
        const Status status = writeProduct(product, *film, RenderReport());
        REQUIRE(status);
        CHECK(directory.fileCount() == 0);
        return errors[0].text;
    };
    CHECK(errorOf({{"depth", "z"}, {"cameraDepth", "z"}}).find("'z'") != std::string::npos);
    CHECK(errorOf({{"color", ""}, {"mbfeat:albedo:0", "color"}}).find("two layers") !=
          std::string::npos);
    CHECK(errorOf({}).find("no layers") != std::string::npos);
    CHECK(errorOf({{"color", "bad\nname"}}).find("control characters") != std::string::npos);
}

TEST_CASE("an unknown AOV costs its layer, with the nearest name, and not the file") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(2, 2), {});
    const ProductSpec product =
        makeProduct(directory.file("unknown.exr"), {"color", "mbfeat:albdo:2"});
    const auto errors = validateProduct(product);
    REQUIRE(errors.size() == 1);
    CHECK(errors[0].text.find("'mbfeat:albedo:2'") != std::string::npos);
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    checkPixels(product, *film);
}

TEST_CASE("paths that cannot be written are errors that name file and prim") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(2, 2), {});
    std::ofstream(directory.file("plain.txt")) << "text";
    std::filesystem::create_directory(directory.file("folder.exr"));
    for (const std::string& path :
         {std::string(), directory.file("missing/image.exr"), directory.file("image.png"),
          directory.file("plain.txt/image.exr"), directory.file("folder.exr")}) {
        CAPTURE(path);
        const ProductSpec product = makeProduct(path, {"color"});
        REQUIRE(validateProduct(product).size() == 1);
        const Status status = writeProduct(product, *film, RenderReport());
        REQUIRE(status);
        CHECK(status->subject == "/Render/Product");
        CHECK(status->text.find("'" + path + "'") != std::string::npos);
    }
    ProductSpec product = makeProduct(directory.file("image.exr"), {"color"});
    product.compression = "lzma";
    REQUIRE(validateProduct(product).size() == 1);
    CHECK(validateProduct(product)[0].text.find("lzma") != std::string::npos);
    product = makeProduct(directory.file("image.exr"), {"depth"});
    CHECK(validateProduct(product).empty());
    CHECK(writeProduct(product, *film, RenderReport())->text.find("did not record") !=
          std::string::npos);
    CHECK(directory.fileCount() == 2);
}

TEST_CASE("a write that fails keeps the old file and leaves nothing behind") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(64, 64), {});
    const ProductSpec product = makeProduct(directory.file("image.exr"), {"color"});
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    const std::string before = readAll(product.path);
    REQUIRE(before.size() > 100);

    // A limit on the size of files makes writing fail half-way, as a full disk does.
    struct Limit {
        rlimit old{};
        Limit() {
            getrlimit(RLIMIT_FSIZE, &old);
            signal(SIGXFSZ, SIG_IGN);
            const rlimit small{4096, old.rlim_max};
            setrlimit(RLIMIT_FSIZE, &small);
        }
        ~Limit() { setrlimit(RLIMIT_FSIZE, &old); }
    };
    ProductSpec large = product;
    large.compression = "none";
    Status status;
    {
        const Limit limit;
        status = writeProduct(large, *film, RenderReport());
    }
    REQUIRE(status);
    CHECK(status->text.find("File too large") != std::string::npos);
    CHECK(readAll(product.path) == before);
    CHECK(directory.fileCount() == 1);
    REQUIRE_FALSE(writeProduct(large, *film, RenderReport()));
    checkPixels(large, *film);
}

TEST_CASE("a symbolic link stays and its target is replaced") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(2, 2), {});
    std::filesystem::create_directory(directory.file("store"));
    std::ofstream(directory.file("store/real.exr")) << "old";
    std::filesystem::create_symlink("store/real.exr", directory.file("link.exr"));
    const ProductSpec product = makeProduct(directory.file("link.exr"), {"color"});
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    CHECK(std::filesystem::is_symlink(product.path));
    CHECK(describeProductFile(directory.file("store/real.exr")));
}

TEST_CASE("the layout of a written file is the product's") {
    const TemporaryDirectory directory;
    const auto film = makeFilm(makeWindow(3, 2), allAovs());
    ProductSpec product = makeProduct(directory.file("layout.exr"), allAovs());
    for (ProductLayer& layer : product.layers) {
        layer.pixelType = PixelType::kHalf;
    }
    product.layers[5].layer = "eye.normal"; // a name that only the header can resolve
    REQUIRE_FALSE(writeProduct(product, *film, RenderReport()));
    const auto read = describeProductFile(product.path);
    REQUIRE(read);
    const AovLayout wanted = describeProduct(product);
    CHECK(read.value().isOwn());
    CHECK(read.value().window.width == 3);
    CHECK(read.value().bytes() == wanted.bytes());
    REQUIRE(read.value().layers.size() == wanted.layers.size());
    for (std::size_t i = 0; i < wanted.layers.size(); ++i) {
        const AovLayoutEntry& a = read.value().layers[i];
        const AovLayoutEntry& b = wanted.layers[i];
        CAPTURE(b.aov);
        CHECK(a.aov == b.aov);
        CHECK(a.layer == b.layer);
        CHECK(a.type == b.type);
        CHECK(a.vertex == b.vertex);
        CHECK(a.channels == b.channels);
        CHECK(a.doc == b.doc);
        CHECK(a.bytes == b.bytes);
    }
    CHECK(checkProductFile(product.path).empty());
}

TEST_CASE("files that are not as the table says are told apart") {
    const TemporaryDirectory directory;
    std::ofstream(directory.file("broken.exr")) << "not an image";
    CHECK(checkProductFile(directory.file("broken.exr")).size() == 1);
    CHECK(checkProductFile(directory.file("absent.exr")).size() == 1);
    CHECK_FALSE(describeProductFile(directory.file("absent.exr")));

    // Foreign: an id in halves, a depth under a name of its own, no mark of ours.
    Imf::Header header(2, 2);
    header.channels().insert("primId.Y", Imf::Channel(Imf::HALF));
    header.channels().insert("somebody.Q", Imf::Channel(Imf::FLOAT));
    header.setType(Imf::SCANLINEIMAGE);
    const std::string path = directory.file("foreign.exr");
    { const Imf::MultiPartOutputFile file(path.c_str(), &header, 1); }
    REQUIRE(describeProductFile(path));
    CHECK_FALSE(describeProductFile(path).value().isOwn());
    const auto differences = checkProductFile(path);
    REQUIRE(differences.size() == 3);
    CHECK(differences[0].find("mbfeat:version") != std::string::npos);
    CHECK(differences[1].find("half instead of uint") != std::string::npos);
    CHECK(differences[2].find("somebody") != std::string::npos);
}
