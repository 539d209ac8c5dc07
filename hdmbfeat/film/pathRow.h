// The fields of a path record: as a row of floats, in the order of pathSampleFields(), and where
// they lie in it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "denoise/channels.h"
#include "film/film.h"
#include "integrate/pathRecord.h"

namespace mbfeat {

/// Writes the record's fields, the extended set included if asked for; returns the end.
float* writePathRow(const PathRecord& record, bool extended, float* out);

/// Names of the extended set's fields, and with `parts` of what each vertex adds behind them; and
/// where a record, taken for an array of words, has them.
std::vector<std::string> pathRecordFields(bool parts);
std::vector<PathFieldPlace> pathRecordPlaces(bool parts);

} // namespace mbfeat
