// The kernel on SIMD lanes, as wide as this translation unit's instruction set allows. It is
// compiled into the library, and once more with wider vectors into a module of its own
// (CMakeLists.txt): inline functions compiled for the wider set must not be merged with the
// library's.
#if defined(__GNUC__) && !defined(__clang__)
// GCC 12's own AVX-512 intrinsics start from variables that they leave undefined.
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "integrate/kernel/pathKernel.h"
#include "integrate/kernels.h"

#ifndef MBFEAT_KERNEL_FACTORY
#define MBFEAT_KERNEL_FACTORY makeLanesWorker
#endif

extern "C" __attribute__((visibility("default"))) mbfeat::PathWorker*
MBFEAT_KERNEL_FACTORY(int capacity, bool allFields) {
    return new mbfeat::PathKernel<xsimd::batch<float>>(capacity, allFields);
}
