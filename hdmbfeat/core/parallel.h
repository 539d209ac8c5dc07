// Loops over several threads.
//
// Own threads rather than TBB's: a host application owns the TBB arena of the process and sets its
// limits for its own purposes, and a render thread that waits in TBB may be handed a piece of the
// host's work, which can hold a lock that the render needs. Here the number of threads is exactly
// what was asked for, and a stop is seen after one chunk.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

namespace mbfeat {

/// One thread a logical core that this process may use, at least 1.
int hardwareThreads();

/// Threads that wait for loops to run. One loop at a time: run() is called by one thread at once
/// and not from inside a body.
class ThreadPool {
public:
    /// The calling thread of run() takes part, so `threads` - 1 are started. 0 means
    /// hardwareThreads(). Where the system refuses threads the pool has fewer: see threadCount().
    explicit ThreadPool(int threads);
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    int threadCount() const;

    /// Calls body(index, thread) once for every index in [begin, end), in chunks taken in rising
    /// order by whichever thread is free; `thread` is in [0, threadCount()). When `stop` (may be
    /// null) becomes true no more chunks are taken. Returns true if every index was done. body
    /// must not throw.
    bool run(std::int64_t begin, std::int64_t end, std::int64_t chunk,
             const std::atomic<bool>* stop,
             const std::function<void(std::int64_t index, int thread)>& body);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The same on threads of its own, for loops that are rare and long.
bool parallelFor(std::int64_t begin, std::int64_t end, std::int64_t chunk, int threads,
                 const std::atomic<bool>* stop,
                 const std::function<void(std::int64_t index, int thread)>& body);

} // namespace mbfeat
