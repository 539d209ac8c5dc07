#include "scene/texture.h"

#include <array>
#include <cstring>

#include <Imath/half.h>

#include "scene/colorManagement.h"

namespace mbfeat {

namespace {

using Storage = Image::Storage;

/// sRGB code values to linear light, once for the process.
template <class Code>
const float* srgbTable() {
    static const std::vector<float> table = [] {
        constexpr std::size_t kCodes = std::size_t(1) << (8 * sizeof(Code));
        std::vector<float> values(kCodes);
        for (std::size_t i = 0; i < kCodes; ++i) {
            values[i] = static_cast<float>(
                decodeSrgb(static_cast<double>(i) / static_cast<double>(kCodes - 1)));
        }
        return values;
    }();
    return table.data();
}

template <class Value>
Value load(const std::uint8_t* data, std::size_t index) {
    Value value;
    std::memcpy(&value, data + index * sizeof(Value), sizeof(Value));
    return value;
}

template <Storage kStorage>
float decodeValue(const std::uint8_t* data, std::size_t index, bool isAlpha) {
    if constexpr (kStorage == Storage::kUNorm8) {
        return static_cast<float>(data[index]) / 255.0F;
    } else if constexpr (kStorage == Storage::kSrgb8) {
        return isAlpha ? static_cast<float>(data[index]) / 255.0F
                       : srgbTable<std::uint8_t>()[data[index]];
    } else if constexpr (kStorage == Storage::kUNorm16) {
        return static_cast<float>(load<std::uint16_t>(data, index)) / 65535.0F;
    } else if constexpr (kStorage == Storage::kSrgb16) {
        const auto code = load<std::uint16_t>(data, index);
        return isAlpha ? static_cast<float>(code) / 65535.0F : srgbTable<std::uint16_t>()[code];
    } else if constexpr (kStorage == Storage::kHalf) {
        return static_cast<float>(load<Imath::half>(data, index));
    } else {
        return load<float>(data, index);
    }
}

template <Storage kStorage>
Float4 decodeTexel(const std::uint8_t* data, std::size_t texel, int channels) {
    const std::size_t i = texel * static_cast<std::size_t>(channels);
    const float first = decodeValue<kStorage>(data, i, false);
    switch (channels) {
    case 1:
        return {first, first, first, 1.0F};
    case 2:
        return {first, first, first, decodeValue<kStorage>(data, i + 1, true)};
    case 3:
        return {first, decodeValue<kStorage>(data, i + 1, false),
                decodeValue<kStorage>(data, i + 2, false), 1.0F};
    default:
        return {first, decodeValue<kStorage>(data, i + 1, false),
                decodeValue<kStorage>(data, i + 2, false),
                decodeValue<kStorage>(data, i + 3, true)};
    }
}

/// The four texels around a look-up and their weights.
struct Footprint {
    std::array<std::size_t, 4> texel;
    float fx, fy;
};

template <Storage kStorage>
Float4 bilinear(const std::uint8_t* data, const Footprint& f, int channels) {
    const Float4 a = decodeTexel<kStorage>(data, f.texel[0], channels);
    const Float4 b = decodeTexel<kStorage>(data, f.texel[1], channels);
    const Float4 c = decodeTexel<kStorage>(data, f.texel[2], channels);
    const Float4 d = decodeTexel<kStorage>(data, f.texel[3], channels);
    const auto mix = [&f](float v00, float v10, float v01, float v11) {
        return lerp(f.fy, lerp(f.fx, v00, v10), lerp(f.fx, v01, v11));
    };
    return {mix(a.x, b.x, c.x, d.x), mix(a.y, b.y, c.y, d.y), mix(a.z, b.z, c.z, d.z),
            mix(a.w, b.w, c.w, d.w)};
}

/// One axis of a look-up: the two texels and the weight of the second.
struct AxisLookup {
    int i0 = 0, i1 = 0;
    float weight = 0.0F;
    bool outside = false;
};

AxisLookup lookUp(float s, int size, Wrap wrap) {
    AxisLookup r;
    switch (wrap) {
    case Wrap::kBlack:
        r.outside = !(s >= 0.0F && s <= 1.0F);
        break;
    case Wrap::kRepeat:
        s -= floor(s);
        break;
    case Wrap::kMirror:
        s -= 2.0F * floor(0.5F * s);
        s = s > 1.0F ? 2.0F - s : s;
        break;
    case Wrap::kClamp:
        break;
    }
    s = clamp(s, 0.0F, 1.0F);
    const float x = s * static_cast<float>(size) - 0.5F;
    const float base = floor(x);
    r.weight = x - base;
    r.i0 = static_cast<int>(base);
    r.i1 = r.i0 + 1;
    if (wrap == Wrap::kRepeat) {
        r.i0 = r.i0 < 0 ? size - 1 : r.i0;
        r.i1 = r.i1 >= size ? 0 : r.i1;
    }
    r.i0 = clamp(r.i0, 0, size - 1);
    r.i1 = clamp(r.i1, 0, size - 1);
    return r;
}

} // namespace

Image::Image(int width, int height, int channels, Storage storage, std::vector<std::uint8_t> data)
    : width_(width),
      height_(height),
      channels_(channels),
      storage_(storage),
      bytes_(data.size()),
      data_(std::move(data)) {
    // Four channels and floats are words already; a large image is not copied for nothing.
    const bool isByte = storage_ == Storage::kUNorm8 || storage_ == Storage::kSrgb8;
    if (isByte && channels_ < 4) {
        data_.reserve(bytes_ + kPadding); // no more: resize() alone might double it
        data_.resize(bytes_ + kPadding);
    }
}

bool Image::hasLanes() const {
    constexpr std::size_t kMostBytes = std::size_t{1} << 31U;
    const bool simple =
        storage_ == Storage::kUNorm8 || storage_ == Storage::kSrgb8 || storage_ == Storage::kFloat;
    constexpr int kMostSide = 1 << 24; // whole numbers of floats
    return simple && data_.size() <= kMostBytes && width_ < kMostSide && height_ < kMostSide;
}

const float* Image::srgbCodes() {
    return srgbTable<std::uint8_t>();
}

Float4 Image::texel(int x, int y) const {
    const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                          static_cast<std::size_t>(x);
    switch (storage_) {
    case Storage::kUNorm8:
        return decodeTexel<Storage::kUNorm8>(data_.data(), i, channels_);
    case Storage::kSrgb8:
        return decodeTexel<Storage::kSrgb8>(data_.data(), i, channels_);
    case Storage::kUNorm16:
        return decodeTexel<Storage::kUNorm16>(data_.data(), i, channels_);
    case Storage::kSrgb16:
        return decodeTexel<Storage::kSrgb16>(data_.data(), i, channels_);
    case Storage::kHalf:
        return decodeTexel<Storage::kHalf>(data_.data(), i, channels_);
    case Storage::kFloat:
        break;
    }
    return decodeTexel<Storage::kFloat>(data_.data(), i, channels_);
}

Float4 Image::sample(Float2 st, Wrap wrapS, Wrap wrapT) const {
    if (!std::isfinite(st.x) || !std::isfinite(st.y)) {
        return {0.0F, 0.0F, 0.0F, 0.0F};
    }
    const AxisLookup u = lookUp(st.x, width_, wrapS);
    const AxisLookup v = lookUp(st.y, height_, wrapT);
    if (u.outside || v.outside) {
        return {0.0F, 0.0F, 0.0F, 0.0F};
    }
    const auto index = [this](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
               static_cast<std::size_t>(x);
    };
    const Footprint f{{index(u.i0, v.i0), index(u.i1, v.i0), index(u.i0, v.i1), index(u.i1, v.i1)},
                      u.weight,
                      v.weight};
    switch (storage_) {
    case Storage::kUNorm8:
        return bilinear<Storage::kUNorm8>(data_.data(), f, channels_);
    case Storage::kSrgb8:
        return bilinear<Storage::kSrgb8>(data_.data(), f, channels_);
    case Storage::kUNorm16:
        return bilinear<Storage::kUNorm16>(data_.data(), f, channels_);
    case Storage::kSrgb16:
        return bilinear<Storage::kSrgb16>(data_.data(), f, channels_);
    case Storage::kHalf:
        return bilinear<Storage::kHalf>(data_.data(), f, channels_);
    case Storage::kFloat:
        break;
    }
    return bilinear<Storage::kFloat>(data_.data(), f, channels_);
}

Result<std::shared_ptr<const Image>> makeImage(int width, int height, int channels,
                                               std::vector<float> values) {
    if (width < 1 || height < 1 || channels < 1 || channels > 4) {
        return Error{"image", "has no texels, or not 1 to 4 channels; give it at least one texel"};
    }
    const std::size_t expected = static_cast<std::size_t>(width) *
                                 static_cast<std::size_t>(height) *
                                 static_cast<std::size_t>(channels);
    if (values.size() != expected) {
        return Error{"image", "has " + std::to_string(values.size()) + " values, but " +
                                  std::to_string(expected) + " are needed"};
    }
    for (const float value : values) {
        if (!std::isfinite(value)) {
            return Error{"image", "has values that are not finite; replace them"};
        }
    }
    std::vector<std::uint8_t> data(values.size() * sizeof(float));
    std::memcpy(data.data(), values.data(), data.size());
    return std::shared_ptr<const Image>(
        std::make_shared<Image>(width, height, channels, Image::Storage::kFloat, std::move(data)));
}

} // namespace mbfeat
