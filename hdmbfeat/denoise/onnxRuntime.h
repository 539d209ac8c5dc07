// ONNX Runtime, loaded at run time: hosts that never denoise need not have it.
//
// Its C interface is a table of functions whose positions never change once they are released
// (https://onnxruntime.ai/docs/api/c, struct OrtApi). Only those that are used are declared, by
// their positions, for version 21 of the interface, which the library has from 1.21 on.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbfeat {

/// A float32 tensor in memory of the caller, row-major.
struct TensorView {
    float* data = nullptr;
    std::vector<std::int64_t> shape;

    std::size_t size() const;
};

/// The library. Any thread.
class OnnxRuntime {
public:
    /// The process's library, loaded by the first call: the file that MBFEAT_ONNXRUNTIME names,
    /// else libonnxruntime.so.1 beside this library, that of the Python package onnxruntime
    /// installed beside this one, and what the system's loader finds. An error says what was tried.
    static Result<std::shared_ptr<const OnnxRuntime>> instance();

    ~OnnxRuntime();
    OnnxRuntime(const OnnxRuntime&) = delete;
    OnnxRuntime& operator=(const OnnxRuntime&) = delete;

    const std::string& version() const;
    /// The file that was loaded.
    const std::string& path() const;

private:
    friend class OnnxSession;
    OnnxRuntime();
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// A network that is ready to run. run() may be called by any number of threads at once.
class OnnxSession {
public:
    /// `model` are the bytes of an ONNX file, `name` what messages call it. `threads` compute one
    /// run together; 1 where the caller runs several at once.
    static Result<std::unique_ptr<OnnxSession>> open(std::shared_ptr<const OnnxRuntime> runtime,
                                                     const std::string& model,
                                                     const std::string& name, int threads);
    ~OnnxSession();
    OnnxSession(const OnnxSession&) = delete;
    OnnxSession& operator=(const OnnxSession&) = delete;

    const std::vector<std::string>& inputs() const;
    const std::vector<std::string>& outputs() const;
    /// An entry of the model's metadata; empty where there is none.
    std::string metadata(const std::string& key) const;

    /// What a run gave, in the order of outputs(); memory of the runtime.
    class Outputs {
    public:
        Outputs();
        Outputs(Outputs&& other) noexcept;
        Outputs& operator=(Outputs&& other) noexcept;
        ~Outputs();
        const TensorView& operator[](std::size_t index) const { return views_[index]; }
        std::size_t size() const { return views_.size(); }

    private:
        friend class OnnxSession;
        struct Values;
        std::unique_ptr<Values> values_;
        std::vector<TensorView> views_;
    };

    /// Runs the network on float32 inputs in the order of inputs(). An error where the runtime
    /// fails or an output is not of float32.
    Result<Outputs> run(const std::vector<TensorView>& inputs) const;

private:
    OnnxSession();
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
