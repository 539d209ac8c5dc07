#include "denoise/pathSums.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"

namespace mbfeat {

PathSums::PathSums(std::shared_ptr<const DenoiseModel> model, ChannelPlan plan, int width,
                   int height)
    : model_(std::move(model)),
      plan_(std::move(plan)),
      width_(width),
      height_(height),
      planes_(static_cast<std::size_t>(model_->contract().classPlanes)) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    classes_.resize(pixels * classCount() * planes_);
    light_.resize(pixels * classCount() * storedLights());
    divisors_.resize(isDemodulated() ? pixels * classCount() * 3 : 0);
    counts_.resize(pixels);
}

std::size_t PathSums::bytes() const {
    return classes_.size() * sizeof(float) + (light_.size() + divisors_.size()) * sizeof(double) +
           counts_.size() * sizeof(std::uint32_t);
}

/// A pixel without paths holds zeros already, so that a film that is cleared before its first
/// sample is not written all over.
void PathSums::clear() {
    const std::size_t classes = classCount() * planes_;
    const std::size_t lights = classCount() * storedLights();
    const std::size_t divisors = isDemodulated() ? classCount() * 3 : 0;
    for (std::size_t pixel = 0; pixel < counts_.size(); ++pixel) {
        if (counts_[pixel] > 0) {
            std::fill_n(classes_.data() + pixel * classes, classes, 0.0F);
            std::fill_n(light_.data() + pixel * lights, lights, 0.0);
            std::fill_n(divisors_.data() + pixel * divisors, divisors, 0.0);
            counts_[pixel] = 0;
        }
    }
    repaired_ = 0;
}

Status PathSums::add(const std::size_t* pixels, std::size_t pixelCount, std::size_t samples,
                     const float* const* paths) {
    if (model_->encoder() == nullptr) {
        return addByGraph(pixels, pixelCount, samples, paths);
    }
    addByEncoder(pixels, pixelCount * samples, samples, paths);
    return std::nullopt;
}

void PathSums::addByEncoder(const std::size_t* pixels, std::size_t pathCount, std::size_t samples,
                            const float* const* paths) {
    constexpr auto kGroup = static_cast<std::size_t>(kPathGroup);
    const PathEncoder& encoder = *model_->encoder();
    const auto width = static_cast<std::size_t>(encoder.width());
    // What all ways have in common, and of each way the guides and a count.
    const auto ahead = static_cast<std::size_t>(encoder.embeddingWidth());
    const std::size_t stride = width - ahead + 1;
    std::vector<float> channels(plan_.size() * kGroup), embeddings(width * kGroup);
    float divisors[3 * kPathGroup];
    PathClass classes[kPathGroup];
    PathWay ways[kPathGroup];
    std::uint64_t repaired = 0;
    for (std::size_t first = 0; first < pathCount; first += kGroup) {
        const std::size_t count = std::min(kGroup, pathCount - first);
        const float* const* const group = paths + first;
        const std::uint32_t usable =
            plan_.writeGroup(group, static_cast<int>(count), channels.data());
        encodePaths(encoder, channels.data(), static_cast<int>(count), embeddings.data(), classes,
                    isDemodulated() ? divisors : nullptr);
        if (encoder.hasWays) {
            findWays(channels.data(), static_cast<int>(count), ways);
        }
        for (std::size_t i = 0; i < count; ++i) {
            if ((usable >> i & 1U) == 0) {
                ++repaired;
                continue;
            }
            const std::size_t pixel = pixels[(first + i) / samples];
            const std::size_t own = classCount() > 1 ? static_cast<std::size_t>(classes[i]) : 0;
            const std::size_t place = pixel * classCount() + own;
            float* const sums = classes_.data() + place * planes_;
            const float* const embedding = embeddings.data() + i * width;
            for (std::size_t o = 0; o < ahead; ++o) {
                sums[o] += embedding[o];
            }
            float* const guides =
                sums + ahead + (encoder.hasWays ? static_cast<std::size_t>(ways[i]) : 0) * stride;
            for (std::size_t o = ahead; o < width; ++o) {
                guides[o - ahead] += embedding[o];
            }
            guides[width - ahead] += 1.0F;
            addLightOf(group[i], 1.0, divisors + i, kGroup, place);
            ++counts_[pixel];
        }
    }
    repaired_.fetch_add(repaired, std::memory_order_relaxed);
}

