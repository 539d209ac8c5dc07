// What a render was and did: the source of file headers, render statistics and the summary.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/settings.h"
#include "film/samplingOutcome.h"
#include "integrate/integrator.h"

namespace mbfeat {

struct RenderReport {
    std::string version; ///< of MBFeat
    std::string stage;   ///< root layer, where the host told it; else empty
    std::int64_t frame = 0;
    std::vector<Settings::Resolved> settings;
    EffectCensus census;
    TraceStatistics trace;
    KernelChoice kernel;       ///< of the last view
    std::vector<int> branches; ///< KernelChoice::branches by view, 0 of what is not seen
    BuildStatistics builds;    ///< by this render's commit
    MemoryStatistics memory;   ///< of the scene, and of each of the workers
    std::size_t workers = 0;   ///< threads that traced
    std::size_t filmBytes = 0; ///< of all films
    std::size_t filmAovs = 0;  ///< that films hold, `color` included
    int samplesPerPixel = 0;   ///< the setting: what each pixel gets, or the most
    SamplingOutcome sampling;
    /// Seconds by phase, in order: "commit", "sampling", "write", ...
    std::vector<std::pair<std::string, double>> seconds;
    double samplingCpuSeconds = 0.0;  ///< of the process while it sampled
    std::vector<std::string> written; ///< files
    std::vector<std::string> errors;  ///< e.g. products that could not be written
    int warnings = 0;                 ///< distinct ones, of this render and of the scene's data
    bool interrupted = false;         ///< ended before all samples

    double totalSeconds() const;
    /// The report as a JSON object.
    std::string json() const;
    /// EXR header attributes: name ("mbfeat:version", "mbfeat:seed", ...) and text value.
    std::vector<std::pair<std::string, std::string>> headerAttributes() const;
};

} // namespace mbfeat
