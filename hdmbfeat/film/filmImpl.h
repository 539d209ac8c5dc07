// What a film holds. Internal: film.cpp adds samples to it, filmResolve.cpp makes images of it, and
// filmReconstruct.cpp has it denoised.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "film/film.h"
#include "film/filmDenoiser.h"
#include "film/filmMemory.h"
#include "film/filmStorage.h"
#include "film/pixelCount.h"

namespace mbfeat {

struct Film::Impl {
    ImageWindow window;
    std::optional<AffineD> cameraToWorld;
    std::vector<AovDescriptor> aovs;
    std::vector<int> slots; ///< per AOV the first accumulator: a sum of a mean, else a word
    std::vector<std::string> primvars;
    std::vector<PathSampleField> layout;
    std::uint32_t flags = 0;

    // A pixel's doubles: the weight's sum, the means' sums, the spread of color. Its words: the
    // nearest sample's squared distance and values, the count of non-finite samples.
    RunList means, nearest;
    bool hasNearest = false, hasVariance = false, hasNonFinite = false;
    int sumStride = 0, wordStride = 0, spreadSlot = 0, nonFiniteSlot = 0;
    FilmMemory accumulators; ///< the sums of all pixels, then the words of all
    double* sums = nullptr;
    std::uint32_t* words = nullptr;
    std::optional<ZeroedArray<PixelCount>> counts;

    bool extendedSamples = false;
    std::size_t capacity = 0; ///< kept paths a pixel; 0: none are kept
    std::optional<ZeroedArray<float>> samples;

    std::unique_ptr<FilmDenoiser> denoiser; ///< null: nothing is denoised
    // What it made, [aov][3][height][width]; null until then. Guarded by the mutex.
    mutable std::mutex reconstructionMutex;
    std::shared_ptr<const std::vector<float>> reconstruction;

    Impl(const FilmRequest& request, std::unique_ptr<FilmDenoiser> itsDenoiser);
    void bind(const std::string& name);
    void layOut();
    void allocate();

    std::size_t pixelCount() const {
        return static_cast<std::size_t>(window.data.width) * window.data.height;
    }
    std::size_t pixelIndex(int x, int y) const {
        assert(x >= window.data.x && x < window.data.x + window.data.width);
        assert(y >= window.data.y && y < window.data.y + window.data.height);
        return static_cast<std::size_t>(y - window.data.y) * window.data.width +
               static_cast<std::size_t>(x - window.data.x);
    }
    double* sumsOf(std::size_t pixel) { return sums + pixel * static_cast<std::size_t>(sumStride); }
    const double* sumsOf(std::size_t pixel) const {
        return sums + pixel * static_cast<std::size_t>(sumStride);
    }
    std::uint32_t* wordsOf(std::size_t pixel) {
        return words + pixel * static_cast<std::size_t>(wordStride);
    }
    const std::uint32_t* wordsOf(std::size_t pixel) const {
        return words + pixel * static_cast<std::size_t>(wordStride);
    }
    // The pixel is held.
    void start(std::size_t pixel);
    void addMeans(std::size_t pixel, ConstPathRecords records, int recordCount);
    void addOthers(std::size_t pixel, std::uint32_t count, const PathRecord& record);
    void keep(std::size_t pixel, std::uint32_t index, const PathRecord& record);
    void addNearest(std::uint32_t* pixelWords, bool first, const PathRecord& record) const;

    /// What a pixel holds, in the film while it is held or in a copy.
    struct PixelValues {
        std::uint32_t count;
        const double* sums;
        const std::uint32_t* words;
    };
    /// Of sums, to be means. Filters with negative lobes can cancel while samples are few: then the
    /// plain mean is the better estimate.
    static double meanScale(double weight, std::uint32_t count) {
        return 1.0 / (weight != 0.0 ? weight : count);
    }
    static void resolveMean(const PixelValues& pixel, int slot, int width, float* out);
    void resolveVariance(const PixelValues& pixel, float* out) const;
    template <class T>
    void resolvePixel(int aovIndex, const PixelValues& pixel, T* out) const;
    template <class T>
    void resolveAll(int aovIndex, T* out) const;
    void combine(std::vector<float>& planes) const;
    int meanSlot(const std::string& name) const;
    template <class T>
    void replaceReconstructed(int aovIndex, std::size_t firstPixel, std::size_t pixels,
                              T* out) const;
};

} // namespace mbfeat
