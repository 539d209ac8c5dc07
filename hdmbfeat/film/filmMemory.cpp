#include "film/filmMemory.h"

#include <mutex>
#include <new>

namespace mbfeat {

namespace {

/// Without a destructor: films may end after static objects do.
struct Spare {
    std::mutex mutex;
    int users = 0;
    std::byte* data = nullptr;
    std::size_t bytes = 0;
};

Spare& spare() {
    static Spare instance;
    return instance;
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
            data_.reset(std::exchange(s.data, nullptr));
            bytes_ = std::exchange(s.bytes, 0);
            return;
        }
    }
    data_.reset(static_cast<std::byte*>(::operator new(bytes)));
}

FilmMemory::~FilmMemory() {
    Spare& s = spare();
    const std::lock_guard<std::mutex> lock(s.mutex);
    if (s.users > 0 && data_ != nullptr) {
        // The newest film is the best guess at the next one; the one before is freed.
        std::byte* const newest = data_.release();
        data_.reset(std::exchange(s.data, newest));
        s.bytes = bytes_;
    }
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
        ::operator delete(std::exchange(s.data, nullptr));
        s.bytes = 0;
    }
}

} // namespace mbfeat
