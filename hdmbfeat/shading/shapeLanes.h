// Light shapes of one kind side by side, where each lane has a shape of its own.
#pragma once

#include <algorithm>
#include <cstddef>

#include "core/laneQuads.h"

namespace mbfeat {

/// Lane i is the shape at(i), an X<float>. X<float> and X<T> hold the same number of values and
/// nothing else.
template <template <class> class X, class T, class At>
X<T> shapeLanes(const At& at) {
    constexpr std::size_t kValues = sizeof(X<float>) / sizeof(float);
    static_assert(sizeof(X<T>) == kValues * sizeof(T) && kValues >= 4, "only lanes inside");
    X<T> result(at(0)); // of which every value is replaced
    auto* const to = reinterpret_cast<T*>(&result);
    for (std::size_t value = 0; value < kValues; value += 4) {
        const std::size_t first = std::min(value, kValues - 4);
        const LaneQuad<T> quad =
            loadQuadsAt<T>([&](int i) { return reinterpret_cast<const float*>(&at(i)) + first; });
        to[first] = quad.x;
        to[first + 1] = quad.y;
        to[first + 2] = quad.z;
        to[first + 3] = quad.w;
    }
    return result;
}

} // namespace mbfeat
