#include "denoise/onnxRuntime.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <optional>
#include <system_error>
#include <utility>

#include <dlfcn.h>

#include "core/floatTraps.h"
#include "core/library.h"
#include "denoise/onnxApi.h"

namespace mbfeat {

namespace {

constexpr const char* kSubject = "ONNX Runtime";
constexpr const char* kFile = "libonnxruntime.so.1";

/// libonnxruntime.so.* in that folder, or nothing.
std::optional<std::string> libraryIn(const std::filesystem::path& folder) {
    std::error_code ignored; // a folder that cannot be read holds nothing
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
        if (entry.path().filename().string().rfind("libonnxruntime.so", 0) == 0) {
            return entry.path().string();
        }
    }
    return std::nullopt;
}

/// Files to try, in order.
std::vector<std::string> candidates() {
    if (const char* const named = std::getenv("MBFEAT_ONNXRUNTIME");
        named != nullptr && *named != '\0') {
        return {named};
    }
    const std::filesystem::path here = libraryFolder();
    std::vector<std::string> files{(here / kFile).string()};
    // Of Python packages: mbfeat/lib lies beside onnxruntime/capi.
    if (const auto found = libraryIn(here / ".." / ".." / "onnxruntime" / "capi")) {
        files.push_back(*found);
    }
    files.emplace_back(kFile);
    return files;
}

} // namespace

std::size_t TensorView::size() const {
    return std::accumulate(shape.begin(), shape.end(), std::size_t{1},
                           [](std::size_t n, std::int64_t d) {
                               return n * static_cast<std::size_t>(std::max<std::int64_t>(d, 0));
                           });
}

struct OnnxRuntime::Impl {
    std::string path, version;
    std::optional<ort::Api> api;
    ort::Env* env = nullptr;
    ort::MemoryInfo* memory = nullptr;
    ort::Allocator* allocator = nullptr; ///< the runtime's own, never released

    /// What went wrong, or nothing; releases the status.
    std::optional<std::string> problem(ort::Status* status) const {
        if (status == nullptr) {
            return std::nullopt;
        }
        std::string text = api->message(status);
        api->release(ort::kReleaseStatus, status);
        return text;
    }

    Status load() {
        std::string tried;
        void* library = nullptr;
        for (const std::string& file : candidates()) {
            library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
            if (library != nullptr) {
                path = file;
                break;
            }
            const char* const error = dlerror();
            tried += (tried.empty() ? "" : "; ") + std::string(error != nullptr ? error : file);
        }
        if (library == nullptr) {
            return Error{kSubject, "its library could not be loaded (" + tried +
                                       "), so nothing can be denoised. Install the Python package "
                                       "onnxruntime, or name the library's file in "
                                       "MBFEAT_ONNXRUNTIME."};
        }
        // Never unloaded: it has threads and thread-local objects of its own.
        return start(library);
    }

    Status start(void* library) {
        using GetBase = const ort::Base* (*)();
        const auto getBase = reinterpret_cast<GetBase>(dlsym(library, "OrtGetApiBase"));
        const ort::Base* const base = getBase != nullptr ? getBase() : nullptr;
        if (base == nullptr) {
            return Error{kSubject, path + " is no ONNX Runtime, so nothing can be denoised. Let "
                                          "MBFEAT_ONNXRUNTIME name its library."};
        }
        version = base->getVersion();
        const void* const table = base->getApi(ort::kVersion);
        if (table == nullptr) {
            return Error{kSubject, path + " is version " + version +
                                       ", too old to denoise with. Install 1.21 or newer."};
        }
        api.emplace(table);
        std::optional<std::string> failed =
            problem(api->call(ort::kCreateEnv, ort::kWarnings, "MBFeat", &env));
        if (!failed) {
            failed = problem(
                api->call(ort::kCreateMemoryInfo, ort::kArena, ort::kDefaultMemory, &memory));
        }
        if (!failed) {
            failed = problem(api->call(ort::kDefaultAllocator, &allocator));
        }
        if (failed) {
            return Error{kSubject, path + " could not be started: " + *failed +
                                       ". Nothing can be denoised; reinstall onnxruntime."};
        }
        return std::nullopt;
    }
};

OnnxRuntime::OnnxRuntime() : impl_(std::make_unique<Impl>()) {}

OnnxRuntime::~OnnxRuntime() {
    if (impl_->memory != nullptr) {
        impl_->api->release(ort::kReleaseMemoryInfo, impl_->memory);
    }
    if (impl_->env != nullptr) {
        impl_->api->release(ort::kReleaseEnv, impl_->env);
    }
}

