#include "film/filmDenoiser.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/clock.h"
#include "core/parallel.h"
#include "film/pathRow.h"

namespace mbfeat {

namespace {

constexpr const char* kAdditive = "mbfeat:contribution:";

ShownFeatures shownFeatures(DenoiseFeatures features) {
    switch (features) {
    case DenoiseFeatures::kNone:
        return ShownFeatures::kNone;
    case DenoiseFeatures::kFirstHit:
        return ShownFeatures::kFirstHit;
    case DenoiseFeatures::kAuto:
    case DenoiseFeatures::kMultiBounce:
        break;
    }
    return ShownFeatures::kAll;
}

} // namespace

Result<std::shared_ptr<const FilmDenoise>> prepareDenoise(const DenoiseSettings& settings,
                                                          int threads, const Camera& camera) {
    // Rows are the camera's axes in the world; scale, which a camera should not have, is left out.
    float rotation[9];
    float* row = rotation;
    for (const Double3& axis : {camera.toWorld.x, camera.toWorld.y, camera.toWorld.z}) {
        const double length = std::sqrt(dot(axis, axis));
        const double scale = length > 0.0 ? 1.0 / length : 0.0;
        for (const double component : {axis.x, axis.y, axis.z}) {
            *row++ = static_cast<float>(component * scale);
        }
    }
    return prepareDenoise(settings, threads, rotation);
}

Result<std::shared_ptr<const FilmDenoise>> prepareDenoise(const DenoiseSettings& settings,
                                                          int threads, const float* worldToCamera) {
    Result<std::shared_ptr<const DenoiseModel>> model =
        DenoiseModel::open(settings.model, threads > 0 ? threads : hardwareThreads());
    if (!model) {
        return model.error();
    }
    auto denoise = std::make_shared<FilmDenoise>();
    denoise->settings = settings;
    denoise->threads = threads;
    denoise->model = std::move(model.value());
    std::copy_n(worldToCamera, 9, denoise->worldToCamera);
    return std::shared_ptr<const FilmDenoise>(std::move(denoise));
}

Result<std::unique_ptr<FilmDenoiser>> FilmDenoiser::make(std::shared_ptr<const FilmDenoise> denoise,
                                                         const ImageWindow& window,
                                                         const std::vector<std::string>& aovs) {
    std::unique_ptr<FilmDenoiser> denoiser(new FilmDenoiser);
    FilmDenoiser& d = *denoiser;
    d.denoise_ = std::move(denoise);
    d.data_ = window.data;
    d.flags_ = kRecordFeatures | kRecordFirstHit | kRecordExtended;
    d.options_.threads = d.denoise_->threads;
    d.options_.tile = d.denoise_->settings.tile;
    d.options_.memory = d.denoise_->settings.memory;
    d.options_.shown = shownFeatures(d.denoise_->settings.features);
    d.aovs_ = {"color"};
    if (d.denoise_->keepsPaths()) {
        return denoiser;
    }
    for (const std::string& aov : aovs) {
        if (aov.compare(0, std::char_traits<char>::length(kAdditive), kAdditive) == 0) {
            d.aovs_.push_back(aov);
            d.options_.lights.push_back(aov + ".R");
            d.flags_ |= kRecordContributions;
        }
    }
    PathSamples rows;
    rows.width = window.data.width;
    rows.height = window.data.height;
    const bool parts = (d.flags_ & kRecordContributions) != 0;
    rows.fields = pathRecordFields(parts);
    rows.places = pathRecordPlaces(parts);
    std::copy(std::begin(d.denoise_->worldToCamera), std::end(d.denoise_->worldToCamera),
              rows.worldToCamera);
    Result<std::unique_ptr<PathSums>> sums = makePathSums(d.denoise_->model, rows, d.options_);
    if (!sums) {
        return sums.error();
    }
    d.sums_ = std::move(sums.value());
    return denoiser;
}

void FilmDenoiser::add(const PixelSample* batch, ConstPathRecords records, int count) {
    if (!sums_) {
        return;
    }
    const Clock::time_point begin = Clock::now();
    // Memory of the thread, kept from batch to batch.
    thread_local std::vector<const float*> paths;
    thread_local std::vector<std::size_t> pixels;
    const auto isSamePixel = [&](int a, int b) {
        return batch[a].x == batch[b].x && batch[a].y == batch[b].y;
    };
    // Pixels with equally many paths go to the network together.
    for (int first = 0, next = 0; first < count; first = next) {
        int samples = 1;
        while (first + samples < count && isSamePixel(first, first + samples)) {
            ++samples;
        }
        paths.clear();
        pixels.clear();
        for (next = first; next + samples <= count && isSamePixel(next, next + samples - 1) &&
                           (next + samples == count || !isSamePixel(next, next + samples));
             next += samples) {
            pixels.push_back(static_cast<std::size_t>(batch[next].y - data_.y) *
                                 static_cast<std::size_t>(data_.width) +
                             static_cast<std::size_t>(batch[next].x - data_.x));
            for (int s = 0; s < samples; ++s) {
                const PathRecord& record =
                    records[static_cast<std::size_t>(next) + static_cast<std::size_t>(s)];
                paths.push_back(reinterpret_cast<const float*>(&record));
            }
        }
        if (Status problem = sums_->add(pixels.data(), pixels.size(),
                                        static_cast<std::size_t>(samples), paths.data())) {
            const std::lock_guard lock(mutex_);
            failure_ = failure_ ? failure_ : std::move(problem);
            return;
        }
    }
    const auto taken = Clock::now() - begin;
    sumNanoseconds_.fetch_add(
        static_cast<std::uint64_t>(
            std::chrono::duration_cast<std::chrono::nanoseconds>(taken).count()),
        std::memory_order_relaxed);
}

void FilmDenoiser::clear() {
    if (sums_) {
        sums_->clear();
    }
    failure_.reset();
    sumNanoseconds_ = 0;
    times_ = {};
}

Result<DenoiseResult> FilmDenoiser::reconstruct(PathSamples kept, const std::atomic<bool>* stop) {
    if (failure_) {
        return *failure_;
    }
    options_.stop = stop;
    std::copy(std::begin(denoise_->worldToCamera), std::end(denoise_->worldToCamera),
              kept.worldToCamera);
    Result<DenoiseResult> result = sums_ ? mbfeat::denoise(*sums_, options_)
                                         : mbfeat::denoise(denoise_->model, kept, options_);
    options_.stop = nullptr;
    if (result) {
        times_.inference = result.value().gatherSeconds + result.value().inferenceSeconds;
        times_.splat = result.value().splatSeconds;
    }
    return result;
}

DenoiseTimes FilmDenoiser::times() const {
    DenoiseTimes times = times_;
    const int threads = denoise_->threads > 0 ? denoise_->threads : hardwareThreads();
    times.recording = static_cast<double>(sumNanoseconds_) * 1e-9 / threads;
    return times;
}

} // namespace mbfeat
