#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <half.h>

#include "film/exrHeader.h"
#include "film/exrLayout.h"
#include "film/exrWriter.h"

namespace mbfeat {

namespace {

constexpr float kLargestHalf = 65504.0F;
/// Rows that are resolved and handed to OpenEXR at once: some compression blocks a thread, at a few
/// megabytes a layer.
constexpr int kSlabRows = 64;

/// A layer and the pixels of the slab that is being written.
struct LayerWriter {
    ExrLayer layer;
    int boundAov = 0;
    std::vector<float> floats;
    std::vector<std::int32_t> ints;
    std::vector<half> halves;
    std::uint64_t clamped = 0;
};

bool overflowsHalf(float value) {
    return std::abs(value) > kLargestHalf; // false for NaN, which a half can hold
}

/// Makes room for `rows` rows; returns the pixels in the file's type.
const char* prepareSlab(LayerWriter& writer, const Film& film, int rows) {
    const std::size_t size = static_cast<std::size_t>(film.window().data.width) *
                             static_cast<std::size_t>(rows) *
                             static_cast<std::size_t>(writer.layer.aov.width());
    if (writer.layer.type == PixelType::kUInt) {
        writer.ints.resize(size);
        return reinterpret_cast<const char*>(writer.ints.data());
    }
    writer.floats.resize(size);
    if (writer.layer.type == PixelType::kFloat) {
        return reinterpret_cast<const char*>(writer.floats.data());
    }
    writer.halves.resize(size);
    return reinterpret_cast<const char*>(writer.halves.data());
}

/// Fills row `row` of the slab; returns how many of its values no half can hold.
std::uint64_t fillRow(LayerWriter& writer, const FilmRow& filmRow, int width, int row) {
    const std::size_t count =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(writer.layer.aov.width());
    const std::size_t first = static_cast<std::size_t>(row) * count;
    if (writer.layer.type == PixelType::kUInt) {
        filmRow.resolveInt(writer.boundAov, writer.ints.data() + first);
        return 0;
    }
    float* const floats = writer.floats.data() + first;
    filmRow.resolve(writer.boundAov, floats);
    if (writer.layer.type == PixelType::kFloat) {
        return 0;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const float value = floats[i];
        writer.halves[first + i] =
            half(overflowsHalf(value) ? std::copysign(kLargestHalf, value) : value);
    }
    return static_cast<std::uint64_t>(std::count_if(floats, floats + count, overflowsHalf));
}

/// The header is written before the pixels, so what has to be said there is counted first.
void countClamped(std::vector<LayerWriter>& writers, const Film& film) {
    const auto isHalf = [](const LayerWriter& writer) {
        return writer.layer.type == PixelType::kHalf;
    };
    if (std::none_of(writers.begin(), writers.end(), isHalf)) {
        return;
    }
    const PixelRect& data = film.window().data;
    FilmRow filmRow(film);
    for (int row = 0; row < data.height; ++row) {
        filmRow.read(row);
        for (LayerWriter& writer : writers) {
            if (isHalf(writer)) {
                prepareSlab(writer, film, 1);
                writer.clamped += fillRow(writer, filmRow, data.width, 0);
            }
        }
    }
}

Imf::PixelType exrPixelType(PixelType type) {
    return type == PixelType::kHalf    ? Imf::HALF
           : type == PixelType::kFloat ? Imf::FLOAT
                                       : Imf::UINT;
}

void describeLayer(Imf::Header& header, const LayerWriter& writer) {
    const ExrLayer& layer = writer.layer;
    addTextAttribute(header, layerAttributeName(layer.name), layer.aov.name);
    for (int c = 0; c < layer.aov.width(); ++c) {
        header.channels().insert(layer.channel(c), Imf::Channel(exrPixelType(layer.type)));
    }
    if (layer.type == PixelType::kUInt && layer.aov.clearValue < 0.0F) {
        addTextAttribute(header, "mbfeat:signedIntegers",
                         "UINT channels hold 32-bit two's complement: 0xFFFFFFFF (4294967295) is "
                         "-1, the background.");
    }
}

std::vector<LayerWriter> bindLayers(const ProductSpec& product, const Film& film) {
    std::vector<LayerWriter> writers;
    for (ExrLayer& layer : exrLayers(product)) {
        LayerWriter writer;
        writer.boundAov = film.findBound(layer.aov.name);
        writer.layer = std::move(layer);
        writers.push_back(std::move(writer));
    }
    countClamped(writers, film);
    return writers;
}

/// Which of the layers lie in a part.
using Part = std::vector<LayerWriter*>;

Imf::Header partHeader(const ProductSpec& product, const Film& film, const RenderReport& report,
                       const Part& part) {
    Imf::Header header = exrHeader(product, film, report);
    header.setType(Imf::SCANLINEIMAGE);
    if (product.multiPart) {
        header.setName(part.front()->layer.name);
    }
    std::uint64_t clamped = 0;
    for (const LayerWriter* const writer : part) {
        describeLayer(header, *writer);
        clamped += writer->clamped;
    }
    if (clamped > 0) {
        addTextAttribute(header, "mbfeat:halfOverflow",
                         std::to_string(clamped) +
                             " values are too large for a half and were written as +-65504.");
    }
    return header;
}

void writePart(Imf::OutputPart& file, const Part& part, const Film& film) {
    const PixelRect& data = film.window().data;
    FilmRow filmRow(film);
    for (int row = 0; row < data.height; row += kSlabRows) {
        const int rows = std::min(kSlabRows, data.height - row);
        Imf::FrameBuffer frameBuffer;
        for (LayerWriter* const writer : part) {
            const ExrLayer& layer = writer->layer;
            const char* const pixels = prepareSlab(*writer, film, rows);
            const std::size_t valueBytes = pixelTypeBytes(layer.type);
            const auto channels = static_cast<std::size_t>(layer.aov.width());
            const std::size_t pixelBytes = valueBytes * channels;
            for (std::size_t c = 0; c < channels; ++c) {
                frameBuffer.insert(layer.channel(static_cast<int>(c)),
                                   Imf::Slice::Make(exrPixelType(layer.type),
                                                    pixels + c * valueBytes,
                                                    Imath::V2i(data.x, data.y + row), data.width,
                                                    rows, pixelBytes));
            }
        }
        for (int i = 0; i < rows; ++i) {
            filmRow.read(row + i);
            for (LayerWriter* const writer : part) {
                fillRow(*writer, filmRow, data.width, i);
            }
        }
        file.setFrameBuffer(frameBuffer);
        file.writePixels(rows);
    }
}

} // namespace

std::uint64_t writeRaster(Imf::OStream& stream, const ProductSpec& product, const Film& film,
                          const RenderReport& report, int threads) {
    std::vector<LayerWriter> writers = bindLayers(product, film);
    std::vector<Part> parts;
    for (LayerWriter& writer : writers) {
        if (product.multiPart || parts.empty()) {
            parts.emplace_back();
        }
        parts.back().push_back(&writer);
    }
    std::vector<Imf::Header> headers;
    headers.reserve(parts.size());
    std::uint64_t clamped = 0;
    for (const Part& part : parts) {
        headers.push_back(partHeader(product, film, report, part));
    }
    for (const LayerWriter& writer : writers) {
        clamped += writer.clamped;
    }
    Imf::MultiPartOutputFile file(stream, headers.data(), static_cast<int>(headers.size()), false,
                                  threads);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        Imf::OutputPart part(file, static_cast<int>(i));
        writePart(part, parts[i], film);
    }
    return clamped;
}

} // namespace mbfeat
