#include "film/renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <ctime>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "core/clock.h"
#include "core/sampler.h"
#include "film/filmDenoiser.h"
#include "film/filmMemory.h"
#include "film/host.h"
#include "film/passRenderer.h"
#include "film/progress.h"
#include "film/refinement.h"
#include "film/renderClock.h"
#include "film/samplingRate.h"
#include "integrate/effectParts.h"

namespace mbfeat {

namespace {

/// CPU seconds of this process, all threads together.
double cpuSeconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double pixelsOf(const RenderView& view) {
    return pixelCount(view.film->window().data);
}

std::uint64_t viewSamples(const RenderView& view) {
    const PixelRect& data = view.film->window().data;
    return static_cast<std::uint64_t>(data.width) * static_cast<std::uint64_t>(data.height) *
           static_cast<std::uint64_t>(view.samplesPerPixel);
}

/// Of the views from that one on, if all get what they may get.
std::uint64_t jobSamples(const RenderJob& job, std::size_t firstView) {
    std::uint64_t samples = 0;
    for (std::size_t i = firstView; i < job.views.size(); ++i) {
        samples += viewSamples(job.views[i]);
    }
    return samples;
}

/// What a view calls for beside the scene, with the AOVs that ask for it.
void addView(EffectCensus& census, const RenderView& view, bool hasLens) {
    if (hasLens) {
        census.add(Effect::kDepthOfField, view.cameraPath.empty() ? "the camera" : view.cameraPath);
    }
    const auto add = [&census](EffectSet effects, const std::string& asker) {
        for (const EffectDescriptor& row : effectTable()) {
            if (effects.has(row.effect)) {
                census.add(row.effect, asker);
            }
        }
    };
    for (const AovDescriptor& aov : view.film->aovs()) {
        add(recordedEffects(aov.recordFlags), aov.name);
    }
    if (!view.film->pathSampleLayout().empty()) {
        const EffectSet kept = recordedEffects(view.film->recordFlags()) - census.effects();
        add(kept | EffectSet(Effect::kPathSamples), "deep product");
    }
    census.nameEffects();
}

} // namespace

struct Renderer::Impl final : PassObserver {
    FilmMemoryUser filmMemory; ///< of the frames that follow one another

    explicit Impl(Scene& scene)
        : scene(scene),
          integrator(scene),
          passes(integrator, *this, stopping) {
        thread = std::thread([this] { run(); });
    }

    ~Impl() {
        halt();
        {
            const std::lock_guard lock(mutex);
            quit = true;
        }
        wake.notify_all();
        thread.join();
    }

    void halt() {
        std::unique_lock lock(mutex);
        stopping = true;
        wake.notify_all();
        idle.wait(lock, [this] { return !hasJob; });
        stopping = false;
    }

    bool interrupted() const { return Host::instance().stopRequested(); }
    bool shouldStop() const override {
        return stopping.load(std::memory_order_relaxed) || interrupted();
    }

    void run() {
        for (;;) {
            {
                std::unique_lock lock(mutex);
                wake.wait(lock, [this] { return quit || hasJob; });
                if (quit) {
                    return;
                }
            }
            try {
                runJob();
            } catch (const std::exception& failure) {
                fail(failure.what());
            }
            {
                const std::lock_guard lock(mutex);
                state->stage_ = converged ? JobState::Stage::kConverged : JobState::Stage::kStopped;
                hasJob = false;
            }
            idle.notify_all();
        }
    }

    /// Memory or threads ran out: say so and let the host go on with what the films hold.
    void fail(const char* what) {
        const std::string text = std::string("the render stopped: ") + what +
                                 ". Lower the resolution or the number of AOVs, or free memory.";
        job.messages->error("MBFeat", text);
        const std::lock_guard lock(reportMutex);
        report.errors.push_back(text);
        converged = true;
    }

    void phase(const std::string& name, double seconds) {
        const std::lock_guard lock(reportMutex);
        report.seconds.emplace_back(name, seconds);
    }

