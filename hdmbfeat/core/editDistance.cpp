#include "core/editDistance.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>

namespace mbfeat {

namespace {

char lower(char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

} // namespace

int editDistance(std::string_view a, std::string_view b) {
    // Three rows of the dynamic programme: the swap reaches two rows back.
    std::array<std::vector<int>, 3> rows;
    for (std::vector<int>& row : rows) {
        row.assign(b.size() + 1, 0);
    }
    for (std::size_t j = 0; j <= b.size(); ++j) {
        rows[0][j] = static_cast<int>(j);
    }
    for (std::size_t i = 1; i <= a.size(); ++i) {
        const std::vector<int>& beforeLast = rows[(i + 1) % 3];
        const std::vector<int>& last = rows[(i - 1) % 3];
        std::vector<int>& row = rows[i % 3];
        row[0] = static_cast<int>(i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const int cost = lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1;
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + cost});
            const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                                 lower(a[i - 2]) == lower(b[j - 1]);
            if (swapped) {
                row[j] = std::min(row[j], beforeLast[j - 2] + 1);
            }
        }
    }
    return rows[a.size() % 3][b.size()];
}

std::string nearestName(std::string_view name, const std::vector<std::string>& candidates) {
    std::string nearest;
    int smallest = std::numeric_limits<int>::max();
    for (const std::string& candidate : candidates) {
        const int distance = editDistance(name, candidate);
        if (distance < smallest) {
            smallest = distance;
            nearest = candidate;
        }
    }
    return nearest;
}

} // namespace mbfeat
