#include "integrate/kernels.h"

#include <dlfcn.h>

namespace mbfeat {

namespace {

using Factory = PathWorker* (*)(int capacity, bool allFields);

/// Folder of the library that this code lies in.
std::string libraryFolder() {
    Dl_info info{};
    if (dladdr(reinterpret_cast<const void*>(&makeLanesWorker), &info) == 0) {
        return {};
    }
    const std::string path = info.dli_fname;
    const std::size_t slash = path.rfind('/');
    return slash == std::string::npos ? std::string(".") : path.substr(0, slash);
}

/// The AVX-512 kernel's factory; null where the processor or the module is lacking, and why. The
/// module stays loaded: workers may outlive any owner of a handle.
struct WideKernel {
    Factory factory = nullptr;
    bool supported = false; ///< by the processor
    std::string problem;    ///< what the loader says
};

WideKernel loadWideKernel() {
    WideKernel wide;
    wide.supported = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                     __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                     __builtin_cpu_supports("avx512vl");
    if (!wide.supported || !wideKernelIsBuilt()) {
        return wide;
    }
    const std::string path = libraryFolder() + "/libmbfeat_avx512.so";
    void* const module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module != nullptr) {
        wide.factory = reinterpret_cast<Factory>(dlsym(module, "makeWideLanesWorker"));
    }
    if (wide.factory == nullptr) {
        const char* const error = dlerror();
        wide.problem = error != nullptr ? error : "makeWideLanesWorker is missing";
    }
    return wide;
}

const WideKernel& wideKernel() {
    static const WideKernel wide = loadWideKernel();
    return wide;
}

} // namespace

Kernel chooseKernel(Kernel wanted) {
    if (wanted == Kernel::kScalar || wanted == Kernel::kAvx2) {
        return wanted;
    }
    return wideKernel().factory != nullptr ? Kernel::kAvx512 : Kernel::kAvx2;
}

bool wideKernelIsBuilt() {
#if defined(MBFEAT_WIDE_KERNEL)
    return true;
#else
    return false;
#endif
}

std::string kernelProblem(Kernel wanted) {
    if (wanted == Kernel::kScalar || wanted == Kernel::kAvx2 || wideKernel().factory != nullptr) {
        return {};
    }
    if (!wideKernelIsBuilt()) {
        return wanted == Kernel::kAvx512
                   ? "this build has no AVX-512 kernel, so paths are traced by "
                     "the AVX2 kernel: the same image. Set it to auto."
                   : std::string();
    }
    if (wideKernel().supported) {
        return "the AVX-512 kernel could not be loaded (" + wideKernel().problem +
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

std::unique_ptr<PathWorker> makePathWorker(Kernel kernel, int capacity, bool allFields) {
    switch (chooseKernel(kernel)) {
    case Kernel::kScalar:
        return std::unique_ptr<PathWorker>(makeScalarWorker(capacity, allFields));
    case Kernel::kAvx512:
        return std::unique_ptr<PathWorker>(wideKernel().factory(capacity, allFields));
    case Kernel::kAvx2:
    case Kernel::kAuto:
        break;
    }
    return std::unique_ptr<PathWorker>(makeLanesWorker(capacity, allFields));
}

} // namespace mbfeat