    void runJob() {
        for (const RenderView& view : job.views) {
            view.film->clear();
        }

        const BuildStatistics built = integrator.builds();
        const bool committed = integrator.commit(job.options, [this] { return shouldStop(); });
        phase("commit", clock.allSeconds());
        if (stopping.load()) {
            return;
        }
        if (!committed) {
            finish(integrator.statistics());
            return;
        }
        {
            const std::lock_guard lock(reportMutex);
            report.census = integrator.census();
            report.census.nameEffects();
            report.builds = integrator.builds() - built;
        }

        const double samplingBegin = clock.activeSeconds();
        rate.start(samplingBegin);
        const double cpuBegin = cpuSeconds();
        ProgressReporter reporter(job.interactive ? Host::ProgressStyle::kNone
                                                  : Host::instance().progressStyle());
        progressReporter = &reporter;
        const TraceStatistics before = integrator.statistics();
        for (std::size_t i = 0; i < job.views.size(); ++i) {
            renderView(i);
        }
        progressReporter = nullptr;
        reporter.update(progress());
        reporter.finish();
        reportSamplingSeconds(clock.activeSeconds() - samplingBegin);
        {
            const std::lock_guard lock(reportMutex);
            report.samplingCpuSeconds = cpuSeconds() - cpuBegin;
        }
        if (stopping.load()) {
            return;
        }
        if (!interrupted()) {
            reconstruct();
            if (stopping.load()) {
                return;
            }
        }
        finish(before);
    }

    void finish(const TraceStatistics& before) {
        const TraceStatistics after = integrator.statistics();
        RenderReport finished;
        {
            const std::lock_guard lock(reportMutex);
            report.trace = {after.paths - before.paths, after.rays - before.rays,
                            after.shadowRays - before.shadowRays,
                            after.nonFinite - before.nonFinite};
            report.interrupted = interrupted();
            if (report.interrupted) {
                report.sampling.stop = StopReason::kInterrupted;
            }
            finished = report;
        }
        if (job.finish) {
            job.finish(finished);
            const std::lock_guard lock(reportMutex);
            report = std::move(finished);
        }
        converged = true;
    }

    bool denoises() const {
        return std::any_of(job.views.begin(), job.views.end(),
                           [](const RenderView& view) { return view.film->denoiser() != nullptr; });
    }

    DenoiseTimes denoiseTimes() const {
        DenoiseTimes times;
        for (const RenderView& view : job.views) {
            if (view.film->denoiser() != nullptr) {
                times.add(view.film->denoiser()->times());
            }
        }
        return times;
    }

    /// What the denoiser recorded meanwhile is a phase of its own.
    void reportSamplingSeconds(double seconds) {
        const double recording = denoiseTimes().recording;
        phase("sampling", seconds - recording);
        if (denoises()) {
            phase("feature recording", recording);
        }
    }

    /// Where a film cannot be reconstructed it keeps its raw image.
    void reconstruct() {
        if (!denoises()) {
            return;
        }
        const Clock::time_point start = Clock::now();
        for (const RenderView& view : job.views) {
            if (const Status problem = view.film->reconstruct(&stopping)) {
                const std::string text = problem->text + " The image stays as it was rendered.";
                job.messages->error(problem->subject, text);
                const std::lock_guard lock(reportMutex);
                report.errors.push_back(problem->subject + ": " + text);
            }
        }
        const DenoiseTimes times = denoiseTimes();
        phase("inference", times.inference);
        phase("splat", times.splat);
        phase("tiles", std::max(secondsSince(start) - times.inference - times.splat, 0.0));
    }

    void renderView(std::size_t index) {
        const RenderView& view = job.views[index];
        IntegratorRequest request;
        request.options = job.options;
        request.options.samplesPerPixel = view.samplesPerPixel;
        if (job.interactive && job.options.splitting == kFittedSplitting) {
            request.options.splitting = 1; // a trial would take as long as the first pass does
        }
        request.recordFlags = view.film->recordFlags();
        request.primvars = view.film->primvars();
        request.frame = job.frame;
        if (kHasTargets && job.options.targetError > 0.0) {
            request.targetSamples = request.leastSamples = Refinement::kLeastSamples;
        }
        if (kHasTargets && job.options.timeLimit > 0.0) {
            request.leastSamples = 1; // the time may be up after the first pass
        }
        request.messages = job.messages.get();
        request.stop = [this] { return shouldStop(); };
        if (const Status problem = integrator.setView(view.camera, view.film->window(), request)) {
            const std::string subject =
                view.cameraPath.empty() ? problem->subject : view.cameraPath;
            job.messages->error(subject, problem->text);
            const std::lock_guard lock(reportMutex);
            report.errors.push_back(subject + ": " + problem->text);
            report.branches.push_back(0);
            return;
        }
        refinement.reset();
        if (kHasTargets && estimatesError(job.options)) {
            refinement = std::make_unique<Refinement>(view.film->window().data,
                                                      RefinementTarget{job.options.targetError,
                                                                       job.options.adaptive,
                                                                       view.samplesPerPixel});
        }
        passes.begin(job, view, refinement.get());
        reportView(view);
        setDeadline(index);
        forecasts.clear();
        const StopReason stop = refine(index);
        if (!stopping.load()) {
            reportSampling(index, stop);
        }
        passes.end();
        refinement.reset();
    }

