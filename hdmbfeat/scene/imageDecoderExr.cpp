// OpenEXR images: the first flat part, in the display window, bottom row first.
#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <optional>

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfRgbaFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include "scene/colorManagement.h"
#include "scene/imageDecoder.h"

namespace mbfeat {

namespace {

/// Channels of the file for each channel of the image; "" is filled with zero.
struct ChannelChoice {
    std::vector<std::string> names;
    std::string note;
    bool luminanceChroma = false; ///< Y with RY and BY: the library converts to RGB
};

/// The layers of a part, the unnamed one ("") included, in file order.
std::vector<std::string> layersOf(const Imf::ChannelList& channels) {
    std::vector<std::string> layers;
    for (auto it = channels.begin(); it != channels.end(); ++it) {
        const std::string name = it.name();
        const std::size_t dot = name.rfind('.');
        std::string layer = dot == std::string::npos ? std::string() : name.substr(0, dot + 1);
        if (std::find(layers.begin(), layers.end(), layer) == layers.end()) {
            layers.push_back(std::move(layer));
        }
    }
    return layers;
}

/// The colour channels of one layer: RGB(A), Y(A) or A; none when it has no such channels.
std::vector<std::string> colorChannels(const Imf::ChannelList& channels, const std::string& layer) {
    const auto find = [&](const char* upper, const char* lower) {
        for (const char* name : {upper, lower}) {
            if (channels.findChannel(layer + name) != nullptr) {
                return layer + name;
            }
        }
        return std::string();
    };
    const std::string r = find("R", "r");
    const std::string g = find("G", "g");
    const std::string b = find("B", "b");
    const std::string y = find("Y", "y");
    const std::string a = find("A", "a");
    std::vector<std::string> names;
    if (!g.empty() || !b.empty()) {
        names = {r, g, b};
    } else if (!r.empty() || !y.empty()) {
        names = {r.empty() ? y : r};
    } else if (!a.empty()) {
        return {a};
    }
    if (!names.empty() && !a.empty()) {
        names.push_back(a);
    }
    return names;
}

/// Names that layers of beauty images have.
bool isBeautyLayer(const std::string& layer) {
    for (const char* name : {"rgba.", "color.", "beauty.", "Combined.", "combined."}) {
        const std::size_t length = std::strlen(name);
        if (layer.size() >= length && layer.compare(layer.size() - length, length, name) == 0) {
            return true;
        }
    }
    return false;
}

ChannelChoice chooseChannels(const Imf::ChannelList& channels) {
    ChannelChoice choice;
    choice.luminanceChroma = channels.findChannel("Y") != nullptr &&
                             channels.findChannel("RY") != nullptr &&
                             channels.findChannel("BY") != nullptr;
    if (choice.luminanceChroma) {
        choice.names = {"R", "G", "B"};
        if (channels.findChannel("A") != nullptr) {
            choice.names.emplace_back("A");
        }
        return choice;
    }
    choice.names = colorChannels(channels, "");
    if (!choice.names.empty()) {
        return choice;
    }
    std::vector<std::string> layers = layersOf(channels);
    std::stable_partition(layers.begin(), layers.end(), isBeautyLayer);
    for (const std::string& layer : layers) {
        choice.names = colorChannels(channels, layer);
        if (!choice.names.empty()) {
            choice.note = "has no unnamed colour channels; its layer '" +
                          layer.substr(0, layer.size() - 1) + "' is used";
            return choice;
        }
    }
    if (channels.begin() != channels.end()) {
        choice.names = {channels.begin().name()};
        choice.note = std::string("has no colour channels; its channel '") + choice.names.front() +
                      "' is used as a grey image";
    }
    return choice;
}

/// What the header says about the colours: a name, or chromaticities of a known space.
void readColorSpace(const Imf::Header& header, DecodedImage& image) {
    for (const char* name : {"colorInteropID", "oiio:ColorSpace"}) {
        const auto* text = header.findTypedAttribute<Imf::StringAttribute>(name);
        if (text != nullptr && !text->value().empty()) {
            image.hasColorSpace = true;
            image.colorSpace = text->value();
            return;
        }
    }
    if (Imf::hasChromaticities(header)) {
        const Imf::Chromaticities& c = Imf::chromaticities(header);
        image.colorSpace = ColorConfig::spaceOfChromaticities(
            {c.red.x, c.red.y, c.green.x, c.green.y, c.blue.x, c.blue.y, c.white.x, c.white.y});
        image.hasColorSpace = !image.colorSpace.empty();
    }
}

/// Windows whose sizes checkImageSize() has passed.
struct Windows {
    Imath::Box2i display, data;

