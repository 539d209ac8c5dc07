// What a film is made of: zeroed memory, runs of record values, the running spread. Internal.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include "core/vec.h"

namespace mbfeat {

inline constexpr int kWord = 4; ///< bytes of a float or an int32 of the record
static_assert(sizeof(float) == kWord && sizeof(std::int32_t) == kWord);

/// Memory that the system hands out zeroed and page by page on first touch, so that a film costs
/// what was rendered into it.
template <class T>
class ZeroedArray {
public:
    explicit ZeroedArray(std::size_t size)
        : size_(size),
          data_(static_cast<T*>(std::calloc(std::max<std::size_t>(size, 1), sizeof(T)))) {
        if (!data_) {
            throw std::bad_alloc();
        }
    }
    T* data() { return data_.get(); }
    const T* data() const { return data_.get(); }
    std::size_t bytes() const { return size_ * sizeof(T); }

private:
    struct Free {
        void operator()(T* memory) const { std::free(memory); }
    };
    std::size_t size_;
    std::unique_ptr<T, Free> data_;
};

/// Consecutive words of the record that go to consecutive accumulators.
struct Run {
    int word = 0; ///< first, counted from the start of the record
    int count = 0;
};

/// Words of the record, each once, as runs; the slot of a word is its place in this order.
class RunList {
public:
    void add(std::size_t byteOffset, int count) {
        for (int i = 0; i < count; ++i) {
            words_.push_back(static_cast<int>(byteOffset / kWord) + i);
        }
    }
    /// Merges what was added; then runs() and slot() are valid.
    void finish() {
        std::sort(words_.begin(), words_.end());
        words_.erase(std::unique(words_.begin(), words_.end()), words_.end());
        for (const int word : words_) {
            if (runs_.empty() || runs_.back().word + runs_.back().count != word) {
                runs_.push_back({word, 0});
            }
            ++runs_.back().count;
        }
    }
    const std::vector<Run>& runs() const { return runs_; }
    int size() const { return static_cast<int>(words_.size()); }
    int slot(std::size_t byteOffset) const {
        const int word = static_cast<int>(byteOffset / kWord);
        return static_cast<int>(std::lower_bound(words_.begin(), words_.end(), word) -
                                words_.begin());
    }

private:
    std::vector<int> words_;
    std::vector<Run> runs_;
};

/// Weighted running mean and spread of the three colour channels, in squared filter weights: with
/// these and the filtered mean m, sum w^2 (x - m)^2 is exact for any weights and never cancels
/// (West 1979, "Updating Mean and Variance Estimates").
struct Spread {
    double weight; ///< sum of w^2
    double mean[3];
    double squares[3]; ///< sum of w^2 (x - mean)^2
};
inline constexpr int kSpreadSize = sizeof(Spread) / sizeof(double);

/// The spread kept in kSpreadSize doubles.
inline Spread readSpread(const double* kept) {
    Spread spread;
    std::memcpy(&spread, kept, sizeof(spread));
    return spread;
}

inline void addToSpread(double* kept, const Rgb& value, double w) {
    Spread spread = readSpread(kept);
    const double v = w * w;
    spread.weight += v;
    if (spread.weight == 0.0) {
        return;
    }
    const double share = v / spread.weight;
    const double x[3] = {value.x, value.y, value.z};
    for (int c = 0; c < 3; ++c) {
        const double delta = x[c] - spread.mean[c];
        spread.mean[c] += delta * share;
        spread.squares[c] += v * delta * (x[c] - spread.mean[c]);
    }
    std::memcpy(kept, &spread, sizeof(spread));
}

} // namespace mbfeat
