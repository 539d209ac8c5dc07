#include "denoise/pathSums.h"

#include <algorithm>
#include <utility>

namespace mbfeat {

PathSums::PathSums(std::shared_ptr<const DenoiseModel> model, ChannelPlan plan, int width,
                   int height)
    : model_(std::move(model)),
      plan_(std::move(plan)),
      width_(width),
      height_(height),
      planes_(static_cast<std::size_t>(model_->contract().classPlanes)) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    classes_.resize(pixels * kPathClasses * planes_);
    light_.resize(pixels * kPathClasses * lightChannels());
    counts_.resize(pixels);
}

std::size_t PathSums::bytes() const {
    return classes_.size() * sizeof(float) + light_.size() * sizeof(double) +
           counts_.size() * sizeof(std::uint32_t);
}

/// A pixel without paths holds zeros already, so that a film that is cleared before its first
/// sample is not written all over.
void PathSums::clear() {
    const std::size_t classes = kPathClasses * planes_;
    const std::size_t lights = kPathClasses * lightChannels();
    for (std::size_t pixel = 0; pixel < counts_.size(); ++pixel) {
        if (counts_[pixel] > 0) {
            std::fill_n(classes_.data() + pixel * classes, classes, 0.0F);
            std::fill_n(light_.data() + pixel * lights, lights, 0.0);
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
    std::vector<float> channels(plan_.size() * kGroup), embeddings(width * kGroup);
    PathClass classes[kPathGroup];
    std::uint64_t repaired = 0;
    for (std::size_t first = 0; first < pathCount; first += kGroup) {
        const std::size_t count = std::min(kGroup, pathCount - first);
        const float* const* const group = paths + first;
        const std::uint32_t usable =
            plan_.writeGroup(group, static_cast<int>(count), channels.data());
        encodePaths(encoder, channels.data(), static_cast<int>(count), embeddings.data(), classes);
        for (std::size_t i = 0; i < count; ++i) {
            if ((usable >> i & 1U) == 0) {
                ++repaired;
                continue;
            }
            const std::size_t pixel = pixels[(first + i) / samples];
            const std::size_t place = pixel * kPathClasses + static_cast<std::size_t>(classes[i]);
            float* const sums = classes_.data() + place * planes_;
            const float* const embedding = embeddings.data() + i * width;
            for (std::size_t o = 0; o < width; ++o) {
                sums[o] += embedding[o];
            }
            sums[width] += 1.0F;
            double* light = light_.data() + place * lightChannels();
            for (const std::size_t field : plan_.lights()) {
                for (std::size_t k = 0; k < 3; ++k) {
                    *light++ += static_cast<double>(group[i][field + k]);
                }
            }
            ++counts_[pixel];
        }
    }
    repaired_.fetch_add(repaired, std::memory_order_relaxed);
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
    if (classes.size() != kPathClasses * planes_ * pixelCount ||
        mask.size() != samples * kPathClasses * pixelCount) {
        return Error{model_->file(), "its sample graph gives other sizes than its metadata says. "
                                     "Export it anew."};
    }
    addClasses(pixels, pixelCount, classes);
    addLight(pixels, pixelCount, samples, paths, shares.data(), mask);
    return std::nullopt;
}

/// The network gives [class][plane][1][pixel].
void PathSums::addClasses(const std::size_t* pixels, std::size_t pixelCount,
                          const TensorView& classes) {
    const std::size_t all = kPathClasses * planes_;
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

/// Masks are [sample][class][1][pixel].
void PathSums::addLight(const std::size_t* pixels, std::size_t pixelCount, std::size_t samples,
                        const float* const* paths, const float* shares, const TensorView& mask) {
    for (std::size_t i = 0; i < pixelCount; ++i) {
        double* const all = light_.data() + pixels[i] * kPathClasses * lightChannels();
        for (std::size_t s = 0; s < samples; ++s) {
            for (std::size_t c = 0; c < kPathClasses; ++c) {
                const float weight =
                    mask.data[(s * kPathClasses + c) * pixelCount + i] * shares[s * pixelCount + i];
                if (weight == 0.0F) {
                    continue;
                }
                const float* const path = paths[i * samples + s];
                double* to = all + c * lightChannels();
                for (const std::size_t field : plan_.lights()) {
                    for (std::size_t k = 0; k < 3; ++k) {
                        *to++ += static_cast<double>(weight) * static_cast<double>(path[field + k]);
                    }
                }
            }
        }
    }
}

void PathSums::means(int x0, int y0, int x1, int y1, std::vector<float>& classes,
                     std::vector<float>& light) const {
    const auto columns = static_cast<std::size_t>(x1 - x0);
    const std::size_t area = columns * static_cast<std::size_t>(y1 - y0);
    const std::size_t planes = kPathClasses * planes_;
    const std::size_t lights = kPathClasses * lightChannels();
    classes.assign(planes * area, 0.0F);
    light.assign(lights * area, 0.0F);
    // Sixteen pixels at a time, whose values are a cache line of each plane.
    constexpr int kBlock = 16;
    for (int y = y0; y < y1; ++y) {
        for (int first = x0; first < x1; first += kBlock) {
            const int last = std::min(first + kBlock, x1);
            const std::size_t out =
                static_cast<std::size_t>(y - y0) * columns + static_cast<std::size_t>(first - x0);
            const std::size_t pixel =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(first);
            const auto count = static_cast<std::size_t>(last - first);
            double scale[kBlock];
            for (std::size_t i = 0; i < count; ++i) {
                scale[i] = counts_[pixel + i] == 0 ? 0.0 : 1.0 / counts_[pixel + i];
            }
            const auto write = [&](const auto* from, std::size_t values, std::vector<float>& to) {
                const auto* const in = from + pixel * values;
                for (std::size_t p = 0; p < values; ++p) {
                    for (std::size_t i = 0; i < count; ++i) {
                        to[p * area + out + i] =
                            static_cast<float>(static_cast<double>(in[i * values + p]) * scale[i]);
                    }
                }
            };
            write(classes_.data(), planes, classes);
            write(light_.data(), lights, light);
        }
    }
}

std::uint64_t PathSums::emptyPixels() const {
    return static_cast<std::uint64_t>(std::count(counts_.begin(), counts_.end(), 0U));
}

} // namespace mbfeat
