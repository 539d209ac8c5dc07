// Sorts rays so that those which go the same way from nearby places are traced one after another:
// by octant of the direction, then by the Morton code of the origin. A radix sort: a comparison
// sort would eat a third of what is gained.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/bounds.h"
#include "core/vec.h"

namespace mbfeat {

struct RayPlace {
    Float3 origin, direction;
};

class RaySorter {
public:
    /// Reorders `list`; place(entry) says where an entry's ray is. Stable, so that the result
    /// depends on the list alone.
    template <class F>
    void sort(std::vector<std::int32_t>& list, const Bounds& bounds, F place) {
        const std::size_t n = list.size();
        if (n < 2 || bounds.empty()) {
            return;
        }
        keys_.resize(n);
        const Float3 extent = bounds.upper - bounds.lower;
        const auto scale = [](float e) { return e > 0.0F ? 64.0F / e : 0.0F; };
        const Float3 toCell(scale(extent.x), scale(extent.y), scale(extent.z));
        for (std::size_t i = 0; i < n; ++i) {
            const RayPlace ray = place(list[i]);
            keys_[i] = {key(ray, bounds.lower, toCell), list[i]};
        }
        pass(keys_, spare_, 0);
        pass(spare_, keys_, kDigitBits);
        for (std::size_t i = 0; i < n; ++i) {
            list[i] = keys_[i].entry;
        }
    }

private:
    struct Key {
        std::uint32_t key;
        std::int32_t entry;
    };
    static constexpr unsigned kDigitBits = 11;
    static constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;

    /// Six bits with two zeros between each.
    static std::uint32_t spread(std::uint32_t x) {
        x = (x | (x << 8U)) & 0x0000300FU;
        x = (x | (x << 4U)) & 0x000030C3U;
        return (x | (x << 2U)) & 0x00009249U;
    }
    static std::uint32_t cell(float x) {
        return static_cast<std::uint32_t>(std::min(std::max(x, 0.0F), 63.0F));
    }
    static std::uint32_t key(const RayPlace& ray, const Float3& lower, const Float3& toCell) {
        const Float3 at = (ray.origin - lower) * toCell;
        const std::uint32_t octant = (ray.direction.x < 0.0F ? 1U : 0U) |
                                     (ray.direction.y < 0.0F ? 2U : 0U) |
                                     (ray.direction.z < 0.0F ? 4U : 0U);
        const std::uint32_t morton =
            spread(cell(at.x)) | (spread(cell(at.y)) << 1U) | (spread(cell(at.z)) << 2U);
        return (octant << 18U) | morton;
    }

    void pass(const std::vector<Key>& from, std::vector<Key>& to, unsigned shift) {
        std::array<std::uint32_t, kDigits> start{};
        for (const Key& k : from) {
            ++start[(k.key >> shift) & (kDigits - 1)];
        }
        std::uint32_t sum = 0;
        for (std::uint32_t& s : start) {
            const std::uint32_t count = s;
            s = sum;
            sum += count;
        }
        to.resize(from.size());
        for (const Key& k : from) {
            to[start[(k.key >> shift) & (kDigits - 1)]++] = k;
        }
    }

    std::vector<Key> keys_, spare_;
};

} // namespace mbfeat
