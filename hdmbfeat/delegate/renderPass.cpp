#include "delegate/renderPass.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "delegate/guard.h"
#include "delegate/productVar.h"
#include "delegate/products.h"
#include "delegate/renderBuffer.h"
#include "delegate/renderParam.h"
#include "delegate/renderSettings.h"
#include "delegate/tokens.h"
#include "delegate/viewport.h"
#include "film/aovTable.h"
#include "film/filmDenoiser.h"
#include "film/risingPass.h"
#include "pxr/imaging/hd/renderIndex.h"
#include "pxr/imaging/hd/utils.h"

namespace mbfeat {

namespace {

/// Hosts may ask again at once whether the image is finished (Blender does): without a short wait
/// they would keep a whole core from the render threads.
constexpr std::chrono::milliseconds kIdleWait(1);

RenderBuffer* bufferOf(const HdRenderPassAovBinding& binding, HdRenderIndex& index) {
    HdBprim* const prim = binding.renderBuffer != nullptr
                              ? binding.renderBuffer
                              : index.GetBprim(tokens().renderBuffer, binding.renderBufferId);
    return dynamic_cast<RenderBuffer*>(prim);
}

std::string aovOf(const HdRenderPassAovBinding& binding) {
    return aovOfHostName(binding.aovName.GetString());
}

void fillWithClearValue(RenderBuffer& buffer, const std::string& aovName) {
    const std::optional<AovDescriptor> aov = findAov(aovName);
    const float clear = aov ? aov->clearValue : 0.0F;
    const float value[4] = {clear, clear, clear, clear};
    buffer.fill(value);
}

void report(const Error& error, RenderJob& job, JobResult& result) {
    const Error told{error.subject, error.text + " The image stays as it is rendered."};
    job.messages->error(told.subject, told.text);
    result.errors.push_back(told);
}

/// The denoiser of a view; null where it is off, or with an error where it cannot be had.
std::shared_ptr<const FilmDenoise> denoiseOf(const RenderOptions& options, const Camera& camera,
                                             RenderJob& job, JobResult& result) {
    if (!options.denoise.enabled) {
        return nullptr;
    }
    if (options.pixelFilter == PixelFilter::kMitchell) {
        job.messages->warn("mbfeat:pixelFilter",
                           "the denoiser knows no filter with negative lobes; its image is that of "
                           "a filter without weights. Set another filter, such as box.");
    }
    Result<std::shared_ptr<const FilmDenoise>> denoise =
        prepareDenoise(options.denoise, options.threads, camera);
    if (!denoise) {
        report(denoise.error(), job, result);
        return nullptr;
    }
    return denoise.value();
}

std::uint64_t pixelsOf(const Film& film) {
    const PixelRect& data = film.window().data;
    return static_cast<std::uint64_t>(data.width) * static_cast<std::uint64_t>(data.height);
}

std::size_t pathSampleBytes(const RenderOptions& options) {
    return static_cast<std::size_t>(options.pathSampleMemory * 1073741824.0);
}

} // namespace

RenderPass::RenderPass(HdRenderIndex* index, const HdRprimCollection& collection,
                       RenderParam& param)
    : HdRenderPass(index, collection),
      param_(param),
      messages_(param.diagnostics()) {}

RenderPass::~RenderPass() {
    if (job_ && job_->isRunning()) {
        param_.stopRender();
    }
}

void RenderPass::_Execute(const HdRenderPassStateSharedPtr& renderPassState,
                          const TfTokenVector& renderTags) {
    // Whatever goes wrong, the host must not wait for ever.
    converged_ = true;
    messages_.withdraw();
    guarded(messages_, "render pass", [&] { execute(*renderPassState, renderTags); });
}

void RenderPass::execute(const HdRenderPassState& state, const TfTokenVector& renderTags) {
    const VisibilityFilter filter = filterOf(renderTags);
    const RenderSettingsPrim* const settingsPrim = refreshSettings();
    std::vector<Target> targets = resolveTargets(state);
    if (state.GetCamera() == nullptr) {
        giveUp(state, "the host gave no camera; nothing is rendered.");
        return;
    }
    const bool batch = !param_.settings().isInteractive();
    const RenderSettingsPrim* const products =
        batch && settingsPrim != nullptr && !settingsPrim->GetRenderProducts().empty()
            ? settingsPrim
            : nullptr;
    const Fingerprint wanted = fingerprint(state, targets, products, filter);
    // A batch host that brings new buffers to a finished job wants another image.
    const bool again = batch && shown_ &&
                       std::any_of(targets.begin(), targets.end(),
                                   [](const Target& t) { return t.buffer->stamp() == 0; });
    if (param_.isStopped()) {
        return;
    }
    const bool isLost = !job_ || !(job_->isRunning() || job_->isConverged());
    const bool isDue = isLost || wanted != started_ || again;
    const bool waits = isDue && !param_.renderer().isFreeFor(job_.get());
    if (isDue && !waits) {
        startJob(state, targets, products, filter);
        started_ = wanted;
    } else if (!param_.renderer().isConverged()) {
        param_.renderer().waitFor(kIdleWait);
    }
    const bool done = !waits && job_->isConverged();
    if (done || !batch) {
        showFilms(targets, done);
    }
    shown_ = done;
    converged_ = done;
}

VisibilityFilter RenderPass::filterOf(const TfTokenVector& renderTags) const {
    VisibilityFilter filter;
    for (const TfToken& tag : renderTags) {
        filter.renderTags.insert(tag.GetString());
    }
    for (const SdfPath& path : GetRprimCollection().GetRootPaths()) {
        filter.rootPaths.push_back(path.GetString());
    }
    for (const SdfPath& path : GetRprimCollection().GetExcludePaths()) {
        filter.excludePaths.push_back(path.GetString());
    }
    return filter;
}

const RenderSettingsPrim* RenderPass::refreshSettings() {
    SettingsStack& settings = param_.settings();
    settings.refreshOverrides();
    HdRenderIndex& index = *GetRenderIndex();
    const RenderSettingsPrim* prim = nullptr;
    SdfPath path;
    if (HdUtils::HasActiveRenderSettingsPrim(index.GetTerminalSceneIndex(), &path)) {
        prim =
            dynamic_cast<const RenderSettingsPrim*>(index.GetBprim(tokens().renderSettings, path));
    }
    if (prim == nullptr) {
        prim = param_.activeSettingsPrim();
    }
    if (prim == nullptr) {
        settings.clearPrim();
        param_.setRenderingColorSpace("");
        return nullptr;
    }
    settings.setFromPrim(prim->GetId().GetString(), prim->GetNamespacedSettings());
    param_.setRenderingColorSpace(prim->GetRenderingColorSpace().GetString());
    return prim;
}

std::vector<RenderPass::Target> RenderPass::resolveTargets(const HdRenderPassState& state) {
    const std::string viewAov = param_.settings().options().viewAov;
    std::vector<Target> targets;
    for (const HdRenderPassAovBinding& binding : state.GetAovBindings()) {
        Target target;
        target.aov = aovOf(binding);
        target.buffer = bufferOf(binding, *GetRenderIndex());
        if (target.buffer == nullptr) {
            messages_.error(target.aov, "this AOV is bound without a buffer of this "
                                        "renderer; it is not rendered.");
            continue;
        }
        if (binding.aovName == tokens().color && !viewAov.empty()) {
            target.aov = viewAov;
            target.asColor = true;
        }
        targets.push_back(target);
    }
    return targets;
}

Fingerprint RenderPass::fingerprint(const HdRenderPassState& state,
                                    const std::vector<Target>& targets,
                                    const RenderSettingsPrim* products,
                                    const VisibilityFilter& filter) const {
    Fingerprint print;
    filter.addTo(print);
    print.add(param_.editVersion());
    print.add(param_.settings().version());
    print.add(currentFrame());
    addViewport(print, state);
    for (const Target& target : targets) {
        print.add(target.aov);
        print.add(target.buffer->GetWidth());
        print.add(target.buffer->GetHeight());
    }
    if (products != nullptr) {
        print.add(products->GetId().GetString());
        print.add(products->version());
        for (const HdRenderSettings::RenderProduct& product : products->GetRenderProducts()) {
            if (const auto* const camera = dynamic_cast<const HdCamera*>(
                    GetRenderIndex()->GetSprim(tokens().camera, product.cameraPath))) {
                addCamera(print, *camera);
            }
        }
    }
    return print;
}

std::int64_t RenderPass::currentFrame() const {
    double frame = 0.0;
    const bool known = HdUtils::GetCurrentFrame(GetRenderIndex()->GetTerminalSceneIndex(), &frame);
    return known && std::isfinite(frame) ? std::llround(frame) : 0;
}

void RenderPass::addViewportView(const HdRenderPassState& state, const std::vector<Target>& targets,
                                 RenderJob& job, JobResult& result) {
    const Viewport viewport = resolveViewport(state, true, *job.messages);
    FilmRequest request;
    request.window = viewport.window;
    request.samplesPerPixel = job.options.samplesPerPixel;
    request.aovs = {tokens().color.GetString()};
    for (const Target& target : targets) {
        if (!findAov(target.aov)) {
            job.messages->error(target.asColor ? "mbfeat:viewAov" : target.aov,
                                "there is no AOV " + target.aov + "; " +
                                    (target.asColor ? "color is shown" : "its buffer stays empty") +
                                    ". The nearest name is " + nearestAovName(target.aov) + ".");
        } else if (std::find(request.aovs.begin(), request.aovs.end(), target.aov) ==
                   request.aovs.end()) {
            request.aovs.push_back(target.aov);
        }
    }
    request.cameraToWorld = viewport.camera.toWorld;
    request.denoise = denoiseOf(job.options, viewport.camera, job, result);
    Result<std::shared_ptr<Film>> film = Film::create(request, pathSampleBytes(job.options));
    if (!film && request.denoise) {
        report(film.error(), job, result);
        request.denoise = nullptr;
        film = Film::create(request, pathSampleBytes(job.options));
    }
    if (!film) {
        job.messages->error(film.error().subject, film.error().text);
        result.errors.push_back(film.error());
        return;
    }
    film_ = film.value();
    placement_ = {viewport.bufferX, viewport.bufferY, false};
    job.views.push_back({viewport.camera, film_, viewport.cameraPath, 0});
    result.images.push_back({film_, viewport.cameraPath, {}});
}

void RenderPass::addProductViews(const HdRenderPassState& state, const RenderSettingsPrim& products,
                                 RenderJob& job, JobResult& result) {
    ProductPlan plan = planProducts(products.GetRenderProducts(), *GetRenderIndex(), job.options,
                                    state.GetEnableExposureCompensation(), *job.messages);
    for (ProductView& view : plan.views) {
        view.film.cameraToWorld = view.camera.toWorld;
        view.film.denoise = denoiseOf(job.options, view.camera, job, result);
        if (const std::shared_ptr<Film> film =
                createFilm(view, pathSampleBytes(job.options), plan)) {
            job.views.push_back({view.camera, film, view.cameraPath, 0});
            result.images.push_back({film, view.cameraPath, std::move(view.products)});
        }
    }
    for (const Error& error : plan.errors) {
        job.messages->error(error.subject, error.text);
        result.errors.push_back(error);
    }
    result.staleFiles = std::move(plan.staleFiles);
    if (!job.views.empty()) {
        film_ = job.views.front().film;
        placement_ = {0, 0, true};
    }
}

void RenderPass::startJob(const HdRenderPassState& state, const std::vector<Target>& targets,
                          const RenderSettingsPrim* products, const VisibilityFilter& filter) {
    param_.stopRender();
    param_.applyFilter(filter);
    job_.reset();
    film_.reset();
    RenderJob job;
    job.messages = std::make_shared<Diagnostics>(param_.diagnostics());
    job.options = param_.settings().options();
    job.settings = param_.settings().resolved();
    job.frame = currentFrame();
    job.interactive = param_.settings().isInteractive();
    JobResult result;
    result.onError = job.options.onError;

    std::vector<std::string> primvars;
    for (const Target& target : targets) {
        const std::string name = primvarOfAov(target.aov);
        if (!name.empty()) {
            primvars.push_back(name);
        }
    }
    if (param_.addAovPrimvars(primvars)) {
        param_.markStaleMeshes(GetRenderIndex()->GetChangeTracker());
    }
    if (products != nullptr) {
        addProductViews(state, *products, job, result);
    }
    if (job.views.empty()) {
        addViewportView(state, targets, job, result);
    }
    job.finish = [result = std::move(result), messages = job.messages](RenderReport& report) {
        finishJob(result, *messages, report);
    };
    jobNumber_ = param_.nextJobNumber();
    if (film_) {
        schedule_.start(film_->window().data, Clock::now());
    }
    job_ = param_.startRender(std::move(job));
}

void RenderPass::showFilms(std::vector<Target>& targets, bool done) {
    const bool isRunning = job_ && job_->isRunning();
    const std::uint64_t samples = isRunning ? param_.renderer().progress().samples : 0;
    const Clock::time_point begin = Clock::now();
    const bool allShow = std::none_of(targets.begin(), targets.end(),
                                      [](const Target& t) { return t.buffer->stamp() == 0; });
    if (isRunning && film_ && allShow && !schedule_.isDue(samples, begin)) {
        for (const Target& target : targets) {
            target.buffer->setConverged(false);
        }
        return;
    }
    std::vector<std::uint8_t> sampled;
    if (isRunning && film_ && samples < pixelsOf(*film_)) {
        sampled = sampledPixels(*film_);
    }
    const std::uint64_t stamp = (jobNumber_ << 45U) | (samples << 1U) | (done ? 1U : 0U);
    for (Target& target : targets) {
        RenderBuffer& buffer = *target.buffer;
        if (buffer.stamp() != stamp) {
            target.filmIndex = film_ ? film_->findBound(target.aov) : -1;
            if (film_ && target.filmIndex < 0 && target.asColor) {
                target.filmIndex = film_->findBound(tokens().color.GetString());
            }
            if (target.filmIndex < 0) {
                fillWithClearValue(buffer, target.aov);
            } else {
                showFilm(*film_, target.filmIndex, placement_, sampled, target.asColor, buffer);
            }
            buffer.setStamp(stamp);
        }
        buffer.setConverged(done);
    }
    schedule_.shown(samples, begin, Clock::now());
}

void RenderPass::giveUp(const HdRenderPassState& state, const std::string& why) {
    messages_.error("render pass", why);
    for (const HdRenderPassAovBinding& binding : state.GetAovBindings()) {
        if (RenderBuffer* const buffer = bufferOf(binding, *GetRenderIndex())) {
            fillWithClearValue(*buffer, aovOf(binding));
            buffer->setConverged(true);
        }
    }
}

} // namespace mbfeat
