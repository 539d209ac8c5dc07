// Nearest names, for messages about misspelt ones.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mbfeat {

/// Edits (insert, delete, replace, swap of neighbours) that turn one text into the other, upper and
/// lower case taken as equal: the optimal string alignment distance.
int editDistance(std::string_view a, std::string_view b);

/// The candidate with the smallest distance, the first of equals; empty without candidates.
std::string nearestName(std::string_view name, const std::vector<std::string>& candidates);

} // namespace mbfeat
