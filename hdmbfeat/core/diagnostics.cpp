#include "core/diagnostics.h"

namespace mbfeat {

void Diagnostics::setHandler(Handler handler) {
    auto shared = handler ? std::make_shared<const Handler>(std::move(handler)) : nullptr;
    const std::lock_guard lock(mutex_);
    handler_.swap(shared);
}

void Diagnostics::report(Severity severity, const std::string& subject, const std::string& text) {
    std::shared_ptr<const Handler> handler;
    {
        const std::lock_guard lock(mutex_);
        ++counts_[static_cast<int>(severity)];
        if (seen_[{subject, text}]++ > 0) {
            return;
        }
        messages_.push_back({severity, subject, text});
        handler = handler_;
    }
    // Without the lock: a host's handler may do anything, also report something.
    if (handler) {
        (*handler)({severity, subject, text});
    }
}

int Diagnostics::count(Severity severity) const {
    const std::lock_guard lock(mutex_);
    return counts_[static_cast<int>(severity)];
}

std::vector<Message> Diagnostics::messages() const {
    const std::lock_guard lock(mutex_);
    return messages_;
}

void Diagnostics::clear() {
    const std::lock_guard lock(mutex_);
    messages_.clear();
    seen_.clear();
    counts_[0] = counts_[1] = counts_[2] = 0;
}

} // namespace mbfeat
