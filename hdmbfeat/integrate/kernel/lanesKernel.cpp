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

/// `parts` is one of mbfeat::kPrebuiltParts.
extern "C" __attribute__((visibility("default"))) mbfeat::PathWorker*
MBFEAT_KERNEL_FACTORY(int capacity, int branches, bool allFields, std::uint32_t recordFlags,
                      std::uint32_t parts) {
    using namespace mbfeat;
    using T = xsimd::batch<float>;
    constexpr std::uint32_t kBuilt =
        kBuiltEffects.has(Effect::kReflection) ? closureParts(kBuiltEffects) : 0U;
    switch (parts) {
    case kDiffuseParts:
        return new PathKernel<T, kDiffuseParts & kBuilt>(capacity, branches, allFields,
                                                         recordFlags);
    case kOpaqueParts:
        return new PathKernel<T, kOpaqueParts & kBuilt>(capacity, branches, allFields, recordFlags);
    case kGlassParts:
        return new PathKernel<T, kGlassParts & kBuilt>(capacity, branches, allFields, recordFlags);
    case kCoatedParts:
        return new PathKernel<T, kCoatedParts & kBuilt>(capacity, branches, allFields, recordFlags);
    default:
        return new PathKernel<T, kAllBsdfParts & kBuilt>(capacity, branches, allFields,
                                                         recordFlags);
    }
}
