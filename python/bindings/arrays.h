// Arrays that own their memory.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

namespace mbfeat {

/// A NumPy array of that shape that owns the values.
template <class T>
nanobind::ndarray<nanobind::numpy, T> ownedArray(std::vector<T> values,
                                                 std::initializer_list<std::size_t> shape) {
    auto kept = std::make_unique<std::vector<T>>(std::move(values));
    T* const data = kept->data();
    nanobind::capsule owner(kept.get(), [](void* p) noexcept {
        const std::unique_ptr<std::vector<T>> freed(static_cast<std::vector<T>*>(p));
    });
    kept.release(); // NOLINT(bugprone-unused-return-value): the capsule owns it now
    return nanobind::ndarray<nanobind::numpy, T>(data, shape, owner);
}

} // namespace mbfeat
