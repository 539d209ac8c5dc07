// The number of samples of a pixel, which also keeps its writer and its readers apart. Internal.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

namespace mbfeat {

/// Zeroed memory is a valid object: no samples, nobody at it. A pixel is held for the time that one
/// sample is added or one value read, and hardly ever by two at once, so holding it costs one
/// uncontended atomic operation on a word that is needed anyway.
class PixelCount {
public:
    std::uint32_t load() const { return word_.load(std::memory_order_acquire) & ~kHeld; }

private:
    friend class HeldPixel;
    static constexpr std::uint32_t kHeld = 0x80000000U;

    /// Waits until nobody holds the pixel; the count.
    std::uint32_t hold() const {
        for (int attempt = 1;; ++attempt) {
            std::uint32_t word = word_.load(std::memory_order_relaxed);
            if ((word & kHeld) == 0 &&
                word_.compare_exchange_weak(word, word | kHeld, std::memory_order_acquire,
                                            std::memory_order_relaxed)) {
                return word;
            }
            if (attempt % 64 == 0) { // who holds it may wait for a core
                std::this_thread::yield();
            }
        }
    }
    void release(std::uint32_t count) const { word_.store(count, std::memory_order_release); }

    mutable std::atomic<std::uint32_t> word_;
};
static_assert(sizeof(PixelCount) == sizeof(std::uint32_t) &&
              std::atomic<std::uint32_t>::is_always_lock_free);

/// Holds a pixel; what its accumulators hold may be read and written meanwhile.
class HeldPixel {
public:
    explicit HeldPixel(const PixelCount& pixel) : pixel_(pixel), count_(pixel.hold()) {}
    ~HeldPixel() { pixel_.release(count_); }
    HeldPixel(const HeldPixel&) = delete;
    HeldPixel& operator=(const HeldPixel&) = delete;

    std::uint32_t count() const { return count_; }
    /// Seen by others when the pixel is let go.
    void setCount(std::uint32_t count) { count_ = count; }

private:
    const PixelCount& pixel_;
    std::uint32_t count_;
};

} // namespace mbfeat
