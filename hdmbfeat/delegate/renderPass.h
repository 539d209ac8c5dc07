// The render pass: turns what a host binds and a stage's settings ask for into render jobs.
#pragma once

#include "pxr/pxr.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "delegate/filmView.h"
#include "delegate/fingerprint.h"
#include "delegate/jobFinish.h"
#include "film/film.h"
#include "film/renderer.h"
#include "film/showSchedule.h"
#include "pxr/imaging/hd/renderPass.h"
#include "pxr/imaging/hd/renderPassState.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class RenderBuffer;
class RenderParam;
class RenderSettingsPrim;
struct VisibilityFilter;

/// Every execution compares all that a render depends on with what the running job was started
/// for. When something differs a new job starts; otherwise the films' progress is copied into the
/// bound buffers. Rendering itself goes on in the renderer's thread. An interactive job has one
/// view, the viewport's. A job of a batch host (enableInteractive off) whose active settings prim
/// has products renders those, and the viewport shows the first one.
///
/// Passes of one delegate share its renderer and take turns: one that needs a job waits, not
/// converged, until the job of another has ended. An edit ends it early, and who comes first is
/// next.
class RenderPass final : public HdRenderPass {
public:
    RenderPass(HdRenderIndex* index, const HdRprimCollection& collection, RenderParam& param);
    ~RenderPass() override;

    bool IsConverged() const override { return converged_; }

protected:
    void _Execute(const HdRenderPassStateSharedPtr& renderPassState,
                  const TfTokenVector& renderTags) override;

private:
    /// A bound AOV and the buffer that shows it.
    struct Target {
        std::string aov;
        RenderBuffer* buffer = nullptr;
        bool asColor = false; ///< shown in place of `color`
        int filmIndex = -1;   ///< into Film::aovs(); -1: the film does not have it
    };

    void execute(const HdRenderPassState& state, const TfTokenVector& renderTags);
    VisibilityFilter filterOf(const TfTokenVector& renderTags) const;
    const RenderSettingsPrim* refreshSettings();
    std::vector<Target> resolveTargets(const HdRenderPassState& state);
    Fingerprint fingerprint(const HdRenderPassState& state, const std::vector<Target>& targets,
                            const RenderSettingsPrim* products,
                            const VisibilityFilter& filter) const;
    void startJob(const HdRenderPassState& state, const std::vector<Target>& targets,
                  const RenderSettingsPrim* products, const VisibilityFilter& filter);
    void addViewportView(const HdRenderPassState& state, const std::vector<Target>& targets,
                         RenderJob& job, JobResult& result);
    void addProductViews(const HdRenderPassState& state, const RenderSettingsPrim& products,
                         RenderJob& job, JobResult& result);
    void showFilms(std::vector<Target>& targets, bool done);
    void giveUp(const HdRenderPassState& state, const std::string& why);
    std::int64_t currentFrame() const;

    RenderParam& param_;
    Diagnostics messages_;                ///< of the last execution
    Fingerprint started_;                 ///< of this pass's last job
    std::shared_ptr<const JobState> job_; ///< its state; null: there was none
    bool shown_ = false;                  ///< the finished job's films are in buffers
    std::uint64_t jobNumber_ = 0;
    std::shared_ptr<Film> film_; ///< what the viewport shows
    FilmPlacement placement_;
    ShowSchedule schedule_; ///< of film_, while it is rendered
    bool converged_ = false;
};

} // namespace mbfeat