void PathSums::addLightOf(const float* path, double weight, const float* divisor,
                          std::size_t stride, std::size_t place) {
    double* plain = light_.data() + place * storedLights();
    double* divided = plain + lightChannels();
    const bool divides = isDemodulated();
    double by[3] = {1.0, 1.0, 1.0};
    for (std::size_t k = 0; divides && k < 3; ++k) {
        by[k] = static_cast<double>(divisor[k * stride]);
        divisors_[place * 3 + k] += weight * by[k];
    }
    for (const std::size_t field : plan_.lights()) {
        for (std::size_t k = 0; k < 3; ++k) {
            const double light = weight * static_cast<double>(path[field + k]);
            *plain++ += light;
            if (divides) {
                *divided++ += light / by[k];
            }
        }
    }
}

Status PathSums::addByGraph(const std::size_t* pixels, std::size_t pixelCount, std::size_t samples,
                            const float* const* paths) {
    std::vector<float> channels(samples * plan_.size() * pixelCount);
    std::vector<float> shares(samples * pixelCount);
    std::uint64_t repaired = 0;
    for (std::size_t s = 0; s < samples; ++s) {
        for (std::size_t i = 0; i < pixelCount; ++i) {
            const float* const path = paths[i * samples + s];
            float* const first = channels.data() + s * plan_.size() * pixelCount + i;
            const bool usable = plan_.write(path, first, pixelCount);
            shares[s * pixelCount + i] = usable ? 1.0F : 0.0F;
            counts_[pixels[i]] += usable ? 1U : 0U;
            repaired += usable ? 0 : 1;
        }
    }
    repaired_.fetch_add(repaired, std::memory_order_relaxed);
    const auto n = static_cast<std::int64_t>(samples);
    const auto p = static_cast<std::int64_t>(pixelCount);
    Result<OnnxSession::Outputs> outputs = model_->sampleGraph().run(
        {{channels.data(), {n, static_cast<std::int64_t>(plan_.size()), 1, p}},
         {shares.data(), {n, 1, 1, p}}});
    if (!outputs) {
        return outputs.error();
    }
    const TensorView& classes = outputs.value()[0];
    const TensorView& mask = outputs.value()[1];
    if (classes.size() != classCount() * planes_ * pixelCount ||
        mask.size() != samples * classCount() * pixelCount ||
        (isDemodulated() && outputs.value()[2].size() != samples * 3 * pixelCount)) {
        return Error{model_->file(), "its sample graph gives other sizes than its metadata says. "
                                     "Export it anew."};
    }
    addClasses(pixels, pixelCount, classes);
    addLight(pixels, pixelCount, samples, paths, shares.data(), mask,
             isDemodulated() ? outputs.value()[2].data : nullptr);
    return std::nullopt;
}

/// The network gives [class][plane][1][pixel].
void PathSums::addClasses(const std::size_t* pixels, std::size_t pixelCount,
                          const TensorView& classes) {
    const std::size_t all = classCount() * planes_;
    constexpr std::size_t kBlock = 16; // a cache line of each plane
    for (std::size_t begin = 0; begin < pixelCount; begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, pixelCount);
        for (std::size_t plane = 0; plane < all; ++plane) {
            const float* const from = classes.data + plane * pixelCount;
            for (std::size_t i = begin; i < end; ++i) {
                classes_[pixels[i] * all + plane] += from[i];
            }
        }
    }
}

/// Masks are [sample][class][1][pixel], divisors [sample][3][1][pixel].
void PathSums::addLight(const std::size_t* pixels, std::size_t pixelCount, std::size_t samples,
                        const float* const* paths, const float* shares, const TensorView& mask,
                        const float* divisors) {
    for (std::size_t i = 0; i < pixelCount; ++i) {
        for (std::size_t s = 0; s < samples; ++s) {
            for (std::size_t c = 0; c < classCount(); ++c) {
                const float weight =
                    mask.data[(s * classCount() + c) * pixelCount + i] * shares[s * pixelCount + i];
                if (weight != 0.0F) {
                    const float* const divisor =
                        divisors == nullptr ? nullptr : divisors + s * 3 * pixelCount + i;
                    addLightOf(paths[i * samples + s], static_cast<double>(weight), divisor,
                               pixelCount, pixels[i] * classCount() + c);
                }
            }
        }
    }
}

