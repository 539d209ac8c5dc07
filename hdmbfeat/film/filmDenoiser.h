// The denoiser of a film: takes in paths while the film renders, and reconstructs its image.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/settings.h"
#include "denoise/denoiser.h"
#include "integrate/integrator.h"
#include "integrate/pathRecord.h"
#include "scene/camera.h"

namespace mbfeat {

/// How a film is denoised: part of a FilmRequest.
struct FilmDenoise {
    std::shared_ptr<const DenoiseModel> model;
    DenoiseSettings settings;
    int threads = 0;
    float worldToCamera[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

    /// Whether the model needs the film's kept paths; layered ones sum them up.
    bool keepsPaths() const { return model->contract().kind != DenoiseContract::Kind::kLayered; }
};

/// Opens the settings' model for a film seen by that camera; an error says why the image stays raw.
Result<std::shared_ptr<const FilmDenoise>> prepareDenoise(const DenoiseSettings& settings,
                                                          int threads, const Camera& camera);
/// The same with the rotation from the world to the camera, row-major.
Result<std::shared_ptr<const FilmDenoise>> prepareDenoise(const DenoiseSettings& settings,
                                                          int threads, const float* worldToCamera);

/// Where the time for denoising went, seconds of the clock.
struct DenoiseTimes {
    double recording = 0.0; ///< sums of paths, while the film rendered
    double inference = 0.0, splat = 0.0;

    void add(const DenoiseTimes& other) {
        recording += other.recording;
        inference += other.inference;
        splat += other.splat;
    }
};

/// Threads: add() may run for different pixels at once; reconstruct() after the last of them.
class FilmDenoiser {
public:
    /// `aovs` are the film's: those that add up to `color` are reconstructed with it. Kept paths
    /// are needed where the FilmDenoise says so.
    static Result<std::unique_ptr<FilmDenoiser>> make(std::shared_ptr<const FilmDenoise> denoise,
                                                      const ImageWindow& window,
                                                      const std::vector<std::string>& aovs);

    /// RecordFlags that it needs.
    std::uint32_t recordFlags() const { return flags_; }
    /// AOVs that it reconstructs, `color` first; of each three planes, see reconstruct().
    const std::vector<std::string>& aovs() const { return aovs_; }
    std::size_t bytes() const { return sums_ ? sums_->bytes() : 0; }

    /// Paths of a batch, those of a pixel side by side.
    void add(const PixelSample* batch, ConstPathRecords records, int count);
    /// Forgets all paths, and what went wrong with them.
    void clear();
    /// Planes [aov][3][height][width]. `kept` are the film's paths where they are needed: its
    /// fields and rotation are filled in here.
    Result<DenoiseResult> reconstruct(PathSamples kept, const std::atomic<bool>* stop);

    const FilmDenoise& denoise() const { return *denoise_; }
    DenoiseTimes times() const;

private:
    FilmDenoiser() = default;

    std::shared_ptr<const FilmDenoise> denoise_;
    PixelRect data_;
    std::uint32_t flags_ = 0;
    std::vector<std::string> aovs_;
    DenoiseOptions options_;
    std::unique_ptr<PathSums> sums_;               ///< of layered models
    std::atomic<std::uint64_t> sumNanoseconds_{0}; ///< of all threads
    DenoiseTimes times_;
    std::mutex mutex_;
    Status failure_; ///< the first that add() met
};

} // namespace mbfeat