    /// What the view calls for, how it is traced, and the memory that takes.
    void reportView(const RenderView& view) {
        const std::lock_guard lock(reportMutex);
        report.kernel = integrator.kernel();
        report.branches.push_back(report.kernel.branches);
        addView(report.census, view, integrator.hasLens());
        report.memory = integrator.memory(passes.worker());
        report.workers = passes.workerCount();
        report.filmBytes += view.film->bytes();
        report.filmAovs += view.film->aovs().size();
    }

    /// Takes samples until something says that they are enough.
    StopReason refine(std::size_t index) {
        const RenderView& view = job.views[index];
        int done = 0;
        while (done < view.samplesPerPixel) {
            int samples = passes.passSamples(done);
            if (refines()) {
                samples = std::min(samples, refinement->nextCheck() - done);
            }
            passes.render(done, samples);
            if (shouldStop()) {
                return StopReason::kInterrupted;
            }
            done += samples;
            rate.mark(samplesDone, clock.activeSeconds());
            if (refines() && done == refinement->nextCheck()) {
                refinement->check(done, passes.rowLoop());
                samplesTotal = samplesDone + refinement->samplesLeft() + jobSamples(job, index + 1);
                const std::lock_guard lock(reporterMutex);
                keepForecast(progress());
                if (refinement->reached()) {
                    return StopReason::kTargetError;
                }
            }
            if (timeIsUp()) {
                return done < view.samplesPerPixel || passes.wasCut() ? StopReason::kTimeLimit
                                                                      : StopReason::kSamples;
            }
        }
        return StopReason::kSamples;
    }

    /// Views share what is left of the time by their samples.
    void setDeadline(std::size_t index) {
        if (job.options.timeLimit > 0.0) {
            const double now = clock.activeSeconds();
            const double share = static_cast<double>(viewSamples(job.views[index])) /
                                 static_cast<double>(jobSamples(job, index));
            deadline = now + std::max(job.options.timeLimit - now, 0.0) * share;
        }
    }

    /// Whether a view that has something in every pixel is to end.
    bool timeIsUp() const override {
        return kHasTargets && job.options.timeLimit > 0.0 && clock.activeSeconds() >= deadline;
    }
    bool refines() const { return kHasTargets && refinement != nullptr; }

    void reportSampling(std::size_t index, StopReason stop) {
        const RenderView& view = job.views[index];
        SamplingOutcome outcome = countSamples(*view.film);
        outcome.stop = stop;
        outcome.forecasts = std::move(forecasts);
        if (refinement && outcome.fewest >= Refinement::kLeastSamples) {
            outcome.error = refinement->estimate(passes.rowLoop());
        }
        const double target = job.options.targetError;
        if (target > 0.0 && stop == StopReason::kSamples) {
            job.messages->warn("mbfeat:targetError",
                               missedTargetText(outcome, target, view.samplesPerPixel));
        }
        double pixelsBefore = 0.0;
        for (std::size_t i = 0; i < index; ++i) {
            pixelsBefore += pixelsOf(job.views[i]);
        }
        const std::lock_guard lock(reportMutex);
        report.sampling.add(outcome, pixelsBefore, pixelsOf(view));
    }

    void addSamples(std::uint64_t count) override {
        samplesDone.fetch_add(count, std::memory_order_relaxed);
    }

    /// Blocks during a pause; false when the work is to end.
    bool waitWhilePaused() override {
        if (clock.isPaused()) {
            std::unique_lock lock(mutex);
            while (clock.isPaused() && !shouldStop()) {
                // The host's interruption has no condition variable of ours to notify.
                wake.wait_for(lock, std::chrono::milliseconds(50));
            }
        }
        return !shouldStop();
    }

    void setPaused(bool on) {
        const std::lock_guard lock(mutex);
        if (on != clock.isPaused()) {
            clock.setPaused(on);
            wake.notify_all();
        }
    }

    void reportProgress() override {
        const std::unique_lock lock(reporterMutex, std::try_to_lock);
        if (lock.owns_lock() && progressReporter != nullptr) {
            const RenderProgress now = progress();
            progressReporter->update(now);
            if (!tenthTold && now.fraction >= 0.1) {
                tenthTold = true;
                keepForecast(now);
            }
        }
    }

