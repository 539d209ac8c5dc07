#include "delegate/renderBuffer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>

#include "pxr/base/gf/half.h"

namespace mbfeat {

namespace {

template <class T>
void store(std::uint8_t* out, T value) {
    std::memcpy(out, &value, sizeof value);
}

float clamped(float value, float low, float high) {
    return value >= low ? std::min(value, high) : low; // NaN becomes low
}

void encode(HdFormat component, float value, std::uint8_t* out) {
    switch (component) {
    case HdFormatUNorm8:
        store(out, static_cast<std::uint8_t>(std::lround(clamped(value, 0, 1) * 255.0F)));
        break;
    case HdFormatSNorm8:
        store(out, static_cast<std::int8_t>(std::lround(clamped(value, -1, 1) * 127.0F)));
        break;
    case HdFormatFloat16:
        store(out, GfHalf(value));
        break;
    case HdFormatInt16:
        store(out, static_cast<std::int16_t>(clamped(value, -32768, 32767)));
        break;
    case HdFormatUInt16:
        store(out, static_cast<std::uint16_t>(clamped(value, 0, 65535)));
        break;
    case HdFormatInt32:
        store(out, static_cast<std::int32_t>(clamped(value, -2147483648.0F, 2147483520.0F)));
        break;
    default:
        store(out, value);
        break;
    }
}

/// Reads component `c` of a pixel of floats.
struct FloatSource {
    const float* pixels;
    int channels;
    /// Whether pixels of that format are ours byte for byte.
    bool isStoredAs(HdFormat component, int count) const {
        return component == HdFormatFloat32 && count == channels;
    }
    void put(std::size_t pixel, int c, HdFormat component, std::uint8_t* out) const {
        const float missing = c == 3 ? 1.0F : 0.0F;
        encode(
            component,
            c < channels
                ? pixels[pixel * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c)]
                : missing,
            out);
    }
};

struct IntegerSource {
    const std::int32_t* pixels;
    bool isStoredAs(HdFormat component, int count) const {
        return component == HdFormatInt32 && count == 1;
    }
    void put(std::size_t pixel, int c, HdFormat component, std::uint8_t* out) const {
        if (c == 0 && component == HdFormatInt32) {
            store(out, pixels[pixel]);
        } else {
            encode(component, c == 3 ? 1.0F : static_cast<float>(pixels[pixel]), out);
        }
    }
};

} // namespace

RenderBuffer::RenderBuffer(const SdfPath& id, Diagnostics& diagnostics)
    : HdRenderBuffer(id),
      messages_(diagnostics) {}

RenderBuffer::~RenderBuffer() = default;

bool RenderBuffer::Allocate(const GfVec3i& dimensions, HdFormat format, bool /*multiSampled*/) {
    _Deallocate();
    messages_.withdraw();
    const bool valid = dimensions[0] >= 0 && dimensions[1] >= 0 && dimensions[2] == 1 &&
                       format != HdFormatInvalid && format != HdFormatFloat32UInt8;
    if (!valid) {
        return false;
    }
    try {
        const std::lock_guard lock(mutex_);
        const auto pixels =
            static_cast<std::size_t>(dimensions[0]) * static_cast<std::size_t>(dimensions[1]);
        const std::size_t pixelBytes = HdDataSizeOfFormat(format);
        if (pixels > data_.max_size() / pixelBytes) { // the product would wrap around
            throw std::length_error("no memory is that large");
        }
        data_.assign(pixels * pixelBytes, 0);
        width_ = static_cast<unsigned int>(dimensions[0]);
        height_ = static_cast<unsigned int>(dimensions[1]);
        format_ = format;
    } catch (const std::exception& failure) {
        messages_.error(GetId().GetString(),
                        "a buffer of " + std::to_string(dimensions[0]) + " x " +
                            std::to_string(dimensions[1]) + " pixels could not be allocated (" +
                            failure.what() +
                            "); it stays empty. Render a smaller image or free memory.");
        return false;
    }
    return true;
}

void RenderBuffer::_Deallocate() {
    const std::lock_guard lock(mutex_);
    data_.clear();
    width_ = 0;
    height_ = 0;
    format_ = HdFormatInvalid;
    converged_ = false;
    stamp_ = 0;
}

void* RenderBuffer::Map() {
    ++mappers_;
    return data_.data();
}

void RenderBuffer::Unmap() {
    --mappers_;
}

template <class Source>
void RenderBuffer::writeRows(const Source& source, int x, int y, int width, int height) {
    const std::lock_guard lock(mutex_);
    const HdFormat component = HdGetComponentFormat(format_);
    const auto count = static_cast<int>(HdGetComponentCount(format_));
    const std::size_t componentBytes = HdDataSizeOfFormat(component);
    const bool whole = source.isStoredAs(component, count);
    const int x0 = std::max(x, 0);
    const int x1 = std::min(x + width, static_cast<int>(width_));
    const int y0 = std::max(y, 0);
    const int y1 = std::min(y + height, static_cast<int>(height_));
    for (int row = y0; row < y1; ++row) {
        const std::size_t bufferRow = height_ - 1 - static_cast<unsigned int>(row);
        std::uint8_t* out = data_.data() + (bufferRow * width_ + static_cast<std::size_t>(x0)) *
                                               static_cast<std::size_t>(count) * componentBytes;
        std::size_t pixel = static_cast<std::size_t>(row - y) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(x0 - x);
        if (whole) {
            const std::size_t pixelBytes = static_cast<std::size_t>(count) * componentBytes;
            std::memcpy(out, source.pixels + pixel * static_cast<std::size_t>(count),
                        static_cast<std::size_t>(std::max(x1 - x0, 0)) * pixelBytes);
            continue;
        }
        for (int column = x0; column < x1; ++column, ++pixel) {
            for (int c = 0; c < count; ++c, out += componentBytes) {
                source.put(pixel, c, component, out);
            }
        }
    }
}

void RenderBuffer::write(const float* pixels, int channels, int x, int y, int width, int height) {
    writeRows(FloatSource{pixels, channels}, x, y, width, height);
}

void RenderBuffer::write(const std::int32_t* pixels, int x, int y, int width, int height) {
    writeRows(IntegerSource{pixels}, x, y, width, height);
}

void RenderBuffer::fill(const float (&value)[4]) {
    std::vector<float> row(static_cast<std::size_t>(width_) * 4);
    for (std::size_t i = 0; i < row.size(); ++i) {
        row[i] = value[i % 4];
    }
    for (unsigned int y = 0; y < height_; ++y) {
        write(row.data(), 4, 0, static_cast<int>(y), static_cast<int>(width_), 1);
    }
}

} // namespace mbfeat
