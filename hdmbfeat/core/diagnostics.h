// Errors as values, and the place where warnings collect.
//
// The core throws nothing across its boundary. A function that can fail returns Result<T>; a
// datum that is bad but not fatal is dropped and reported to a Diagnostics sink. The Hydra edge
// turns messages into TF diagnostics; the Python edge into exceptions.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace mbfeat {

enum class Severity { kInfo, kWarning, kError };

/// One message for the user. `subject` is the prim path, file or setting it is about; `text` says
/// what is wrong, what was done about it and what to do.
struct Message {
    Severity severity = Severity::kWarning;
    std::string subject;
    std::string text;
};

/// What went wrong, for Result. Same wording rules as Message.
struct Error {
    std::string subject;
    std::string text;
};

template <class T>
class Result {
public:
    Result(T value) : state_(std::move(value)) {}     // NOLINT(google-explicit-constructor)
    Result(Error error) : state_(std::move(error)) {} // NOLINT(google-explicit-constructor)
    explicit operator bool() const { return state_.index() == 0; }
    T& value() { return std::get<0>(state_); }
    const T& value() const { return std::get<0>(state_); }
    const Error& error() const { return std::get<1>(state_); }

private:
    std::variant<T, Error> state_;
};

/// Success, or an error.
using Status = std::optional<Error>;

/// Collects messages; the same (subject, text) is forwarded once and then only counted, so a bad
/// primvar does not repeat itself every frame. All members may be called from any thread.
class Diagnostics {
public:
    using Handler = std::function<void(const Message&)>;

    /// Replaces the receiver of first occurrences. It is called on the reporting thread, by several
    /// at once, and may report itself. A call that has begun may outlast its replacement.
    void setHandler(Handler handler);
    void report(Severity severity, const std::string& subject, const std::string& text);
    void warn(const std::string& subject, const std::string& text) {
        report(Severity::kWarning, subject, text);
    }
    void error(const std::string& subject, const std::string& text) {
        report(Severity::kError, subject, text);
    }

    /// Number of reports of that severity, repeats included.
    int count(Severity severity) const;
    /// The distinct messages so far, in order of first appearance.
    std::vector<Message> messages() const;
    /// Forgets everything (a new stage was loaded).
    void clear();

private:
    mutable std::mutex mutex_;
    std::shared_ptr<const Handler> handler_; ///< null: nobody listens
    std::vector<Message> messages_;
    std::map<std::pair<std::string, std::string>, int> seen_;
    int counts_[3] = {0, 0, 0};
};

} // namespace mbfeat
