// Texture look-ups of several paths at once: the same bits as Image::sample() of each.
#pragma once

#include <cstddef>

#include "core/laneQuads.h"
#include "scene/texture.h"

namespace mbfeat {

/// One axis of look-ups: the two texels and the weight of the second.
template <class T>
struct AxisLanes {
    IntLane<T> first, second;
    T weight;
    Mask<T> outside;
};

/// s is finite.
template <class T>
AxisLanes<T> lookUpAxis(T s, int size, Wrap wrap) {
    AxisLanes<T> r;
    r.outside = Mask<T>(false);
    switch (wrap) {
    case Wrap::kBlack:
        r.outside = s < T(0) || s > T(1);
        break;
    case Wrap::kRepeat:
        s = s - floor(s);
        break;
    case Wrap::kMirror: {
        s = s - T(2) * floor(T(0.5F) * s);
        s = select(s > T(1), T(2) - s, s);
        break;
    }
    case Wrap::kClamp:
        break;
    }
    s = min(max(s, T(0)), T(1));
    const T x = s * T(static_cast<float>(size)) - T(0.5F);
    const T base = floor(x);
    r.weight = x - base;
    r.first = toInteger(base);
    r.second = r.first + IntLane<T>(1);
    const IntLane<T> least(0), most(size - 1);
    if (wrap == Wrap::kRepeat) {
        r.first = selectInt(base < T(0), most, r.first);
        r.second = selectInt(toFloat(r.second) >= T(static_cast<float>(size)), least, r.second);
    }
    r.first = min(max(r.first, least), most);
    r.second = min(max(r.second, least), most);
    return r;
}

/// Texels at places that are given in texels from the first one; see Image::texel().
template <class T>
class TexelLanes {
public:
    explicit TexelLanes(const Image& image) : image_(image), channels_(image.channels()) {}

    Vec4<T> at(const IntLane<T>& texel) const {
        return image_.storage() == Image::Storage::kFloat ? floats(texel) : bytes(texel);
    }

private:
    Vec4<T> floats(const IntLane<T>& texel) const {
        const auto* const base = reinterpret_cast<const float*>(image_.data());
        const IntLane<T> place = texel * IntLane<T>(channels_);
        if constexpr (kIsBatch<T>) {
            const int values = image_.width() * image_.height() * channels_;
            if (channels_ >= 3 && values >= 4) {
                return wholeTexels(base, place, IntLane<T>(values - 4));
            }
        }
        return withChannels([&](int c, bool) { return gatherLanes<T>(base + c, place); });
    }

    /// Four neighbouring floats at once, which a gather would take one by one. What would reach
    /// past the end, at the last texel of three, begins one before.
    Vec4<T> wholeTexels(const float* base, const IntLane<T>& place, const IntLane<T>& most) const {
        const IntLane<T> begin = min(place, most);
        alignas(64) std::int32_t begins[LaneTraits<T>::kWidth];
        storeIntLanes<T>(begins, begin);
        const LaneQuad<T> q = loadQuadsAt<T>([&](int i) { return base + begins[i]; });
        if (channels_ == 4) {
            return {q.x, q.y, q.z, q.w};
        }
        const Mask<T> late = toFloat(place - begin) > T(0);
        return {select(late, q.y, q.x), select(late, q.z, q.y), select(late, q.w, q.z), T(1)};
    }

    Vec4<T> bytes(const IntLane<T>& texel) const {
        const IntLane<T> word = gatherWordsAt<T>(image_.data(), texel * IntLane<T>(channels_));
        const bool isSrgb = image_.storage() == Image::Storage::kSrgb8;
        return withChannels([&](int c, bool isAlpha) {
            const IntLane<T> code = (word >> (8 * c)) & IntLane<T>(0xFF);
            return isSrgb && !isAlpha ? gatherLanes<T>(Image::srgbCodes(), code)
                                      : toFloat(code) / T(255.0F);
        });
    }

    template <class Channel>
    Vec4<T> withChannels(const Channel& channel) const {
        const T first = channel(0, false);
        switch (channels_) {
        case 1:
            return {first, first, first, T(1)};
        case 2:
            return {first, first, first, channel(1, true)};
        case 3:
            return {first, channel(1, false), channel(2, false), T(1)};
        default:
            return {first, channel(1, false), channel(2, false), channel(3, true)};
        }
    }

    const Image& image_;
    int channels_;
};

/// Image::sample() of each lane, of images that have lanes.
template <class T>
Vec4<T> sampleTexture(const Image& image, const Vec2<T>& st, Wrap wrapS, Wrap wrapT) {
    // Zero times anything finite is zero.
    const Mask<T> finite = st.x * T(0) + st.y * T(0) == T(0);
    const AxisLanes<T> u = lookUpAxis(select(finite, st.x, T(0)), image.width(), wrapS);
    const AxisLanes<T> v = lookUpAxis(select(finite, st.y, T(0)), image.height(), wrapT);
    const IntLane<T> width(image.width());
    const IntLane<T> low = v.first * width, high = v.second * width;
    const TexelLanes<T> texels(image);
    const Vec4<T> a = texels.at(low + u.first), b = texels.at(low + u.second);
    const Vec4<T> c = texels.at(high + u.first), d = texels.at(high + u.second);
    const Mask<T> lit = finite && !(u.outside || v.outside);
    const auto mix = [&](const T& v00, const T& v10, const T& v01, const T& v11) {
        const T value = lerp(v.weight, lerp(u.weight, v00, v10), lerp(u.weight, v01, v11));
        return select(lit, value, T(0));
    };
    return {mix(a.x, b.x, c.x, d.x), mix(a.y, b.y, c.y, d.y), mix(a.z, b.z, c.z, d.z),
            mix(a.w, b.w, c.w, d.w)};
}

} // namespace mbfeat
