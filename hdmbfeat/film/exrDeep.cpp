#include <algorithm>
#include <string>
#include <vector>

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfIntAttribute.h>
#include <ImfPartType.h>

#include "film/exrHeader.h"
#include "film/exrLayout.h"
#include "film/exrWriter.h"

namespace mbfeat {

namespace {

/// Rows handed to OpenEXR at once; its deep blocks are single rows, so these are for its threads.
constexpr int kSlabRows = 8;

/// Pointers of some rows in the form that OpenEXR wants: an array of pointers for each channel, one
/// a pixel, to that pixel's samples. Floats are read where the film keeps them; integers, which it
/// keeps as floats, are converted.
class DeepSlab {
public:
    explicit DeepSlab(const Film& film)
        : film_(film),
          fields_(film.pathSampleLayout()),
          data_(film.window().data),
          capacity_(static_cast<std::size_t>(film.pathSampleCapacity())),
          pixels_(static_cast<std::size_t>(data_.width) * kSlabRows),
          counts_(pixels_),
          pointers_(fields_.size(), std::vector<const char*>(pixels_)),
          ints_(fields_.size()) {
        for (std::size_t f = 0; f < fields_.size(); ++f) {
            if (fields_[f].isInteger) {
                ints_[f].resize(pixels_ * capacity_);
            }
        }
    }

    /// The slab of rows [firstRow, firstRow + rows) of the data window; valid until the next call.
    Imf::DeepFrameBuffer fill(int firstRow, int rows) {
        for (int row = 0; row < rows; ++row) {
            for (int column = 0; column < data_.width; ++column) {
                fillPixel(static_cast<std::size_t>(row) * data_.width + column, data_.x + column,
                          data_.y + firstRow + row);
            }
        }
        return frameBuffer(data_.y + firstRow);
    }

private:
    void fillPixel(std::size_t slabPixel, int x, int y) {
        const std::size_t pixel = static_cast<std::size_t>(y - data_.y) * data_.width +
                                  static_cast<std::size_t>(x - data_.x);
        const std::size_t count = std::min<std::size_t>(film_.sampleCount(x, y), capacity_);
        counts_[slabPixel] = static_cast<unsigned int>(count);
        const float* const samples = film_.pathSamples() + pixel * capacity_ * fields_.size();
        for (std::size_t f = 0; f < fields_.size(); ++f) {
            if (!fields_[f].isInteger) {
                pointers_[f][slabPixel] = reinterpret_cast<const char*>(samples + f);
                continue;
            }
            std::uint32_t* const ints = ints_[f].data() + slabPixel * capacity_;
            for (std::size_t s = 0; s < count; ++s) {
                ints[s] = static_cast<std::uint32_t>(samples[s * fields_.size() + f]);
            }
            pointers_[f][slabPixel] = reinterpret_cast<const char*>(ints);
        }
    }

    /// The address that OpenEXR, which adds x and y times the strides, wants for pixels of the
    /// slab.
    template <class T>
    char* origin(const std::vector<T>& slab, int firstY) const {
        const std::ptrdiff_t pixel = static_cast<std::ptrdiff_t>(firstY) * data_.width + data_.x;
        const auto address = reinterpret_cast<std::uintptr_t>(slab.data());
        return reinterpret_cast<char*>(address - static_cast<std::uintptr_t>(pixel) * sizeof(T));
    }

    Imf::DeepFrameBuffer frameBuffer(int firstY) const {
        const auto width = static_cast<std::size_t>(data_.width);
        Imf::DeepFrameBuffer buffer;
        buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, origin(counts_, firstY),
                                                 sizeof(unsigned int),
                                                 sizeof(unsigned int) * width));
        for (std::size_t f = 0; f < fields_.size(); ++f) {
            const bool isInteger = fields_[f].isInteger;
            const std::size_t sampleStride =
                isInteger ? sizeof(std::uint32_t) : fields_.size() * sizeof(float);
            buffer.insert(fields_[f].name,
                          Imf::DeepSlice(isInteger ? Imf::UINT : Imf::FLOAT,
                                         origin(pointers_[f], firstY), sizeof(char*),
                                         sizeof(char*) * width, sampleStride));
        }
        return buffer;
    }

    const Film& film_;
    const std::vector<PathSampleField>& fields_;
    PixelRect data_;
    std::size_t capacity_, pixels_;
    std::vector<unsigned int> counts_;
    std::vector<std::vector<const char*>> pointers_; ///< [field][pixel]
    std::vector<std::vector<std::uint32_t>> ints_;   ///< [field][pixel * capacity]
};

Imf::Header deepHeader(const ProductSpec& product, const Film& film, const RenderReport& report) {
    Imf::Header header = exrHeader(product, film, report);
    header.setType(Imf::DEEPSCANLINE);
    header.insert("maxSamplesPerPixel", Imf::IntAttribute(film.pathSampleCapacity()));
    for (const PathSampleField& field : film.pathSampleLayout()) {
        header.channels().insert(field.name,
                                 Imf::Channel(field.isInteger ? Imf::UINT : Imf::FLOAT));
    }
    addTextAttribute(header, "mbfeat:deepSamples",
                     "One sample is one path, in the order in which they were traced; not sorted "
                     "by depth. Z is the distance of the first hit.");
    return header;
}

} // namespace

void writeDeep(Imf::OStream& stream, const ProductSpec& product, const Film& film,
               const RenderReport& report, int threads) {
    Imf::DeepScanLineOutputFile file(stream, deepHeader(product, film, report), threads);
    DeepSlab slab(film);
    const int height = film.window().data.height;
    for (int row = 0; row < height; row += kSlabRows) {
        const int rows = std::min(kSlabRows, height - row);
        file.setFrameBuffer(slab.fill(row, rows));
        file.writePixels(rows);
    }
}

} // namespace mbfeat
