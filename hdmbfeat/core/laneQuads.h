// Lanes and rows: four neighbouring floats of each lane's row in memory, as four lane values.
//
// Where a value of every path is wanted, and then its neighbours, whole pieces of rows transposed
// in registers cost a fraction of gathers and scatters, which touch memory value by value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/laneMemory.h"

/// Compilers find these too large to inline, and a call would pass all lanes through memory.
#if defined(__GNUC__)
#define MBFEAT_INLINE __attribute__((always_inline)) inline
#else
#define MBFEAT_INLINE inline
#endif

namespace mbfeat {

/// Four values a lane.
template <class T>
struct LaneQuad {
    T x, y, z, w;

    LaneQuad() = default;
    LaneQuad(const T& x, const T& y, const T& z, const T& w) : x(x), y(y), z(z), w(w) {}
    LaneQuad(const Vec3<T>& v, const T& w) : x(v.x), y(v.y), z(v.z), w(w) {}
    Vec3<T> xyz() const { return {x, y, z}; }
};

/// The bits of a lane as an integer, and back.
inline std::int32_t bitsOf(float value) {
    std::int32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    return bits;
}
inline float valueOfBits(std::int32_t bits) {
    float value = 0.0F;
    std::memcpy(&value, &bits, sizeof(value));
    return value;
}
template <class A>
xsimd::batch<std::int32_t, A> bitsOf(const xsimd::batch<float, A>& value) {
    return xsimd::bitwise_cast<xsimd::batch<std::int32_t, A>>(value);
}
template <class A>
xsimd::batch<float, A> valueOfBits(const xsimd::batch<std::int32_t, A>& bits) {
    return xsimd::bitwise_cast<xsimd::batch<float, A>>(bits);
}

namespace quads {

#if defined(__AVX512F__)
/// Within each quarter: rows a, b, c, d become columns. Its own inverse.
inline void transpose(__m512& a, __m512& b, __m512& c, __m512& d) {
    const __m512d ab = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
    const __m512d abHigh = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
    const __m512d cd = _mm512_castps_pd(_mm512_unpacklo_ps(c, d));
    const __m512d cdHigh = _mm512_castps_pd(_mm512_unpackhi_ps(c, d));
    a = _mm512_castpd_ps(_mm512_unpacklo_pd(ab, cd));
    b = _mm512_castpd_ps(_mm512_unpackhi_pd(ab, cd));
    c = _mm512_castpd_ps(_mm512_unpacklo_pd(abHigh, cdHigh));
    d = _mm512_castpd_ps(_mm512_unpackhi_pd(abHigh, cdHigh));
}
#endif
#if defined(__AVX2__)
inline void transpose(__m256& a, __m256& b, __m256& c, __m256& d) {
    const __m256d ab = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
    const __m256d abHigh = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
    const __m256d cd = _mm256_castps_pd(_mm256_unpacklo_ps(c, d));
    const __m256d cdHigh = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
    a = _mm256_castpd_ps(_mm256_unpacklo_pd(ab, cd));
    b = _mm256_castpd_ps(_mm256_unpackhi_pd(ab, cd));
    c = _mm256_castpd_ps(_mm256_unpacklo_pd(abHigh, cdHigh));
    d = _mm256_castpd_ps(_mm256_unpackhi_pd(abHigh, cdHigh));
}
#endif

} // namespace quads

/// Lane i from at(i), a pointer to floats of any alignment, and the three floats behind it.
template <class T, class At>
MBFEAT_INLINE LaneQuad<T> loadQuadsAt(const At& at) {
    if constexpr (!kIsBatch<T>) {
        float row[4]; // rows may hold integers among the floats
        std::memcpy(row, at(0), sizeof(row));
        return {T(row[0]), T(row[1]), T(row[2]), T(row[3])};
    }
#if defined(__AVX512F__)
    else if constexpr (LaneTraits<T>::kWidth == 16) {
        const auto four = [&](int i) {
            __m512 rowsOf = _mm512_castps128_ps512(_mm_loadu_ps(at(i)));
            rowsOf = _mm512_insertf32x4(rowsOf, _mm_loadu_ps(at(i + 4)), 1);
            rowsOf = _mm512_insertf32x4(rowsOf, _mm_loadu_ps(at(i + 8)), 2);
            return _mm512_insertf32x4(rowsOf, _mm_loadu_ps(at(i + 12)), 3);
        };
        __m512 a = four(0), b = four(1), c = four(2), d = four(3);
        quads::transpose(a, b, c, d);
        return {T(a), T(b), T(c), T(d)};
    }
#endif
#if defined(__AVX2__)
    else if constexpr (LaneTraits<T>::kWidth == 8) {
        const auto two = [&](int i) {
            return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(at(i))),
                                        _mm_loadu_ps(at(i + 4)), 1);
        };
        __m256 a = two(0), b = two(1), c = two(2), d = two(3);
        quads::transpose(a, b, c, d);
        return {T(a), T(b), T(c), T(d)};
    }
