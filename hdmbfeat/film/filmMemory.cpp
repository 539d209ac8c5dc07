#include "film/filmMemory.h"

#include <cstdlib>
#include <mutex>
#include <new>

namespace mbfeat {

namespace {

struct Spare {
    std::mutex mutex;
    int users = 0;
    void* data = nullptr;
    std::size_t bytes = 0;
};

/// Never destroyed: films may end after static objects do.
Spare& spare() {
    static Spare* const instance = new Spare;
    return *instance;
}

} // namespace

FilmMemory::FilmMemory(std::size_t bytes) : bytes_(bytes) {
    if (bytes == 0) {
        return;
    }
    {
        Spare& s = spare();
        const std::lock_guard<std::mutex> lock(s.mutex);
        // A block of more than twice the size would keep from others what nobody needs.
        if (s.bytes >= bytes && s.bytes / 2 <= bytes) {
            data_ = std::exchange(s.data, nullptr);
            bytes_ = std::exchange(s.bytes, 0);
            return;
        }
    }
    data_ = std::malloc(bytes);
    if (data_ == nullptr) {
        throw std::bad_alloc();
    }
}

FilmMemory::~FilmMemory() {
    {
        Spare& s = spare();
        const std::lock_guard<std::mutex> lock(s.mutex);
        if (s.users > 0 && data_ != nullptr) {
            // The newest film is the best guess at the next one.
            std::swap(s.data, data_);
            s.bytes = bytes_;
        }
    }
    std::free(data_);
}

FilmMemoryUser::FilmMemoryUser() {
    Spare& s = spare();
    const std::lock_guard<std::mutex> lock(s.mutex);
    ++s.users;
}

FilmMemoryUser::~FilmMemoryUser() {
    Spare& s = spare();
    const std::lock_guard<std::mutex> lock(s.mutex);
    if (--s.users == 0) {
        std::free(std::exchange(s.data, nullptr));
        s.bytes = 0;
    }
}

} // namespace mbfeat