PathSums::Means PathSums::means(const SplatTile& area, int gridWidth, int gridHeight,
                                ThreadPool& pool) const {
    const auto columns = static_cast<std::size_t>(area.x1 - area.x0);
    const std::size_t pixels = columns * static_cast<std::size_t>(area.y1 - area.y0);
    const std::size_t grid =
        static_cast<std::size_t>(gridWidth) * static_cast<std::size_t>(gridHeight);
    Means found;
    const std::size_t classPlanes = classCount() * planes_;
    // All of it is written below, by all threads, which then share the page faults; zeros, as of a
    // vector, would be written by one.
    // NOLINTNEXTLINE(cppcoreguidelines-owning-memory)
    found.classes.reset(new float[classPlanes * grid]);
    found.light.resize(classCount() * storedLights() * pixels);
    found.divisor.resize(isDemodulated() ? classCount() * 3 * pixels : 0);
    constexpr std::int64_t kRows = 4; // at a time
    pool.run(0, gridHeight, kRows, nullptr, [&](std::int64_t index, int /*thread*/) {
        const auto row = static_cast<std::size_t>(index);
        float* const classes = found.classes.get() + row * static_cast<std::size_t>(gridWidth);
        const bool isInside = index < area.y1 - area.y0;
        const std::size_t written = isInside ? columns : 0;
        for (std::size_t plane = 0; plane < classPlanes; ++plane) {
            std::fill(classes + plane * grid + written,
                      classes + plane * grid + static_cast<std::size_t>(gridWidth), 0.0F);
        }
        if (isInside) {
            const RowOfMeans to{classes, grid, found.light.data() + row * columns,
                                isDemodulated() ? found.divisor.data() + row * columns : nullptr,
                                pixels};
            meansOfRow((static_cast<std::size_t>(area.y0) + row) *
                               static_cast<std::size_t>(width_) +
                           static_cast<std::size_t>(area.x0),
                       columns, to);
        }
    });
    return found;
}

void PathSums::meansOfRow(std::size_t pixel, std::size_t columns, const RowOfMeans& to) const {
    // Sixteen pixels at a time, whose values are a cache line of each plane.
    constexpr std::size_t kBlock = 16;
    for (std::size_t first = 0; first < columns; first += kBlock) {
        const std::size_t count = std::min(kBlock, columns - first);
        double scale[kBlock];
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t paths = counts_[pixel + first + i];
            scale[i] = paths == 0 ? 0.0 : 1.0 / paths;
        }
        const auto write = [&](const auto* sums, std::size_t values, float* out,
                               std::size_t plane) {
            const auto* const in = sums + (pixel + first) * values;
            for (std::size_t p = 0; p < values; ++p) {
                for (std::size_t i = 0; i < count; ++i) {
                    out[p * plane + first + i] =
                        static_cast<float>(static_cast<double>(in[i * values + p]) * scale[i]);
                }
            }
        };
        write(classes_.data(), classCount() * planes_, to.classes, to.classPlane);
        write(light_.data(), classCount() * storedLights(), to.light, to.plane);
        for (std::size_t c = 0; isDemodulated() && c < classCount(); ++c) {
            for (std::size_t i = 0; i < count; ++i) {
                const std::size_t place = (pixel + first + i) * classCount() + c;
                const float paths = pathsOf(place);
                for (std::size_t k = 0; paths > 0.0F && k < 3; ++k) {
                    to.divisor[(c * 3 + k) * to.plane + first + i] =
                        static_cast<float>(divisors_[place * 3 + k] / static_cast<double>(paths));
                }
            }
        }
    }
}

float PathSums::pathsOf(std::size_t place) const {
    if (classCount() == 1) {
        return static_cast<float>(counts_[place]);
    }
    return classes_[place * planes_ + planes_ - 1];
}

std::uint64_t PathSums::emptyPixels() const {
    return static_cast<std::uint64_t>(std::count(counts_.begin(), counts_.end(), 0U));
}

} // namespace mbfeat
