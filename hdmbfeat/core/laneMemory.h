// Lanes and memory: integers beside the lane type, loads, stores and gathers. What is written to
// places of each lane's own goes by rows, see laneQuads.h.
//
// A lane index names a place in an array of floats or 32-bit integers. All lanes of a gather take
// part.
#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>

#include "core/lane.h"
#include "core/vec.h"

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace mbfeat {

/// 32-bit integers, one a lane.
template <class T>
struct IntegerLanes {
    using Signed = std::int32_t;
    using Unsigned = std::uint32_t;
};
template <class S, class A>
struct IntegerLanes<xsimd::batch<S, A>> {
    using Signed = xsimd::batch<std::int32_t, A>;
    using Unsigned = xsimd::batch<std::uint32_t, A>;
};
template <class T>
using IntLane = typename IntegerLanes<T>::Signed;
template <class T>
using UintLane = typename IntegerLanes<T>::Unsigned;

template <class T>
inline constexpr bool kIsBatch = !std::is_floating_point_v<T>;

inline float toFloat(std::int32_t x) {
    return static_cast<float>(x);
}
/// Of whole numbers.
inline std::int32_t toInteger(float x) {
    return static_cast<std::int32_t>(x);
}
template <class A>
xsimd::batch<std::int32_t, A> toInteger(const xsimd::batch<float, A>& x) {
    return xsimd::to_int(x);
}
template <class A>
xsimd::batch<float, A> toFloat(const xsimd::batch<std::int32_t, A>& x) {
    return xsimd::to_float(x);
}
inline std::int32_t toSigned(std::uint32_t x) {
    return static_cast<std::int32_t>(x);
}
template <class A>
xsimd::batch<std::int32_t, A> toSigned(const xsimd::batch<std::uint32_t, A>& x) {
    return xsimd::bitwise_cast<xsimd::batch<std::int32_t, A>>(x);
}

/// select() on integers by a mask of float lanes.
inline std::int32_t selectInt(bool m, std::int32_t a, std::int32_t b) {
    return m ? a : b;
}
template <class A>
xsimd::batch<std::int32_t, A> selectInt(const xsimd::batch_bool<float, A>& m,
                                        const xsimd::batch<std::int32_t, A>& a,
                                        const xsimd::batch<std::int32_t, A>& b) {
    return xsimd::select(xsimd::bool_cast(m), a, b);
}

/// Lanes from consecutive memory (any alignment).
template <class T>
T loadLanes(const float* from) {
    if constexpr (kIsBatch<T>) {
        return T::load_unaligned(from);
    } else {
        return static_cast<T>(*from);
    }
}
template <class T>
IntLane<T> loadIntLanes(const std::int32_t* from) {
    if constexpr (kIsBatch<T>) {
        return IntLane<T>::load_unaligned(from);
    } else {
        return *from;
    }
}
template <class T>
void storeLanes(float* to, const T& value) {
    if constexpr (kIsBatch<T>) {
        value.store_unaligned(to);
    } else {
        *to = static_cast<float>(value);
    }
}
template <class T>
void storeIntLanes(std::int32_t* to, const IntLane<T>& value) {
    if constexpr (kIsBatch<T>) {
        value.store_unaligned(to);
    } else {
        *to = value;
    }
}

/// base[index], lane by lane.
template <class T>
T gatherLanes(const float* base, const IntLane<T>& index) {
    if constexpr (!kIsBatch<T>) {
        return static_cast<T>(base[index]);
    }
#if defined(__AVX512F__)
    else if constexpr (LaneTraits<T>::kWidth == 16) {
        return T(_mm512_i32gather_ps(index, base, 4));
    }
#endif
#if defined(__AVX2__)
    else if constexpr (LaneTraits<T>::kWidth == 8) {
        return T(_mm256_i32gather_ps(base, index, 4));
    }
#endif
    else {
        return T::gather(base, index);
    }
}
template <class T>
IntLane<T> gatherIntLanes(const std::int32_t* base, const IntLane<T>& index) {
    if constexpr (!kIsBatch<T>) {
        return base[index];
    }
#if defined(__AVX512F__)
    else if constexpr (LaneTraits<T>::kWidth == 16) {
        return IntLane<T>(_mm512_i32gather_epi32(index, base, 4));
    }
#endif
#if defined(__AVX2__)
    else if constexpr (LaneTraits<T>::kWidth == 8) {
        return IntLane<T>(_mm256_i32gather_epi32(base, index, 4));
    }
#endif
    else {
        return IntLane<T>::gather(base, index);
    }
}

/// The 32 bits, of any alignment, that begin so many bytes after base.
template <class T>
IntLane<T> gatherWordsAt(const std::uint8_t* base, const IntLane<T>& bytes) {
    const auto at = [base](std::int32_t offset) {
        std::int32_t word = 0;
        std::memcpy(&word, base + offset, sizeof(word));
        return word;
    };
    if constexpr (!kIsBatch<T>) {
        return at(bytes);
    }
#if defined(__AVX512F__)
    else if constexpr (LaneTraits<T>::kWidth == 16) {
        return IntLane<T>(_mm512_i32gather_epi32(bytes, base, 1));
    }
#endif
#if defined(__AVX2__)
    else if constexpr (LaneTraits<T>::kWidth == 8) {
        return IntLane<T>(
            _mm256_i32gather_epi32(reinterpret_cast<const std::int32_t*>(base), bytes, 1));
    }
#endif
    else {
        alignas(64) std::int32_t lanes[LaneTraits<T>::kWidth];
        storeIntLanes<T>(lanes, bytes);
        for (std::int32_t& lane : lanes) {
            lane = at(lane);
        }
        return loadIntLanes<T>(lanes);
    }
}

/// Bit i is lane i.
inline std::uint32_t laneBits(bool m) {
    return m ? 1U : 0U;
}
template <class A>
std::uint32_t laneBits(const xsimd::batch_bool<float, A>& m) {
#if defined(__AVX512F__)
    if constexpr (xsimd::batch<float, A>::size == 16) {
        return static_cast<std::uint32_t>(static_cast<__mmask16>(m.data));
    }
#endif
#if defined(__AVX2__)
    if constexpr (xsimd::batch<float, A>::size == 8) {
        return static_cast<std::uint32_t>(_mm256_movemask_ps(m.data));
    }
#endif
    std::uint32_t bits = 0;
    alignas(64) float lanes[xsimd::batch<float, A>::size];
    xsimd::select(m, xsimd::batch<float, A>(1.0F), xsimd::batch<float, A>(0.0F))
        .store_aligned(lanes);
    for (std::size_t i = 0; i < xsimd::batch<float, A>::size; ++i) {
        bits |= lanes[i] != 0.0F ? 1U << i : 0U;
    }
    return bits;
}

/// The mask whose lane i is bit i.
template <class T>
Mask<T> maskOfBits(std::uint32_t bits) {
    if constexpr (!kIsBatch<T>) {
        return (bits & 1U) != 0;
    }
#if defined(__AVX512F__)
    else if constexpr (LaneTraits<T>::kWidth == 16) {
        return Mask<T>(static_cast<__mmask16>(bits));
    }
#endif
    else {
        constexpr int kWidth = LaneTraits<T>::kWidth;
        alignas(64) float lanes[kWidth];
        for (int i = 0; i < kWidth; ++i) {
            lanes[i] = static_cast<float>((bits >> static_cast<unsigned>(i)) & 1U);
        }
        return T::load_aligned(lanes) != T(0.0F);
    }
}

/// One value of each lane in memory, to be filled by scalar code and read as lanes, or the other
/// way round.
template <class T>
struct LaneBuffer {
    alignas(64) float values[LaneTraits<T>::kWidth];

    LaneBuffer() = default;
    explicit LaneBuffer(const T& lanes) { storeLanes<T>(values, lanes); }
    float& operator[](int lane) { return values[lane]; }
    float operator[](int lane) const { return values[lane]; }
    T lanes() const { return loadLanes<T>(values); }
};
template <class T>
struct LaneBuffer3 {
    LaneBuffer<T> x, y, z;

    LaneBuffer3() = default;
    explicit LaneBuffer3(const Vec3<T>& v) : x(v.x), y(v.y), z(v.z) {}
    void set(int lane, const Float3& v) {
        x[lane] = v.x;
        y[lane] = v.y;
        z[lane] = v.z;
    }
    Float3 get(int lane) const { return {x[lane], y[lane], z[lane]}; }
    Vec3<T> lanes() const { return {x.lanes(), y.lanes(), z.lanes()}; }
};

} // namespace mbfeat
