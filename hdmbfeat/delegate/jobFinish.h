// The end of a render job: products on disk, results handed to the host.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/settings.h"
#include "film/host.h"

namespace mbfeat {

/// What a job leaves when its last sample is done.
struct JobResult {
    std::vector<FinishedFrame::Image> images;
    /// Problems found before rendering; they go into the report.
    std::vector<Error> errors;
    std::vector<std::string> staleFiles; ///< see ProductPlan
    OnError onError = OnError::kWarn;
};

/// Writes the products, adds files and errors to the report and publishes the frame. A product
/// that fails costs that product: an older image of ours at its path is removed, so that it is not
/// taken for the new one; any other file there stays. An interrupted job writes nothing. Runs on
/// the render thread. `messages` are the job's, a section of all.
void finishJob(const JobResult& result, Diagnostics& messages, RenderReport& report);

} // namespace mbfeat
