// A byte string of everything that a render depends on, to tell whether anything changed.
#pragma once

#include <string>
#include <type_traits>

namespace mbfeat {

/// Two sequences of the same add() calls compare equal exactly when all values were equal.
class Fingerprint {
public:
    template <class T>
    void add(const T& value) {
        // Scalars only: structs may have padding, whose bytes mean nothing.
        static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_pointer_v<T>);
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void add(const std::string& text) {
        add(text.size());
        bytes_ += text;
    }

    bool operator==(const Fingerprint& other) const { return bytes_ == other.bytes_; }
    bool operator!=(const Fingerprint& other) const { return bytes_ != other.bytes_; }

private:
    std::string bytes_;
};

} // namespace mbfeat
