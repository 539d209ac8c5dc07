#include "integrate/kernels.h"

#include "core/library.h"

namespace mbfeat {

namespace {

using Factory = PathWorker* (*)(int capacity, int branches, bool allFields,
                                std::uint32_t recordFlags, std::uint32_t parts);

/// The AVX-512 kernel's factory; null where the processor or the module is lacking. The module
/// stays loaded: workers may outlive any owner of a handle.
Factory wideFactory() {
    static const auto factory =
        reinterpret_cast<Factory>(WideModule::instance().symbol("makeWideLanesWorker"));
    return factory;
}

} // namespace

Kernel chooseKernel(Kernel wanted) {
    if (wanted == Kernel::kScalar || wanted == Kernel::kAvx2) {
        return wanted;
    }
    return wideFactory() != nullptr ? Kernel::kAvx512 : Kernel::kAvx2;
}

bool wideKernelIsBuilt() {
    return WideModule::isBuilt();
}

std::string kernelProblem(Kernel wanted) {
    if (wanted == Kernel::kScalar || wanted == Kernel::kAvx2 || wideFactory() != nullptr) {
        return {};
    }
    if (!wideKernelIsBuilt()) {
        return wanted == Kernel::kAvx512
                   ? "this build has no AVX-512 kernel, so paths are traced by "
                     "the AVX2 kernel: the same image. Set it to auto."
                   : std::string();
    }
    if (WideModule::instance().isSupported()) {
        return "the AVX-512 kernel could not be loaded (" + WideModule::instance().problem() +
               "), so paths are traced by the AVX2 kernel: the same image, but slower. Install "
               "libmbfeat_avx512.so beside libmbfeat.so.";
    }
    return wanted == Kernel::kAvx512 ? "this processor has no AVX-512, so paths are traced by the "
                                       "AVX2 kernel: the same image. Set it to auto."
                                     : std::string();
}

const char* kernelName(Kernel kernel) {
    switch (kernel) {
    case Kernel::kScalar:
        return "scalar";
    case Kernel::kAvx2:
        return "avx2";
    case Kernel::kAvx512:
        return "avx512";
    case Kernel::kAuto:
        break;
    }
    return "auto";
}

std::uint32_t choosePrebuilt(Kernel kernel, std::uint32_t parts) {
    if (chooseKernel(kernel) == Kernel::kScalar) {
        return kAllBsdfParts;
    }
    for (const std::uint32_t prebuilt : kPrebuiltParts) {
        if ((parts & ~prebuilt) == 0) {
            return prebuilt;
        }
    }
    return kAllBsdfParts;
}

const char* prebuiltName(std::uint32_t prebuilt) {
    switch (prebuilt) {
    case kDiffuseParts:
        return "diffuse";
    case kOpaqueParts:
        return "opaque";
    case kGlassParts:
        return "glass";
    case kCoatedParts:
        return "coated";
    default:
        return "full";
    }
}

std::unique_ptr<PathWorker> makePathWorker(Kernel kernel, int capacity, int branches,
                                           bool allFields, std::uint32_t recordFlags,
                                           std::uint32_t parts) {
    const std::uint32_t prebuilt = choosePrebuilt(kernel, parts);
    switch (chooseKernel(kernel)) {
    case Kernel::kScalar:
        return std::unique_ptr<PathWorker>(
            makeScalarWorker(capacity, branches, allFields, recordFlags));
    case Kernel::kAvx512:
        return std::unique_ptr<PathWorker>(
            wideFactory()(capacity, branches, allFields, recordFlags, prebuilt));
    case Kernel::kAvx2:
    case Kernel::kAuto:
        break;
    }
    return std::unique_ptr<PathWorker>(
        makeLanesWorker(capacity, branches, allFields, recordFlags, prebuilt));
}

} // namespace mbfeat
