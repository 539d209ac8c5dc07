#include "film/imageWriter.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <vector>

#include <doctest/doctest.h>

#include "scene/imageDecoder.h"

using namespace mbfeat;

namespace {

/// A folder that is gone after the test.
class ScratchFolder {
public:
    ScratchFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "mbfeat-XXXXXX").string();
        REQUIRE(mkdtemp(name.data()) != nullptr);
        path_ = name;
    }
    ~ScratchFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    std::string file(const std::string& name) const { return path_ / name; }
    std::size_t entries() const {
        const std::filesystem::directory_iterator first(path_);
        return static_cast<std::size_t>(std::distance(first, {}));
    }

private:
    std::filesystem::path path_;
};

} // namespace

TEST_CASE("eight-bit images are clamped, rounded and stored from the top") {
    const ScratchFolder folder;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    // Two rows of one RGBA pixel; the second row is the lower one.
    const std::vector<float> values = {0.5F, -1.0F, 2.0F, 1.0F, nan, 1.0F / 255.0F, 0.1F, 0.25F};
    const std::string path = folder.file("image.PNG");
    CHECK_FALSE(writeImageFile(path, 1, 2, 4, values.data()));
    const Result<DecodedImage> read = decodeImage(path);
    REQUIRE(read);
    const DecodedImage& image = read.value();
    REQUIRE(image.width == 1);
    REQUIRE(image.height == 2);
    REQUIRE(image.channels == 4);
    CHECK(image.data == std::vector<std::uint8_t>{0, 1, 26, 64, 128, 0, 255, 255});
    CHECK(folder.entries() == 1); // no partial file is left
}

TEST_CASE("formats without alpha drop it, and HDR keeps values above one") {
    const ScratchFolder folder;
    std::vector<float> values;
    for (int i = 0; i < 16 * 16; ++i) {
        values.insert(values.end(), {4.0F, 0.5F, 0.25F, 0.75F});
    }
    for (const char* const name : {"a.jpg", "a.jpeg", "a.bmp", "a.hdr"}) {
        CAPTURE(name);
        CHECK_FALSE(writeImageFile(folder.file(name), 16, 16, 4, values.data()));
        const Result<DecodedImage> read = decodeImage(folder.file(name));
        REQUIRE(read);
        CHECK(read.value().channels == 3);
        CHECK(read.value().width == 16);
    }
    CHECK_FALSE(writeImageFile(folder.file("a.tga"), 16, 16, 4, values.data()));
    const Result<DecodedImage> tga = decodeImage(folder.file("a.tga"));
    REQUIRE(tga);
    CHECK(tga.value().channels == 4);
}

TEST_CASE("what cannot be written is an error that names the file and leaves nothing") {
    const ScratchFolder folder;
    const std::vector<float> values(4, 0.5F);
    for (const std::string& path : {folder.file("image.webp"), folder.file("image"),
                                    folder.file("none/image.png"), folder.file("dir.ext/image")}) {
        CAPTURE(path);
        const Status status = writeImageFile(path, 1, 1, 4, values.data());
        REQUIRE(status);
        CHECK(status->subject == path);
    }
    REQUIRE(std::filesystem::create_directory(folder.file("folder.png")));
    CHECK(writeImageFile(folder.file("folder.png"), 1, 1, 4, values.data()));
    CHECK(writeImageFile(folder.file("empty.png"), 0, 1, 4, values.data()));
    CHECK(folder.entries() == 1);
}
