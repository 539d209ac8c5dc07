#include "film/host.h"

#include <csignal>
#include <mutex>

namespace mbfeat {

namespace {

// What the signal handler touches lies outside the Host, in lock-free atomics: a handler may run
// while the Host is being made, and may take no lock.
std::atomic<bool> gStopRequested{false};
std::atomic<int> gInterrupts{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

extern "C" void onInterrupt(int signalNumber) {
    gStopRequested.store(true, std::memory_order_relaxed);
    if (gInterrupts.fetch_add(1, std::memory_order_relaxed) > 0) {
        // Pending until this handler returns, then the process ends as by an unhandled signal.
        std::signal(signalNumber, SIG_DFL);
        std::raise(signalNumber);
    }
}

} // namespace

struct Host::Impl {
    mutable std::mutex mutex;
    std::vector<std::pair<std::string, std::string>> overrides;
    std::string stage;
    ProgressStyle progressStyle = ProgressStyle::kLines;
    std::shared_ptr<const FinishedFrame> lastFrame;
    mutable std::recursive_mutex messageMutex; // a handler may cause the next message
    std::function<void(const Message&)> messageHandler;
    bool handlerInstalled = false;
    struct sigaction previousHandler = {};
};

Host::Host() : impl_(std::make_unique<Impl>()) {}
Host::~Host() = default;

Host& Host::instance() {
    // Never destroyed: render threads of a host that exits in a hurry may still ask it.
    static Host* const host = new Host; // NOLINT(cppcoreguidelines-owning-memory)
    return *host;
}

void Host::setOverrides(std::vector<std::pair<std::string, std::string>> overrides) {
    const std::lock_guard lock(impl_->mutex);
    impl_->overrides = std::move(overrides);
}

std::vector<std::pair<std::string, std::string>> Host::overrides() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->overrides;
}

void Host::setStage(std::string stage) {
    const std::lock_guard lock(impl_->mutex);
    impl_->stage = std::move(stage);
}

std::string Host::stage() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->stage;
}

void Host::requestStop() {
    gStopRequested.store(true, std::memory_order_relaxed);
}

void Host::clearStop() {
    gInterrupts.store(0, std::memory_order_relaxed);
    gStopRequested.store(false, std::memory_order_relaxed);
}

bool Host::stopRequested() const {
    return gStopRequested.load(std::memory_order_relaxed);
}

void Host::installInterruptHandler() {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->handlerInstalled) {
        return;
    }
    gInterrupts.store(0, std::memory_order_relaxed);
    struct sigaction action = {};
    action.sa_handler = onInterrupt;
    sigemptyset(&action.sa_mask);
    action.sa_flags = SA_RESTART;
    impl_->handlerInstalled = sigaction(SIGINT, &action, &impl_->previousHandler) == 0;
}

void Host::restoreInterruptHandler() {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->handlerInstalled) {
        sigaction(SIGINT, &impl_->previousHandler, nullptr);
        impl_->handlerInstalled = false;
    }
}

void Host::setProgressStyle(ProgressStyle style) {
    const std::lock_guard lock(impl_->mutex);
    impl_->progressStyle = style;
}

Host::ProgressStyle Host::progressStyle() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->progressStyle;
}

void Host::setMessageHandler(std::function<void(const Message&)> handler) {
    const std::lock_guard lock(impl_->messageMutex);
    impl_->messageHandler = std::move(handler);
}

bool Host::deliver(const Message& message) const {
    const std::lock_guard lock(impl_->messageMutex);
    if (!impl_->messageHandler) {
        return false;
    }
    impl_->messageHandler(message);
    return true;
}

void Host::publish(std::shared_ptr<const FinishedFrame> frame) {
    const std::lock_guard lock(impl_->mutex);
    // The replaced frame dies after the lock is gone: freeing films takes a while.
    impl_->lastFrame.swap(frame);
}

std::shared_ptr<const FinishedFrame> Host::lastFrame() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->lastFrame;
}

void Host::dropLastFrame() {
    publish(nullptr);
}

} // namespace mbfeat
