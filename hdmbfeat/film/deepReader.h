// Denoises deep products: reads their paths back.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/settings.h"
#include "film/film.h"
#include "film/report.h"

namespace mbfeat {

struct DenoisedFile {
    std::shared_ptr<const Film> film; ///< with the AOVs that a path tells
    RenderReport report;              ///< of the reconstruction, with the file's stage
};

/// Denoises the paths of a deep product. `aovs` are to be in the film besides color and mbfeat:raw.
/// An error names the file and what it lacks: no deep file, channels of other types, no rotation of
/// the camera in its header (older files), memory.
Result<DenoisedFile> denoiseDeepFile(const std::string& path, const DenoiseSettings& settings,
                                     int threads, const std::vector<std::string>& aovs);

} // namespace mbfeat
