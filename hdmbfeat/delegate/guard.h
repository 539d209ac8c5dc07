// The edge to code that must not see exceptions: whatever is thrown becomes a message.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "core/diagnostics.h"

namespace mbfeat {

/// Runs `work`; an exception is reported with the subject it was about and goes no further.
template <class Work>
void guarded(Diagnostics& diagnostics, const std::string& subject, Work&& work) noexcept {
    try {
        std::forward<Work>(work)();
    } catch (const std::exception& failure) {
        diagnostics.error(subject, std::string("could not be handled (") + failure.what() +
                                       "); it is left as it was. Free memory or simplify it.");
    } catch (...) {
        diagnostics.error(subject, "could not be handled; it is left as it was.");
    }
}

} // namespace mbfeat
