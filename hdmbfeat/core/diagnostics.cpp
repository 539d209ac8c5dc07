#include "core/diagnostics.h"

#include <algorithm>
#include <map>
#include <mutex>

namespace mbfeat {

/// A message that was reported at least once.
struct Diagnostics::Known {
    Severity severity = Severity::kWarning;
    int sections = 0; ///< in which it stands
    bool forwarded = false;
};

struct Diagnostics::Shared {
    mutable std::mutex mutex;
    std::shared_ptr<const Handler> handler; ///< null: nobody listens
    std::vector<Message> messages;
    std::map<std::pair<std::string, std::string>, Known> known; ///< by subject and text
    int counts[3] = {0, 0, 0};                                  ///< of what stands
};

Diagnostics::Diagnostics() : shared_(std::make_shared<Shared>()) {}

Diagnostics::Diagnostics(Diagnostics& whole) : shared_(whole.shared_) {}

Diagnostics::~Diagnostics() {
    withdraw();
}

void Diagnostics::setHandler(Handler handler) {
    auto next = handler ? std::make_shared<const Handler>(std::move(handler)) : nullptr;
    const std::lock_guard lock(shared_->mutex);
    shared_->handler.swap(next);
}

void Diagnostics::report(Severity severity, const std::string& subject, const std::string& text) {
    std::shared_ptr<const Handler> handler;
    {
        const std::lock_guard lock(shared_->mutex);
        Known* const known =
            &shared_->known.try_emplace({subject, text}, Known{severity}).first->second;
        const auto place = std::lower_bound(standing_.begin(), standing_.end(), known);
        if (place == standing_.end() || *place != known) {
            standing_.insert(place, known);
            if (known->sections++ == 0) {
                ++shared_->counts[static_cast<int>(known->severity)];
            }
        }
        if (std::exchange(known->forwarded, true)) {
            return;
        }
        shared_->messages.push_back({severity, subject, text});
        handler = shared_->handler;
    }
    // Without the lock: a host's handler may do anything, also report something.
    if (handler) {
        (*handler)({severity, subject, text});
    }
}

int Diagnostics::count(Severity severity) const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->counts[static_cast<int>(severity)];
}

std::vector<Message> Diagnostics::messages() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->messages;
}

void Diagnostics::withdraw() {
    if (standing_.empty()) { // most sections never have anything to say
        return;
    }
    const std::lock_guard lock(shared_->mutex);
    for (Known* const known : standing_) {
        if (--known->sections == 0) {
            --shared_->counts[static_cast<int>(known->severity)];
        }
    }
    standing_.clear();
}

void Diagnostics::clear() {
    withdraw();
    const std::lock_guard lock(shared_->mutex);
    shared_->messages.clear();
    for (auto& [text, known] : shared_->known) {
        known.forwarded = false;
    }
}

} // namespace mbfeat
