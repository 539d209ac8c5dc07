#include "core/library.h"

#include <dlfcn.h>

namespace mbfeat {

std::string libraryFolder() {
    Dl_info info{};
    if (dladdr(reinterpret_cast<const void*>(&libraryFolder), &info) == 0) {
        return ".";
    }
    const std::string path = info.dli_fname;
    const std::size_t slash = path.rfind('/');
    return slash == std::string::npos ? std::string(".") : path.substr(0, slash);
}

const WideModule& WideModule::instance() {
    static const WideModule module;
    return module;
}

bool WideModule::isBuilt() {
#if defined(MBFEAT_WIDE_MODULE)
    return true;
#else
    return false;
#endif
}

WideModule::WideModule()
    : supported_(__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                 __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                 __builtin_cpu_supports("avx512vl")) {
    if (!supported_ || !isBuilt()) {
        return;
    }
    const std::string path = libraryFolder() + "/libmbfeat_avx512.so";
    handle_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle_ == nullptr) {
        const char* const error = dlerror();
        problem_ = error != nullptr ? error : path;
    }
}

void* WideModule::symbol(const char* name) const {
    return handle_ != nullptr ? dlsym(handle_, name) : nullptr;
}

} // namespace mbfeat
