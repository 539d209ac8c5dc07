// Memory for the accumulators of films, which hands that of the last film to the next one.
// Internal.
//
// A film of many AOVs is hundreds of bytes a pixel, and memory that is new to the process costs as
// much to touch for the first time as a sample or two. The frames of a sequence, and the views of
// an interactive session, need much the same amount again and again.
//
// Threads: any.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>

namespace mbfeat {

/// Uninitialised memory, aligned for doubles. Throws std::bad_alloc.
class FilmMemory {
public:
    FilmMemory() = default;
    explicit FilmMemory(std::size_t bytes);
    ~FilmMemory();
    FilmMemory(FilmMemory&& o) noexcept { *this = std::move(o); }
    FilmMemory& operator=(FilmMemory&& o) noexcept {
        std::swap(data_, o.data_);
        std::swap(bytes_, o.bytes_);
        return *this;
    }

    void* data() { return data_.get(); }
    const void* data() const { return data_.get(); }
    std::size_t bytes() const { return bytes_; } ///< at least what was asked for

private:
    struct Free {
        void operator()(std::byte* memory) const { ::operator delete(memory); }
    };
    std::unique_ptr<std::byte, Free> data_;
    std::size_t bytes_ = 0;
};

/// While somebody keeps one of these, the memory of a film that ends stays with the process.
class FilmMemoryUser {
public:
    FilmMemoryUser();
    ~FilmMemoryUser();
    FilmMemoryUser(const FilmMemoryUser&) = delete;
    FilmMemoryUser& operator=(const FilmMemoryUser&) = delete;
};

} // namespace mbfeat
