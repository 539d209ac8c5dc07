// The part of ONNX Runtime's C interface that is used: opaque types, and functions by position.
// Internal to onnxRuntime.cpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace mbfeat::ort {

struct Env;
struct Status;
struct Session;
struct SessionOptions;
struct Value;
struct MemoryInfo;
struct TensorInfo;
struct Metadata;
struct Allocator;
struct RunOptions;

inline constexpr std::uint32_t kVersion = 21;
inline constexpr int kWarnings = 2;
inline constexpr int kArena = 1, kDefaultMemory = 0;
inline constexpr int kFloat = 1;
inline constexpr int kAllOptimisations = 99;

/// The table that GetApi() gives; functions return null where they succeeded, unless they release.
class Api {
public:
    explicit Api(const void* table) : table_(static_cast<void* const*>(table)) {}

    template <class... Arguments>
    Status* call(std::size_t position, Arguments... arguments) const {
        return reinterpret_cast<Status* (*)(Arguments...)>(table_[position])(arguments...);
    }
    template <class T>
    void release(std::size_t position, T* object) const {
        reinterpret_cast<void (*)(T*)>(table_[position])(object);
    }
    const char* message(const Status* status) const {
        return reinterpret_cast<const char* (*)(const Status*)>(table_[kGetErrorMessage])(status);
    }

    static constexpr std::size_t kGetErrorMessage = 2;

private:
    void* const* table_;
};

enum Position : std::size_t {
    kCreateEnv = 3,
    kCreateSessionFromArray = 8,
    kRun = 9,
    kCreateSessionOptions = 10,
    kSetGraphOptimisation = 23,
    kSetIntraThreads = 24,
    kSetInterThreads = 25,
    kInputCount = 30,
    kOutputCount = 31,
    kInputName = 36,
    kOutputName = 37,
    kCreateTensor = 49,
    kTensorData = 51,
    kElementType = 60,
    kDimensionCount = 61,
    kDimensions = 62,
    kTensorShape = 65,
    kCreateMemoryInfo = 69,
    kFree = 76,
    kDefaultAllocator = 78,
    kReleaseEnv = 92,
    kReleaseStatus = 93,
    kReleaseMemoryInfo = 94,
    kReleaseSession = 95,
    kReleaseValue = 96,
    kReleaseTensorInfo = 99,
    kReleaseSessionOptions = 100,
    kGetMetadata = 111,
    kLookUpMetadata = 116,
    kReleaseMetadata = 118,
    kAddConfigEntry = 130,
};

/// What OrtGetApiBase() returns.
struct Base {
    const void* (*getApi)(std::uint32_t version);
    const char* (*getVersion)();
};

} // namespace mbfeat::ort
