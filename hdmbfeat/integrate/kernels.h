// The kernels that there are, and which one this machine runs.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/settings.h"
#include "integrate/pathWorker.h"
#include "shading/bsdf.h"

namespace mbfeat {

/// A kernel by its setting. kAuto is the widest that the processor runs; one that it cannot run
/// becomes the widest that it can.
Kernel chooseKernel(Kernel wanted);
/// Whether this build has the AVX-512 kernel at all.
bool wideKernelIsBuilt();
/// What a user should know of a choice that could not be had; empty where all is well.
std::string kernelProblem(Kernel wanted);
/// "scalar", "avx2" or "avx512".
const char* kernelName(Kernel kernel);

// The SIMD kernels are built for these sets of parts of the closure (BsdfPart), a set after its
// subsets. More sets would be more code to build for less to gain.
inline constexpr std::uint32_t kDiffuseParts = 0;
inline constexpr std::uint32_t kOpaqueParts = kBsdfReflection;
inline constexpr std::uint32_t kGlassParts = kBsdfReflection | kBsdfTransmission;
inline constexpr std::uint32_t kCoatedParts =
    kBsdfReflection | kBsdfClearcoat | kBsdfSpecularWorkflow;
inline constexpr std::uint32_t kPrebuiltParts[] = {kDiffuseParts, kOpaqueParts, kGlassParts,
                                                   kCoatedParts, kAllBsdfParts};

/// The first prebuilt set that has these parts. The scalar kernel, as the reference, has them all.
std::uint32_t choosePrebuilt(Kernel kernel, std::uint32_t parts);
/// "diffuse", "opaque", "glass", "coated" or "full".
const char* prebuiltName(std::uint32_t prebuilt);

/// A worker for batches of up to `capacity` paths, each of which may become `branches`.
/// `allFields`: the first vertex without a delta is recorded, or lights have multipliers.
/// `recordFlags`: the parts of the record that there is room for. `parts`: of the closure, what
/// surfaces of the scene have.
std::unique_ptr<PathWorker> makePathWorker(Kernel kernel, int capacity, int branches,
                                           bool allFields, std::uint32_t recordFlags,
                                           std::uint32_t parts);

PathWorker* makeScalarWorker(int capacity, int branches, bool allFields, std::uint32_t recordFlags);

} // namespace mbfeat

/// The SIMD kernel of the library's own instruction set for one of kPrebuiltParts; the caller owns
/// the worker.
extern "C" mbfeat::PathWorker* makeLanesWorker(int capacity, int branches, bool allFields,
                                               std::uint32_t recordFlags, std::uint32_t parts);