Result<std::shared_ptr<const OnnxRuntime>> OnnxRuntime::instance() {
    // Kept for the process's life: the runtime is not made to be torn down at exit.
    static const auto* const loaded = [] {
        auto runtime = std::shared_ptr<OnnxRuntime>(new OnnxRuntime);
        using Loaded = Result<std::shared_ptr<const OnnxRuntime>>;
        if (Status failed = runtime->impl_->load()) {
            return new Loaded(*failed);
        }
        return new Loaded(std::shared_ptr<const OnnxRuntime>(std::move(runtime)));
    }();
    return *loaded;
}

const std::string& OnnxRuntime::version() const {
    return impl_->version;
}

const std::string& OnnxRuntime::path() const {
    return impl_->path;
}

struct OnnxSession::Impl {
    std::shared_ptr<const OnnxRuntime> runtime;
    std::string name;
    ort::Session* session = nullptr;
    std::vector<std::string> inputs, outputs;

    const OnnxRuntime::Impl& ort() const { return *runtime->impl_; }

    std::optional<std::string> create(const std::string& model, int threads) {
        const ort::Api& api = *ort().api;
        ort::SessionOptions* options = nullptr;
        if (auto failed = ort().problem(api.call(ort::kCreateSessionOptions, &options))) {
            return failed;
        }
        std::optional<std::string> failed = configure(options, threads);
        if (!failed) {
            failed = ort().problem(
                api.call(ort::kCreateSessionFromArray, static_cast<const ort::Env*>(ort().env),
                         static_cast<const void*>(model.data()), model.size(),
                         static_cast<const ort::SessionOptions*>(options), &session));
        }
        api.release(ort::kReleaseSessionOptions, options);
        return failed ? failed : readNames();
    }

    std::optional<std::string> configure(ort::SessionOptions* options, int threads) const {
        const ort::Api& api = *ort().api;
        ort::Status* const statuses[] = {
            api.call(ort::kSetGraphOptimisation, options, ort::kAllOptimisations),
            api.call(ort::kSetIntraThreads, options, threads),
            api.call(ort::kSetInterThreads, options, 1),
            // Threads that wait for work actively would keep the render threads from theirs.
            api.call(ort::kAddConfigEntry, options, "session.intra_op.allow_spinning", "0"),
        };
        std::optional<std::string> failed;
        for (ort::Status* const status : statuses) {
            if (auto text = ort().problem(status)) {
                failed = text;
            }
        }
        return failed;
    }

    std::optional<std::string> readNames() {
        const auto read = [&](ort::Position count, ort::Position name,
                              std::vector<std::string>& names) -> std::optional<std::string> {
            const ort::Api& api = *ort().api;
            std::size_t total = 0;
            const ort::Session* const self = session;
            auto failed = ort().problem(api.call(count, self, &total));
            for (std::size_t i = 0; !failed && i < total; ++i) {
                char* text = nullptr;
                failed = ort().problem(api.call(name, self, i, ort().allocator, &text));
                if (!failed) {
                    names.emplace_back(text);
                    failed = ort().problem(
                        api.call(ort::kFree, ort().allocator, static_cast<void*>(text)));
                }
            }
            return failed;
        };
        auto failed = read(ort::kInputCount, ort::kInputName, inputs);
        return failed ? failed : read(ort::kOutputCount, ort::kOutputName, outputs);
    }

    std::optional<std::string> view(ort::Value* value, TensorView& out) const {
        const ort::Api& api = *ort().api;
        ort::TensorInfo* info = nullptr;
        if (auto failed = ort().problem(
                api.call(ort::kTensorShape, static_cast<const ort::Value*>(value), &info))) {
            return failed;
        }
        const ort::TensorInfo* const shape = info;
        int type = 0;
        std::size_t rank = 0;
        auto failed = ort().problem(api.call(ort::kElementType, shape, &type));
        if (!failed && type != ort::kFloat) {
            failed = "an output is not of float32";
        }
        if (!failed) {
            failed = ort().problem(api.call(ort::kDimensionCount, shape, &rank));
        }
        if (!failed) {
            out.shape.resize(rank);
            failed = ort().problem(api.call(ort::kDimensions, shape, out.shape.data(), rank));
        }
        if (!failed) {
            void* data = nullptr;
            failed = ort().problem(api.call(ort::kTensorData, value, &data));
            out.data = static_cast<float*>(data);
        }
        api.release(ort::kReleaseTensorInfo, info);
        return failed;
    }
};

OnnxSession::OnnxSession() : impl_(std::make_unique<Impl>()) {}

