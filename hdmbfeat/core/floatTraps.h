// Floating-point traps around foreign and SIMD code.
//
// The catalogue of hard cases (tests/stability) runs debug builds with traps on for invalid
// operations, divisions by zero and overflows, so that our scalar code cannot make an infinity or a
// NaN unseen. Embree and formulas on SIMD lanes make them on purpose in lanes that nobody reads:
// around these the traps are masked, and what comes out is checked instead.
//
// Nothing here switches traps on that were not on, and release builds hold none of it.
#pragma once

#if !defined(NDEBUG) && defined(__SSE__)
#include <xmmintrin.h>
#define MBFEAT_HAS_FLOAT_TRAPS 1
#else
#define MBFEAT_HAS_FLOAT_TRAPS 0
#endif

namespace mbfeat {

#if MBFEAT_HAS_FLOAT_TRAPS

/// Masks all traps of the thread while it lives.
class FloatTrapsMasked {
public:
    FloatTrapsMasked() : before_(_mm_getcsr() & _MM_MASK_MASK) { setMask(_MM_MASK_MASK); }
    ~FloatTrapsMasked() { setMask(before_); }
    FloatTrapsMasked(const FloatTrapsMasked&) = delete;
    FloatTrapsMasked& operator=(const FloatTrapsMasked&) = delete;

private:
    static void setMask(unsigned mask) {
        _mm_setcsr((_mm_getcsr() & ~static_cast<unsigned>(_MM_MASK_MASK)) | mask);
    }

    unsigned before_;
};

#else

// Not trivial, so that a variable that only lives is no unused one.
class FloatTrapsMasked {
public:
    FloatTrapsMasked() {} // NOLINT(modernize-use-equals-default)
};

#endif

} // namespace mbfeat
