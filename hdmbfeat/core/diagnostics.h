// Errors as values, and the place where warnings collect.
//
// The core throws nothing across its boundary. A function that can fail returns Result<T>; a
// datum that is bad but not fatal is dropped and reported to a Diagnostics sink. The Hydra edge
// turns messages into TF diagnostics; the Python edge into exceptions.
#pragma once

#include <functional>
#include <memory>
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

/// Collects messages; the same (subject, text) is forwarded once, so a bad primvar does not repeat
/// itself every frame.
///
/// A message stands, and counts, until what it is about is looked at anew. What can be mended or go
/// away reports to a section of its own, withdraws it before it checks again, and takes it along
/// when it goes: then the count says what is wrong now, not what ever was. All members may be
/// called from any thread, except that nothing reports to a section while it is withdrawn.
class Diagnostics {
public:
    using Handler = std::function<void(const Message&)>;

    Diagnostics();
    /// A section of `whole`, which it may outlive.
    explicit Diagnostics(Diagnostics& whole);
    /// What was reported here stands no longer.
    ~Diagnostics();
    Diagnostics(const Diagnostics&) = delete;
    Diagnostics& operator=(const Diagnostics&) = delete;

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

    /// Number of distinct messages of that severity that stand, of the whole and all its sections.
    int count(Severity severity) const;
    /// The distinct messages so far, of the whole and all its sections, in order of first
    /// appearance; also those that stand no longer.
    std::vector<Message> messages() const;
    /// What was reported here stands no longer. If it comes again it is not forwarded again.
    void withdraw();
    /// Forgets all messages: none is in messages(), and what comes again is forwarded again. What
    /// sections reported still stands.
    void clear();

private:
    struct Known;
    struct Shared;

    std::shared_ptr<Shared> shared_; ///< of the whole and its sections
    std::vector<Known*> standing_;   ///< reported here; sorted, guarded by the shared mutex
};

} // namespace mbfeat
