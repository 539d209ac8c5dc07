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

/// The AVX-512 kernel's factory; null where the processor or the module is lacking. The module
/// stays loaded: workers may outlive any owner of a handle.
Factory wideFactory() {
    static const Factory factory = [] {
        const bool supported =
            __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
            __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
            __builtin_cpu_supports("avx512vl");
        if (!supported) {
            return Factory(nullptr);
        }
        const std::string path = libraryFolder() + "/libmbfeat_avx512.so";
        void* const module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
        return module != nullptr ? reinterpret_cast<Factory>(dlsym(module, "makeWideLanesWorker"))
                                 : Factory(nullptr);
    }();
    return factory;
}

} // namespace

Kernel chooseKernel(Kernel wanted) {
    if (wanted == Kernel::kScalar || wanted == Kernel::kAvx2) {
        return wanted;
    }
    return wideFactory() != nullptr ? Kernel::kAvx512 : Kernel::kAvx2;
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
        return std::unique_ptr<PathWorker>(wideFactory()(capacity, allFields));
    case Kernel::kAvx2:
    case Kernel::kAuto:
        break;
    }
    return std::unique_ptr<PathWorker>(makeLanesWorker(capacity, allFields));
}

} // namespace mbfeat