    /// What is expected now, for the report.
    void keepForecast(const RenderProgress& now) {
        forecasts.push_back(
            {now.samples, samplesTotal, now.seconds, now.seconds + now.secondsLeft});
    }

    RenderProgress progress() const {
        RenderProgress p;
        p.samples = samplesDone.load(std::memory_order_relaxed);
        if (samplesTotal == 0) {
            return p;
        }
        p.fraction = static_cast<double>(p.samples) / static_cast<double>(samplesTotal);
        p.seconds = clock.activeSeconds();
        if (p.seconds > 0.0) {
            p.samplesPerSecond = static_cast<double>(p.samples) / p.seconds;
        }
        const std::uint64_t all = samplesTotal;
        p.secondsLeft =
            rate.secondsFor(all > p.samples ? all - p.samples : 0, p.samples, p.seconds);
        const double limit = job.options.timeLimit;
        if (limit > 0.0 && p.fraction < 1.0 && p.seconds + p.secondsLeft > limit) {
            p.secondsLeft = std::max(limit - p.seconds, 0.0);
            p.fraction = std::min(p.seconds / limit, 1.0);
        }
        return p;
    }

    Scene& scene;
    Integrator integrator;

    std::thread thread;
    PassRenderer passes;
    std::unique_ptr<Refinement> refinement; ///< of that view; null where no error is estimated
    std::vector<Forecast> forecasts;        ///< of that view; under reporterMutex
    bool tenthTold = false;                 ///< whether the job has that of a tenth; likewise
    double deadline = 0.0;                  ///< of that view, in active seconds
    mutable std::mutex mutex;
    std::condition_variable wake, idle;
    bool quit = false;
    bool hasJob = false;
    RenderJob job;
    std::shared_ptr<JobState> state; ///< of the job
    std::atomic<bool> stopping{false}, converged{true};

    RenderClock clock;
    std::atomic<std::uint64_t> samplesDone{0}, samplesTotal{0};
    SamplingRate rate;
    std::mutex reporterMutex;
    ProgressReporter* progressReporter = nullptr;

    mutable std::mutex reportMutex;
    RenderReport report;
};

Renderer::Renderer(Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
Renderer::~Renderer() = default;

std::shared_ptr<const JobState> Renderer::start(RenderJob job) {
    impl_->halt();
    for (RenderView& view : job.views) {
        if (view.samplesPerPixel <= 0) {
            view.samplesPerPixel = job.options.samplesPerPixel;
        }
    }
    if (!job.messages) {
        job.messages = std::make_shared<Diagnostics>(impl_->scene.diagnostics());
    }
    RenderReport report;
    report.version = MBFEAT_VERSION;
    report.stage = Host::instance().stage();
    report.frame = job.frame;
    report.settings = job.settings;
    report.samplesPerPixel = job.options.samplesPerPixel;
    {
        const std::lock_guard lock(impl_->reportMutex);
        impl_->report = std::move(report);
    }
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->job = std::move(job);
        impl_->state = std::make_shared<JobState>();
        impl_->samplesDone = 0;
        impl_->samplesTotal = jobSamples(impl_->job, 0);
        impl_->clock.start();
        impl_->rate.start(0.0);
        impl_->tenthTold = false;
        impl_->converged = false;
        impl_->hasJob = true;
    }
    impl_->wake.notify_all();
    return impl_->state;
}

bool Renderer::isFreeFor(const JobState* job) const {
    const std::lock_guard lock(impl_->mutex);
    return !impl_->hasJob || impl_->state.get() == job;
}

void Renderer::stop() {
    impl_->halt();
}

void Renderer::pause() {
    impl_->setPaused(true);
}
void Renderer::resume() {
    impl_->setPaused(false);
}

bool Renderer::isPaused() const {
    return impl_->clock.isPaused();
}

bool Renderer::isRendering() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->hasJob;
}

bool Renderer::isConverged() const {
    return impl_->converged;
}

void Renderer::wait() {
    std::unique_lock lock(impl_->mutex);
    impl_->idle.wait(lock, [this] { return !impl_->hasJob; });
}

void Renderer::waitFor(std::chrono::milliseconds longest) {
    std::unique_lock lock(impl_->mutex);
    impl_->idle.wait_for(lock, longest, [this] { return !impl_->hasJob; });
}

RenderProgress Renderer::progress() const {
    return impl_->progress();
}

RenderReport Renderer::report() const {
    const std::lock_guard lock(impl_->reportMutex);
    return impl_->report;
}

} // namespace mbfeat
