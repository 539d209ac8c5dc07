// The kernel on single numbers: the reference, which can be stepped through.
#include "integrate/kernel/pathKernel.h"
#include "integrate/kernels.h"

mbfeat::PathWorker* mbfeat::makeScalarWorker(int capacity, int branches, bool allFields,
                                             std::uint32_t recordFlags) {
    return new PathKernel<float, kAllBsdfParts>(capacity, branches, allFields, recordFlags);
}
