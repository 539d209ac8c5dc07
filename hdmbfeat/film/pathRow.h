// A path record as a row of floats, in the order of pathSampleFields().
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "film/film.h"
#include "integrate/pathRecord.h"

namespace mbfeat {

/// Writes the record's fields, the extended set included if asked for; returns the end.
float* writePathRow(const PathRecord& record, bool extended, float* out);

/// Names of what writePathRow() writes with the extended set, and with `parts` of what each vertex
/// adds, which writePathParts() writes behind it.
std::vector<std::string> pathRowFields(bool parts);
float* writePathParts(const PathRecord& record, float* out);

} // namespace mbfeat
