// What a layered network keeps of an image's paths: sums over the paths of a pixel, by class. They
// take the same memory for any number of samples, and can be added to while the image renders.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "denoise/channels.h"
#include "denoise/model.h"
#include "denoise/splat.h"

namespace mbfeat {

class ThreadPool;

class PathSums {
public:
    /// For an image of that size, of a layered model.
    PathSums(std::shared_ptr<const DenoiseModel> model, ChannelPlan plan, int width, int height);

    /// Adds `samples` paths of each of some pixels, paths[pixel * samples + sample]. Different
    /// threads may add to different pixels at once; a pixel's paths are added in order. Paths that
    /// are not finite are counted and left out. By the model's encoder where it has one, else by
    /// its graph.
    Status add(const std::size_t* pixels, std::size_t pixelCount, std::size_t samples,
               const float* const* paths);
    /// Forgets all paths.
    void clear();

    int width() const { return width_; }
    int height() const { return height_; }
    std::size_t lightChannels() const { return 3 * plan_.lights().size(); }
    std::size_t planes() const { return planes_; } ///< of a class
    const DenoiseModel& model() const { return *model_; }
    std::uint64_t repaired() const { return repaired_; }
    std::size_t bytes() const;

    /// Means over a pixel's usable paths, 0 where it has none, of an area, row-major.
    struct Means {
        std::unique_ptr<float[]> classes; ///< [class][plane]
        std::vector<float> light;   ///< [class][light][3], of demodulated models then the divided
        std::vector<float> divisor; ///< [class][3], of demodulated models, over the class's paths
    };
    /// Classes are [gridHeight][gridWidth], at least the area's, zero beyond it. On the pool's
    /// threads.
    Means means(const SplatTile& area, int gridWidth, int gridHeight, ThreadPool& pool) const;
    /// Pixels without a usable path.
    std::uint64_t emptyPixels() const;

private:
    Status addByGraph(const std::size_t* pixels, std::size_t pixelCount, std::size_t samples,
                      const float* const* paths);
    void addByEncoder(const std::size_t* pixels, std::size_t pathCount, std::size_t samples,
                      const float* const* paths);
    void addClasses(const std::size_t* pixels, std::size_t pixelCount, const TensorView& classes);
    void addLight(const std::size_t* pixels, std::size_t pixelCount, std::size_t samples,
                  const float* const* paths, const float* shares, const TensorView& mask,
                  const float* divisors);
    /// Where a row of Means begins, and how far its planes lie apart.
    struct RowOfMeans {
        float* classes;
        std::size_t classPlane;
        float* light;
        float* divisor;
        std::size_t plane;
    };
    /// Of `columns` pixels from one on.
    void meansOfRow(std::size_t pixel, std::size_t columns, const RowOfMeans& to) const;
    bool isDemodulated() const { return model_->contract().demodulated != 0; }
    std::size_t classCount() const { return static_cast<std::size_t>(model_->contract().classes); }
    std::size_t storedLights() const { return (isDemodulated() ? 2 : 1) * lightChannels(); }
    /// Usable paths of a class of a pixel.
    float pathsOf(std::size_t place) const;
    /// Adds a path's light to `place`, a class of a pixel; of its divisor every `stride`th float.
    void addLightOf(const float* path, double weight, const float* divisor, std::size_t stride,
                    std::size_t place);

    std::shared_ptr<const DenoiseModel> model_;
    ChannelPlan plan_;
    int width_, height_;
    std::size_t planes_ = 0;
    // A pixel's numbers lie side by side: it is added to as a whole.
    std::vector<float> classes_;        ///< [pixel][class][plane]
    std::vector<double> light_;         ///< [pixel][class][light]; no sample may be lost in it
    std::vector<double> divisors_;      ///< [pixel][class][3], of demodulated models
    std::vector<std::uint32_t> counts_; ///< usable paths
    std::atomic<std::uint64_t> repaired_{0};
};

} // namespace mbfeat
