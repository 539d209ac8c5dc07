// The kernels that there are, and which one this machine runs.
#pragma once

#include <memory>
#include <string>

#include "core/settings.h"
#include "integrate/pathWorker.h"

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

/// A worker for batches of up to `capacity` paths. `allFields`: the first vertex without a delta is
/// recorded, or lights have multipliers. `kernel` is an answer of chooseKernel().
std::unique_ptr<PathWorker> makePathWorker(Kernel kernel, int capacity, bool allFields);

PathWorker* makeScalarWorker(int capacity, bool allFields);

} // namespace mbfeat

/// The SIMD kernel of the library's own instruction set; the caller owns the worker.
extern "C" mbfeat::PathWorker* makeLanesWorker(int capacity, bool allFields);
