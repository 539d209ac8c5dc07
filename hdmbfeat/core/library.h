// Where this library lies, and its module of code for wide vectors.
#pragma once

#include <string>

namespace mbfeat {

/// Folder of the shared library that this code is in; "." where the loader doesn't say.
std::string libraryFolder();

/// libmbfeat_avx512.so beside this library: what was compiled once more for AVX-512. It is loaded
/// by the first call and stays loaded. Any thread.
class WideModule {
public:
    static const WideModule& instance();
    /// Whether this build has the module at all.
    static bool isBuilt();

    /// A function of the module; null where the processor, the build or the file is lacking.
    void* symbol(const char* name) const;
    bool isSupported() const { return supported_; } ///< by the processor
    /// What the loader said where the module should be there but could not be loaded.
    const std::string& problem() const { return problem_; }

private:
    WideModule();
    void* handle_ = nullptr;
    bool supported_ = false;
    std::string problem_;
};

/// The module's function of that name, or where it is lacking `narrow`, of the same signature.
template <class Function>
Function widest(const char* name, Function narrow) {
    const auto wide = reinterpret_cast<Function>(WideModule::instance().symbol(name));
    return wide != nullptr ? wide : narrow;
}

} // namespace mbfeat