OnnxSession::~OnnxSession() {
    if (impl_->session != nullptr) {
        impl_->ort().api->release(ort::kReleaseSession, impl_->session);
    }
}

Result<std::unique_ptr<OnnxSession>> OnnxSession::open(std::shared_ptr<const OnnxRuntime> runtime,
                                                       const std::string& model,
                                                       const std::string& name, int threads) {
    const FloatTrapsMasked masked;
    std::unique_ptr<OnnxSession> session(new OnnxSession);
    session->impl_->runtime = std::move(runtime);
    session->impl_->name = name;
    if (const auto failed = session->impl_->create(model, threads)) {
        return Error{name, "ONNX Runtime cannot use this network (" + *failed +
                               "). Give a file that training.export wrote."};
    }
    return session;
}

const std::vector<std::string>& OnnxSession::inputs() const {
    return impl_->inputs;
}

const std::vector<std::string>& OnnxSession::outputs() const {
    return impl_->outputs;
}

std::string OnnxSession::metadata(const std::string& key) const {
    const OnnxRuntime::Impl& ort = impl_->ort();
    const ort::Api& api = *ort.api;
    ort::Metadata* all = nullptr;
    if (ort.problem(
            api.call(ort::kGetMetadata, static_cast<const ort::Session*>(impl_->session), &all))) {
        return {};
    }
    char* text = nullptr;
    std::string value;
    if (!ort.problem(api.call(ort::kLookUpMetadata, static_cast<const ort::Metadata*>(all),
                              ort.allocator, key.c_str(), &text)) &&
        text != nullptr) {
        value = text;
        ort.problem(api.call(ort::kFree, ort.allocator, static_cast<void*>(text)));
    }
    api.release(ort::kReleaseMetadata, all);
    return value;
}

struct OnnxSession::Outputs::Values {
    std::shared_ptr<const OnnxRuntime> runtime;
    std::vector<ort::Value*> values;

    explicit Values(std::shared_ptr<const OnnxRuntime> owner) : runtime(std::move(owner)) {}
    ~Values() {
        for (ort::Value* const value : values) {
            if (value != nullptr) {
                runtime->impl_->api->release(ort::kReleaseValue, value);
            }
        }
    }
    Values(const Values&) = delete;
    Values& operator=(const Values&) = delete;
};

OnnxSession::Outputs::Outputs() = default;
OnnxSession::Outputs::Outputs(Outputs&& other) noexcept = default;
OnnxSession::Outputs& OnnxSession::Outputs::operator=(Outputs&& other) noexcept = default;
OnnxSession::Outputs::~Outputs() = default;

Result<OnnxSession::Outputs> OnnxSession::run(const std::vector<TensorView>& inputs) const {
    const FloatTrapsMasked masked;
    const OnnxRuntime::Impl& ort = impl_->ort();
    const ort::Api& api = *ort.api;
    const auto failure = [&](const std::string& text) {
        return Error{impl_->name, "ONNX Runtime could not run this network (" + text + ")."};
    };
    Outputs::Values given(impl_->runtime);
    std::vector<const char*> inputNames, outputNames;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        inputNames.push_back(impl_->inputs[i].c_str());
        given.values.push_back(nullptr);
        const TensorView& tensor = inputs[i];
        if (const auto failed = ort.problem(api.call(
                ort::kCreateTensor, static_cast<const ort::MemoryInfo*>(ort.memory),
                static_cast<void*>(tensor.data), tensor.size() * sizeof(float), tensor.shape.data(),
                tensor.shape.size(), ort::kFloat, &given.values.back()))) {
            return failure(*failed);
        }
    }
    for (const std::string& name : impl_->outputs) {
        outputNames.push_back(name.c_str());
    }
    Outputs outputs;
    outputs.values_ = std::make_unique<Outputs::Values>(impl_->runtime);
    outputs.values_->values.resize(outputNames.size());
    if (const auto failed = ort.problem(
            api.call(ort::kRun, impl_->session, static_cast<const ort::RunOptions*>(nullptr),
                     static_cast<const char* const*>(inputNames.data()),
                     static_cast<ort::Value* const*>(given.values.data()), inputs.size(),
                     static_cast<const char* const*>(outputNames.data()), outputNames.size(),
                     outputs.values_->values.data()))) {
        return failure(*failed);
    }
    for (ort::Value* const value : outputs.values_->values) {
        TensorView tensor;
        if (const auto failed = impl_->view(value, tensor)) {
            return failure(*failed);
        }
        outputs.views_.push_back(std::move(tensor));
    }
    return outputs;
}

} // namespace mbfeat
