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

/// Fields of what writePathRowWithParts() writes: the extended ones, then what each vertex adds.
std::vector<std::string> pathRowFieldsWithParts();
float* writePathRowWithParts(const PathRecord& record, float* out);

} // namespace mbfeat