    static std::size_t widthOf(const Imath::Box2i& window) {
        return static_cast<std::size_t>(std::int64_t(window.max.x) - window.min.x + 1);
    }
    std::size_t width() const { return widthOf(display); }
    std::size_t dataWidth() const { return widthOf(data); }
};

/// Rows of the data window that are decoded at a time: enough for any compression's block.
constexpr int kRowsAtOnce = 256;

/// Copies rows [y0, y1] of a block in data-window layout to their place in the image.
void placeRows(const std::vector<std::uint8_t>& block, int y0, int y1, const Windows& windows,
               std::size_t texelBytes, DecodedImage& image) {
    const int x0 = std::max(windows.data.min.x, windows.display.min.x);
    const int x1 = std::min(windows.data.max.x, windows.display.max.x);
    if (x1 < x0) {
        return;
    }
    const std::size_t bytes = static_cast<std::size_t>(x1 - x0 + 1) * texelBytes;
    for (int y = std::max(y0, windows.display.min.y); y <= std::min(y1, windows.display.max.y);
         ++y) {
        const std::size_t from = (static_cast<std::size_t>(y - y0) * windows.dataWidth() +
                                  static_cast<std::size_t>(x0 - windows.data.min.x)) *
                                 texelBytes;
        const std::size_t to =
            (static_cast<std::size_t>(windows.display.max.y - y) * windows.width() +
             static_cast<std::size_t>(x0 - windows.display.min.x)) *
            texelBytes;
        std::memcpy(image.data.data() + to, block.data() + from, bytes);
    }
}

/// Decodes the rows of the data window in blocks with `readBlock(y0, y1, block)`.
template <class ReadBlock>
void readRows(const Windows& windows, std::size_t texelBytes, DecodedImage& image,
              const ReadBlock& readBlock) {
    const int first = std::max(windows.data.min.y, windows.display.min.y);
    const int last = std::min(windows.data.max.y, windows.display.max.y);
    std::vector<std::uint8_t> block;
    for (int y = first; y <= last; y += kRowsAtOnce) {
        const int end = std::min(last, y + kRowsAtOnce - 1);
        block.assign(static_cast<std::size_t>(end - y + 1) * windows.dataWidth() * texelBytes, 0);
        readBlock(y, end, block);
        placeRows(block, y, end, windows, texelBytes, image);
    }
}

/// The address that a slice wants: that of texel (0, 0), which may lie outside the block.
char* sliceBase(std::vector<std::uint8_t>& block, std::size_t offset, int x0, int y0,
                std::size_t xStride, std::size_t yStride) {
    const auto address = reinterpret_cast<std::uintptr_t>(block.data()) + offset;
    const auto shift = static_cast<std::intptr_t>(x0) * static_cast<std::intptr_t>(xStride) +
                       static_cast<std::intptr_t>(y0) * static_cast<std::intptr_t>(yStride);
    return reinterpret_cast<char*>(address - static_cast<std::uintptr_t>(shift));
}

void readChannels(Imf::MultiPartInputFile& file, int part, const ChannelChoice& choice,
                  const Windows& windows, DecodedImage& image) {
    Imf::InputPart input(file, part);
    const bool half = image.storage == Image::Storage::kHalf;
    const std::size_t valueBytes = half ? 2 : 4;
    const std::size_t xStride = valueBytes * choice.names.size();
    const std::size_t yStride = xStride * windows.dataWidth();
    readRows(windows, xStride, image, [&](int y0, int y1, std::vector<std::uint8_t>& block) {
        Imf::FrameBuffer frame;
        for (std::size_t c = 0; c < choice.names.size(); ++c) {
            if (!choice.names[c].empty()) {
                frame.insert(choice.names[c],
                             Imf::Slice(half ? Imf::HALF : Imf::FLOAT,
                                        sliceBase(block, c * valueBytes, windows.data.min.x, y0,
                                                  xStride, yStride),
                                        xStride, yStride));
            }
        }
        input.setFrameBuffer(frame);
        input.readPixels(y0, y1);
    });
}

/// Luminance-chroma files, whose chroma is subsampled.
void readLuminanceChroma(const std::string& path, const Windows& windows, DecodedImage& image) {
    Imf::RgbaInputFile input(path.c_str());
    std::vector<Imf::Rgba> rgba;
    const auto channels = static_cast<std::size_t>(image.channels);
    const std::size_t texelBytes = channels * sizeof(Imath::half);
    readRows(windows, texelBytes, image, [&](int y0, int y1, std::vector<std::uint8_t>& block) {
        const std::size_t count = static_cast<std::size_t>(y1 - y0 + 1) * windows.dataWidth();
        std::vector<std::uint8_t> texels(count * sizeof(Imf::Rgba));
        input.setFrameBuffer(reinterpret_cast<Imf::Rgba*>(
                                 sliceBase(texels, 0, windows.data.min.x, y0, sizeof(Imf::Rgba),
                                           sizeof(Imf::Rgba) * windows.dataWidth())),
                             1, windows.dataWidth());
        input.readPixels(y0, y1);
        for (std::size_t i = 0; i < count; ++i) {
            std::memcpy(block.data() + i * texelBytes, texels.data() + i * sizeof(Imf::Rgba),
                        texelBytes);
        }
    });
}

/// The first part that is a flat image, or -1.
int firstFlatPart(const Imf::MultiPartInputFile& file) {
    for (int part = 0; part < file.parts(); ++part) {
        const Imf::Header& header = file.header(part);
        if (!header.hasType() || Imf::isImage(header.type())) {
            return part;
        }
    }
    return -1;
}

Status checkSampling(const std::string& path, const Imf::ChannelList& channels,
                     const ChannelChoice& choice) {
    for (const std::string& name : choice.names) {
        const Imf::Channel* channel = name.empty() ? nullptr : channels.findChannel(name);
        if (channel != nullptr && (channel->xSampling != 1 || channel->ySampling != 1)) {
            return Error{path, "has the subsampled channel '" + name +
                                   "', which is supported for luminance-chroma images only"};
        }
    }
    return std::nullopt;
}

Result<DecodedImage> decode(const std::string& path) {
    Imf::MultiPartInputFile file(path.c_str());
    const int part = firstFlatPart(file);
    if (part < 0) {
        return Error{path, "has deep data only, which cannot be used as a texture"};
    }
    const Imf::Header& header = file.header(part);
    const Imf::ChannelList& channels = header.channels();
    DecodedImage image;
    const ChannelChoice choice = chooseChannels(channels);
    if (choice.names.empty()) {
        return Error{path, "has no channels"};
    }
    if (!choice.luminanceChroma) {
        if (Status error = checkSampling(path, channels, choice)) {
            return *error;
        }
    }
    image.note = choice.note;
    image.channels = static_cast<int>(choice.names.size());
    image.storage = Image::Storage::kHalf;
    for (const std::string& name : choice.names) {
        const Imf::Channel* channel = name.empty() ? nullptr : channels.findChannel(name);
        if (channel != nullptr && channel->type != Imf::HALF && !choice.luminanceChroma) {
            image.storage = Image::Storage::kFloat;
        }
    }
    const Windows windows{header.displayWindow(), header.dataWindow()};
    const std::int64_t texelBytes =
        image.channels * (image.storage == Image::Storage::kHalf ? 2 : 4);
    for (const Imath::Box2i& window : {windows.display, windows.data}) {
        const std::int64_t width = std::int64_t(window.max.x) - window.min.x + 1;
        const std::int64_t height = std::int64_t(window.max.y) - window.min.y + 1;
        if (Status error = checkImageSize(path, width, height, texelBytes)) {
            return *error;
        }
    }
    image.width = windows.display.max.x - windows.display.min.x + 1;
    image.height = windows.display.max.y - windows.display.min.y + 1;
    if (!file.partComplete(part)) {
        return Error{path, kTruncatedText};
    }
    image.data.assign(static_cast<std::size_t>(image.width) *
                          static_cast<std::size_t>(image.height) *
                          static_cast<std::size_t>(texelBytes),
                      0);
    readColorSpace(header, image);
    if (choice.luminanceChroma) {
        readLuminanceChroma(path, windows, image);
    } else {
        readChannels(file, part, choice, windows, image);
    }
    return image;
}

} // namespace

Result<DecodedImage> decodeExrImage(const std::string& path) {
    try {
        return decode(path);
    } catch (const std::exception& e) {
        return Error{path, std::string("cannot be decoded: ") + e.what()};
    }
}

} // namespace mbfeat