#endif
    else {
        constexpr int kWidth = LaneTraits<T>::kWidth;
        LaneBuffer<T> values[4];
        for (int i = 0; i < kWidth; ++i) {
            float row[4];
            std::memcpy(row, at(i), sizeof(row));
            for (int c = 0; c < 4; ++c) {
                values[c][i] = row[c];
            }
        }
        return {values[0].lanes(), values[1].lanes(), values[2].lanes(), values[3].lanes()};
    }
}

/// Lane i from base[rows[i] * stride] on.
template <class T>
MBFEAT_INLINE LaneQuad<T> loadQuads(const float* base, const std::int32_t* rows,
                                    std::size_t stride) {
    return loadQuadsAt<T>([&](int i) { return base + static_cast<std::size_t>(rows[i]) * stride; });
}

/// The inverse of loadQuadsAt(); where rows are shared the later lane's values stay.
template <class T, class At>
MBFEAT_INLINE void storeQuadsAt(const At& at, const LaneQuad<T>& quad) {
    if constexpr (!kIsBatch<T>) {
        const float row[4] = {static_cast<float>(quad.x), static_cast<float>(quad.y),
                              static_cast<float>(quad.z), static_cast<float>(quad.w)};
        std::memcpy(at(0), row, sizeof(row));
    }
#if defined(__AVX512F__)
    else if constexpr (LaneTraits<T>::kWidth == 16) {
        __m512 rowsOf[4] = {quad.x, quad.y, quad.z, quad.w};
        quads::transpose(rowsOf[0], rowsOf[1], rowsOf[2], rowsOf[3]);
        for (int i = 0; i < 4; ++i) {
            _mm_storeu_ps(at(i), _mm512_castps512_ps128(rowsOf[i]));
        }
        for (int i = 0; i < 4; ++i) {
            _mm_storeu_ps(at(i + 4), _mm512_extractf32x4_ps(rowsOf[i], 1));
        }
        for (int i = 0; i < 4; ++i) {
            _mm_storeu_ps(at(i + 8), _mm512_extractf32x4_ps(rowsOf[i], 2));
        }
        for (int i = 0; i < 4; ++i) {
            _mm_storeu_ps(at(i + 12), _mm512_extractf32x4_ps(rowsOf[i], 3));
        }
    }
#endif
#if defined(__AVX2__)
    else if constexpr (LaneTraits<T>::kWidth == 8) {
        __m256 rowsOf[4] = {quad.x, quad.y, quad.z, quad.w};
        quads::transpose(rowsOf[0], rowsOf[1], rowsOf[2], rowsOf[3]);
        for (int i = 0; i < 4; ++i) {
            _mm_storeu_ps(at(i), _mm256_castps256_ps128(rowsOf[i]));
        }
        for (int i = 0; i < 4; ++i) {
            _mm_storeu_ps(at(i + 4), _mm256_extractf128_ps(rowsOf[i], 1));
        }
    }
#endif
    else {
        constexpr int kWidth = LaneTraits<T>::kWidth;
        const LaneBuffer<T> values[4] = {LaneBuffer<T>(quad.x), LaneBuffer<T>(quad.y),
                                         LaneBuffer<T>(quad.z), LaneBuffer<T>(quad.w)};
        for (int i = 0; i < kWidth; ++i) {
            const float row[4] = {values[0][i], values[1][i], values[2][i], values[3][i]};
            std::memcpy(at(i), row, sizeof(row));
        }
    }
}

template <class T>
MBFEAT_INLINE void storeQuads(float* base, const std::int32_t* rows, std::size_t stride,
                              const LaneQuad<T>& quad) {
    storeQuadsAt<T>([&](int i) { return base + static_cast<std::size_t>(rows[i]) * stride; }, quad);
}

} // namespace mbfeat
