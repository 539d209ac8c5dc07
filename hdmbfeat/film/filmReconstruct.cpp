// A film's colours, denoised.
#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "denoise/combine.h"
#include "film/filmImpl.h"

namespace mbfeat {

/// Mixes the reconstruction with what was rendered where that has enough samples; the parts of the
/// colour with the same weights, so that they still add up.
void Film::Impl::combine(std::vector<float>& planes) const {
    constexpr std::uint64_t kFewest = 16; // samples a pixel, for a variance that can be trusted
    std::uint64_t samples = 0;
    for (std::size_t pixel = 0; pixel < pixelCount(); ++pixel) {
        samples += counts->data()[pixel].load();
    }
    if (samples < kFewest * pixelCount()) {
        return;
    }
    std::vector<float> rendered(planes.size()), variance(3 * pixelCount());
    const std::vector<std::string>& names = denoiser->aovs();
    for (std::size_t pixel = 0; pixel < pixelCount(); ++pixel) {
        const HeldPixel held(counts->data()[pixel]);
        if (held.count() == 0) {
            continue;
        }
        const PixelValues values{held.count(), sumsOf(pixel), wordsOf(pixel)};
        float out[3];
        resolveVariance(values, out);
        for (std::size_t c = 0; c < 3; ++c) {
            variance[c * pixelCount() + pixel] = out[c];
        }
        for (std::size_t light = 0; light < names.size(); ++light) {
            resolveMean(values, meanSlot(names[light]), 3, out);
            for (std::size_t c = 0; c < 3; ++c) {
                rendered[(light * 3 + c) * pixelCount() + pixel] = out[c];
            }
        }
    }
    const std::vector<float> weights = combineWeights(
        {window.data.width, window.data.height, rendered.data(), variance.data(), planes.data()});
    float* mixed = planes.data();
    const float* other = rendered.data();
    for (std::size_t plane = 0; plane < 3 * names.size(); ++plane) {
        for (const float weight : weights) {
            *mixed += weight * (*other++ - *mixed);
            ++mixed;
        }
    }
}

/// The first sum of a bound AOV that is a mean.
int Film::Impl::meanSlot(const std::string& name) const {
    const auto found = std::find_if(aovs.begin(), aovs.end(),
                                    [&](const AovDescriptor& aov) { return aov.name == name; });
    return slots[static_cast<std::size_t>(found - aovs.begin())];
}

Status Film::reconstruct(const std::atomic<bool>* stop) {
    Impl& impl = *impl_;
    if (!impl.denoiser) {
        return std::nullopt;
    }
    PathSamples kept;
    kept.width = impl.window.data.width;
    kept.height = impl.window.data.height;
    if (impl.denoiser->denoise().keepsPaths()) {
        kept.capacity = pathSampleCapacity();
        kept.data = pathSamples();
        for (const PathSampleField& field : impl.layout) {
            kept.fields.push_back(field.name);
        }
        for (std::size_t pixel = 0; pixel < impl.pixelCount(); ++pixel) {
            kept.counts.push_back(std::min(impl.counts->data()[pixel].load(),
                                           static_cast<std::uint32_t>(impl.capacity)));
        }
    }
    Result<DenoiseResult> result = impl.denoiser->reconstruct(std::move(kept), stop);
    if (!result) {
        return result.error();
    }
    if (!result.value().stopped) {
        std::vector<float>& planes = result.value().image;
        if (impl.denoiser->denoise().settings.combine) {
            impl.combine(planes);
        }
        auto image = std::make_shared<const std::vector<float>>(std::move(planes));
        const std::lock_guard lock(impl.reconstructionMutex);
        impl.reconstruction = std::move(image);
    }
    return std::nullopt;
}

} // namespace mbfeat
