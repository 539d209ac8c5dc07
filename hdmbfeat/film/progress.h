// Progress of a render on stderr: a bar on a terminal, else a line now and then.
#pragma once

#include <cstdio>
#include <string>

#include "film/host.h"
#include "film/renderer.h"

namespace mbfeat {

/// " 42.0 %  1.23 M samples/s  0:35 left".
std::string progressText(const RenderProgress& progress);

/// One render's progress. Not thread-safe: one thread owns it.
///
/// Time is that of RenderProgress::seconds, so pauses do not make it talk.
class ProgressReporter {
public:
    /// `label` names what is rendered ("frame 12") and may be empty. `out` is not owned. A bar that
    /// is asked for where `out` is no terminal becomes lines.
    explicit ProgressReporter(Host::ProgressStyle style, std::string label = "",
                              std::FILE* out = stderr);

    /// Shows the state if the last one shown is old enough; call it as often as you like.
    void update(const RenderProgress& progress);
    /// Shows the last state given and ends the line; a short render that has shown no line yet
    /// says nothing.
    void finish();

private:
    void show(const RenderProgress& progress);

    Host::ProgressStyle style_;
    std::string label_;
    std::FILE* out_;
    RenderProgress last_;
    double shownAt_ = 0.0; ///< seconds of the last state shown
    bool shown_ = false;
};

} // namespace mbfeat
