#include <cerrno>
#include <system_error>

#include "film/exrWriter.h"

namespace mbfeat {

CheckedFileStream::CheckedFileStream(const std::string& path)
    : Imf::OStream(path.c_str()),
      file_(std::fopen(path.c_str(), "wb")) {
    if (!file_) {
        fail();
    }
}

void CheckedFileStream::fail() {
    if (error_ == 0) {
        error_ = errno != 0 ? errno : EIO;
    }
    throw std::system_error(error_, std::generic_category());
}

void CheckedFileStream::write(const char bytes[], int count) {
    const auto size = static_cast<std::size_t>(count);
    errno = 0;
    if (std::fwrite(bytes, 1, size, file_.get()) != size) {
        fail();
    }
}

std::uint64_t CheckedFileStream::tellp() {
    errno = 0;
    const off_t position = ftello(file_.get());
    if (position < 0) {
        fail();
    }
    return static_cast<std::uint64_t>(position);
}

void CheckedFileStream::seekp(std::uint64_t position) {
    errno = 0;
    if (fseeko(file_.get(), static_cast<off_t>(position), SEEK_SET) != 0) {
        fail();
    }
}

void CheckedFileStream::close() {
    errno = 0;
    const bool closed = std::fclose(file_.release()) == 0;
    if (!closed || error_ != 0) {
        fail();
    }
}

} // namespace mbfeat
