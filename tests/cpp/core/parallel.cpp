#include "core/parallel.h"

#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "support/check.h"

using namespace mbfeat;

TEST_CASE("every index is done exactly once, for any number of threads and chunk") {
    for (const int threads : {1, 2, 7}) {
        ThreadPool pool(threads);
        CHECK(pool.threadCount() == threads);
        for (const std::int64_t chunk : {0, 1, 3, 1000}) {
            std::vector<std::atomic<int>> count(503);
            std::atomic<bool> badThread{false};
            const bool complete =
                pool.run(-3, 500, chunk, nullptr, [&](std::int64_t index, int thread) {
                    count[static_cast<std::size_t>(index + 3)].fetch_add(1);
                    if (thread < 0 || thread >= threads) {
                        badThread = true;
                    }
                });
            CHECK(complete);
            CHECK_FALSE(badThread.load());
            for (const std::atomic<int>& c : count) {
                CHECK(c.load() == 1);
            }
        }
    }
}

TEST_CASE("an empty range is complete at once") {
    ThreadPool pool(2);
    CHECK(pool.run(5, 5, 1, nullptr, [](std::int64_t, int) { FAIL("no index to do"); }));
}

TEST_CASE("a stop is seen after one chunk and reported") {
    for (const int threads : {1, 3}) {
        ThreadPool pool(threads);
        std::atomic<bool> stop{false};
        std::atomic<int> done{0};
        const bool complete = pool.run(0, 1000000, 4, &stop, [&](std::int64_t, int) {
            if (done.fetch_add(1) == 10) {
                stop = true;
            }
        });
        CHECK_FALSE(complete);
        CHECK(done.load() < 1000000 / 2);
        // The pool can be used again.
        stop = false;
        CHECK(pool.run(0, 10, 1, &stop, [](std::int64_t, int) {}));
    }
}

TEST_CASE("no two threads share a thread number") {
    ThreadPool pool(4);
    std::mutex mutex;
    std::set<std::pair<int, std::thread::id>> seen;
    pool.run(0, 2000, 1, nullptr, [&](std::int64_t, int thread) {
        const std::lock_guard<std::mutex> lock(mutex);
        seen.insert({thread, std::this_thread::get_id()});
    });
    std::set<int> numbers;
    for (const auto& entry : seen) {
        numbers.insert(entry.first);
    }
    CHECK(numbers.size() == seen.size());
}

TEST_CASE("loops on threads of their own do the same") {
    std::atomic<std::int64_t> sum{0};
    CHECK(parallelFor(0, 1001, 10, 0, nullptr, [&](std::int64_t i, int) { sum += i; }));
    CHECK(sum.load() == 500500);
    CHECK(hardwareThreads() >= 1);
}
