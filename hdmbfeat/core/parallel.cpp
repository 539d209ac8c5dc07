#include "core/parallel.h"

#include <sched.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace mbfeat {

int hardwareThreads() {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    if (sched_getaffinity(0, sizeof(allowed), &allowed) == 0) {
        return std::max(1, CPU_COUNT(&allowed));
    }
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

struct ThreadPool::Impl {
    struct Loop {
        std::atomic<std::int64_t> next{0};
        std::int64_t end = 0, chunk = 1;
        const std::atomic<bool>* stop = nullptr;
        const std::function<void(std::int64_t, int)>* body = nullptr;
    };

    std::vector<std::thread> threads;
    std::mutex mutex;
    std::condition_variable started, finished;
    Loop loop;
    std::uint64_t generation = 0; ///< grows with every loop
    std::size_t running = 0;      ///< workers still in the current loop
    bool quit = false;

    void work(int thread) {
        while (loop.stop == nullptr || !loop.stop->load(std::memory_order_relaxed)) {
            const std::int64_t first = loop.next.fetch_add(loop.chunk, std::memory_order_relaxed);
            if (first >= loop.end) {
                return;
            }
            const std::int64_t last = std::min(first + loop.chunk, loop.end);
            for (std::int64_t i = first; i < last; ++i) {
                (*loop.body)(i, thread);
            }
        }
    }

    void serve(int thread) {
        std::uint64_t seen = 0;
        std::unique_lock<std::mutex> lock(mutex);
        for (;;) {
            started.wait(lock, [&] { return quit || generation != seen; });
            if (quit) {
                return;
            }
            seen = generation;
            lock.unlock();
            work(thread);
            lock.lock();
            if (--running == 0) {
                finished.notify_one();
            }
        }
    }
};

ThreadPool::ThreadPool(int threads) : impl_(std::make_unique<Impl>()) {
    const int count = threads > 0 ? threads : hardwareThreads();
    impl_->threads.reserve(static_cast<std::size_t>(count));
    try {
        for (int i = 1; i < count; ++i) {
            impl_->threads.emplace_back([impl = impl_.get(), i] { impl->serve(i); });
        }
    } catch (const std::system_error&) {
        // The system has no more threads to give: those that started do the work.
    }
}

ThreadPool::~ThreadPool() {
    {
        const std::lock_guard<std::mutex> lock(impl_->mutex);
        impl_->quit = true;
    }
    impl_->started.notify_all();
    for (std::thread& thread : impl_->threads) {
        thread.join();
    }
}

int ThreadPool::threadCount() const {
    return static_cast<int>(impl_->threads.size()) + 1;
}

bool ThreadPool::run(std::int64_t begin, std::int64_t end, std::int64_t chunk,
                     const std::atomic<bool>* stop,
                     const std::function<void(std::int64_t, int)>& body) {
    Impl& impl = *impl_;
    std::atomic<std::int64_t> done{0};
    const std::function<void(std::int64_t, int)> counted = [&](std::int64_t index, int thread) {
        body(index, thread);
        done.fetch_add(1, std::memory_order_relaxed);
    };
    {
        const std::lock_guard<std::mutex> lock(impl.mutex);
        impl.loop.next.store(begin, std::memory_order_relaxed);
        impl.loop.end = end;
        impl.loop.chunk = std::max<std::int64_t>(1, chunk);
        impl.loop.stop = stop;
        impl.loop.body = &counted;
        impl.running = impl.threads.size();
        ++impl.generation;
    }
    impl.started.notify_all();
    impl.work(0);
    std::unique_lock<std::mutex> lock(impl.mutex);
    impl.finished.wait(lock, [&] { return impl.running == 0; });
    return done.load(std::memory_order_relaxed) >= end - begin;
}

bool parallelFor(std::int64_t begin, std::int64_t end, std::int64_t chunk, int threads,
                 const std::atomic<bool>* stop,
                 const std::function<void(std::int64_t, int)>& body) {
    ThreadPool pool(threads);
    return pool.run(begin, end, chunk, stop, body);
}

} // namespace mbfeat
