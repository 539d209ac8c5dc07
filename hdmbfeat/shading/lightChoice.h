// Which light to sample. Behind this class so that a choice that looks at the receiver (a light
// hierarchy) can take its place: every question already carries the receiver.
#pragma once

#include <cstdint>
#include <vector>

#include "core/distribution.h"

namespace mbfeat {

struct LightReceiver;

/// Chooses an entry with probability proportional to its power, wherever the receiver is.
class LightChoice {
public:
    LightChoice() = default;
    explicit LightChoice(const std::vector<double>& power) : table_(power) {}

    bool empty() const { return table_.size() == 0; }
    AliasTable::Pick sample(const LightReceiver& /*receiver*/, float u) const {
        return table_.sample(u);
    }
    float probability(std::uint32_t entry, const LightReceiver& /*receiver*/) const {
        return table_.probability(entry);
    }

private:
    AliasTable table_;
};

} // namespace mbfeat
