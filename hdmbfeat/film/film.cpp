#include "film/film.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <mutex>
#include <new>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include <xsimd/xsimd.hpp>

#include "denoise/combine.h"
#include "film/filmDenoiser.h"
#include "film/filmMemory.h"
#include "film/filmStorage.h"
#include "film/pathRow.h"
#include "film/pixelCount.h"

namespace mbfeat {

namespace {

constexpr std::string_view kPrimvarPrefix = "primvars:";
// The AOV color reads its alpha behind its radiance.
static_assert(offsetof(PathRecord, alpha) == offsetof(PathRecord, radiance) + sizeof(Rgb));

constexpr int kMostChannels = 4; ///< of an AOV

/// Adds weight x value of `4 Quads` neighbouring words of every record to as many sums.
template <int Quads>
void addQuads(double* sums, ConstPathRecords records, int recordCount, int word) {
    using Four = xsimd::batch<double>;
    static_assert(Four::size <= 4);
    constexpr int kBatches = Quads * (4 / static_cast<int>(Four::size));
    Four total[kBatches];
    for (int k = 0; k < kBatches; ++k) {
        total[k] = Four::load_unaligned(sums + k * Four::size);
    }
    for (int i = 0; i < recordCount; ++i) {
        const PathRecord& record = records[static_cast<std::size_t>(i)];
        const Four weight(static_cast<double>(record.filterWeight));
        const float* const values = reinterpret_cast<const float*>(&record) + word;
        for (int k = 0; k < kBatches; ++k) {
            total[k] += weight * Four::load_unaligned(values + k * Four::size);
        }
    }
    for (int k = 0; k < kBatches; ++k) {
        total[k].store_unaligned(sums + k * Four::size);
    }
}

void addOne(double* sum, ConstPathRecords records, int recordCount, int word) {
    double total = *sum;
    for (int i = 0; i < recordCount; ++i) {
        const PathRecord& record = records[static_cast<std::size_t>(i)];
        const float* const values = reinterpret_cast<const float*>(&record);
        total += static_cast<double>(record.filterWeight) * static_cast<double>(values[word]);
    }
    *sum = total;
}

std::int32_t toInt(float value) {
    constexpr float kLimit = 2147483520.0F; // the largest float below 2^31
    return std::isnan(value) ? 0 : static_cast<std::int32_t>(std::clamp(value, -kLimit, kLimit));
}

} // namespace

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

Film::Impl::Impl(const FilmRequest& request, std::unique_ptr<FilmDenoiser> itsDenoiser)
    : window(request.window),
      cameraToWorld(request.cameraToWorld),
      denoiser(std::move(itsDenoiser)) {
    bind("color");
    for (const std::string& name : request.aovs) {
        bind(name);
    }
    for (const AovDescriptor& aov : aovs) {
        flags |= aov.recordFlags;
    }
    // The denoiser weighs its image against what was rendered.
    hasVariance = denoiser != nullptr;
    layOut();
    flags |= denoiser ? denoiser->recordFlags() : 0U;
    const bool keepsForDenoiser = denoiser && denoiser->denoise().keepsPaths();
    if ((request.keepPathSamples || keepsForDenoiser) && request.samplesPerPixel > 0) {
        extendedSamples = request.extendedPathSamples || keepsForDenoiser;
        capacity = static_cast<std::size_t>(request.samplesPerPixel);
        layout = pathSampleFields(extendedSamples);
        flags |= kRecordFeatures | kRecordFirstHit;
        flags |= extendedSamples ? kRecordExtended : 0U;
    }
    allocate();
}

void Film::Impl::bind(const std::string& name) {
    const bool bound = std::any_of(aovs.begin(), aovs.end(),
                                   [&](const AovDescriptor& aov) { return aov.name == name; });
    std::optional<AovDescriptor> aov = findAov(name);
    if (bound || !aov) {
        return;
    }
    if ((aov->recordFlags & kRecordPrimvars) != 0) {
        if (primvars.size() == kMaxPrimvarAovs) {
            return;
        }
        aov->recordOffset += primvars.size() * sizeof(Float4);
        primvars.push_back(name.substr(kPrimvarPrefix.size()));
    }
    aovs.push_back(std::move(*aov));
}

/// Gives every bound value an accumulator. Values that lie side by side in the record get
/// neighbouring ones, so that add() is a few long loops whatever AOVs are bound.
void Film::Impl::layOut() {
    for (const AovDescriptor& aov : aovs) {
        if (aov.reduction == AovReduction::kMean) {
            means.add(aov.recordOffset, aov.width());
        } else if (aov.reduction == AovReduction::kNearest) {
            nearest.add(aov.recordOffset, aov.width());
        }
        hasVariance = hasVariance || aov.reduction == AovReduction::kVariance;
        hasNonFinite = hasNonFinite ||
                       (aov.reduction == AovReduction::kSum && aov.recordOffset != kNoRecordField);
    }
    means.finish();
    nearest.finish();
    hasNearest = nearest.size() > 0;
    spreadSlot = 1 + means.size();
    sumStride = spreadSlot + (hasVariance ? kSpreadSize : 0);
    nonFiniteSlot = hasNearest ? 1 + nearest.size() : 0;
    wordStride = nonFiniteSlot + (hasNonFinite ? 1 : 0);
    for (const AovDescriptor& aov : aovs) {
        const bool isMean = aov.reduction == AovReduction::kMean;
        const bool isNearest = aov.reduction == AovReduction::kNearest;
        slots.push_back(isMean      ? 1 + means.slot(aov.recordOffset)
                        : isNearest ? 1 + nearest.slot(aov.recordOffset)
                                    : 0);
    }
}

void Film::Impl::allocate() {
    // In double, and before any size is multiplied out: hostile resolutions overflow integers. No
    // x86-64 process has an address space of more than 2^47 bytes.
    const double perPixel =
        8.0 * sumStride + 4.0 * wordStride + 4.0 +
        4.0 * static_cast<double>(capacity) * static_cast<double>(layout.size());
    if (static_cast<double>(window.data.width) * window.data.height * perPixel > 0x1p47) {
        throw std::bad_alloc();
    }
    // Not zeroed: start() does that for each pixel.
    const std::size_t sumCount = pixelCount() * static_cast<std::size_t>(sumStride);
    const std::size_t wordCount = pixelCount() * static_cast<std::size_t>(wordStride);
    accumulators = FilmMemory(sumCount * sizeof(double) + wordCount * sizeof(std::uint32_t));
    sums = static_cast<double*>(accumulators.data());
    words = reinterpret_cast<std::uint32_t*>(sums + sumCount);
    counts.emplace(pixelCount());
    if (capacity > 0) {
        samples.emplace(pixelCount() * capacity * layout.size());
    }
}

Film::Film(const FilmRequest& request) : Film(request, nullptr) {}

Film::Film(const FilmRequest& request, std::unique_ptr<FilmDenoiser> denoiser)
    : impl_(std::make_unique<Impl>(request, std::move(denoiser))) {}

Film::~Film() = default;

const ImageWindow& Film::window() const {
    return impl_->window;
}

const std::optional<AffineD>& Film::cameraToWorld() const {
    return impl_->cameraToWorld;
}

std::uint32_t Film::recordFlags() const {
    return impl_->flags;
}

const std::vector<std::string>& Film::primvars() const {
    return impl_->primvars;
}

const std::vector<AovDescriptor>& Film::aovs() const {
    return impl_->aovs;
}

/// Ids and depths follow the sample nearest the pixel centre, the earlier one of two as near.
void Film::Impl::addNearest(std::uint32_t* pixelWords, bool first, const PathRecord& record) const {
    const float dx = record.subpixel.x - 0.5F;
    const float dy = record.subpixel.y - 0.5F;
    const float distance = dx * dx + dy * dy;
    float nearestYet = 0.0F;
    std::memcpy(&nearestYet, pixelWords, kWord);
    if (!first && !(distance < nearestYet)) {
        return;
    }
    std::memcpy(pixelWords, &distance, kWord);
    std::uint32_t* out = pixelWords + 1;
    const auto* bytes = reinterpret_cast<const unsigned char*>(&record);
    for (const Run& run : nearest.runs()) {
        std::memcpy(out, bytes + run.word * kWord, static_cast<std::size_t>(run.count) * kWord);
        out += run.count;
    }
}

/// Stores the path in the order of pathSampleFields().
void Film::Impl::keep(std::size_t pixel, std::uint32_t index, const PathRecord& record) {
    writePathRow(record, extendedSamples,
                 samples->data() + (pixel * capacity + index) * layout.size());
}

void Film::add(int x, int y, ConstPathRecords records, int recordCount) {
    Impl& impl = *impl_;
    const std::size_t pixel = impl.pixelIndex(x, y);
    HeldPixel held(impl.counts->data()[pixel]);
    if (held.count() == 0) {
        impl.start(pixel);
    }
    impl.addMeans(pixel, records, recordCount);
    for (int i = 0; i < recordCount; ++i) {
        impl.addOthers(pixel, held.count(), records[static_cast<std::size_t>(i)]);
        held.setCount(held.count() + 1);
    }
}

/// clear() only resets the counts, so that a restart does not touch the whole film.
void Film::Impl::start(std::size_t pixel) {
    std::memset(sumsOf(pixel), 0, static_cast<std::size_t>(sumStride) * sizeof(double));
    std::memset(wordsOf(pixel), 0, static_cast<std::size_t>(wordStride) * sizeof(std::uint32_t));
}

/// A few sums at a time stay in registers while all samples pass: a sum's order is that of the
/// samples, and memory is read and written once.
void Film::Impl::addMeans(std::size_t pixel, ConstPathRecords records, int recordCount) {
    double* const pixelSums = sumsOf(pixel);
    for (int i = 0; i < recordCount; ++i) {
        pixelSums[0] += static_cast<double>(records[static_cast<std::size_t>(i)].filterWeight);
    }
    double* out = pixelSums + 1;
    for (const Run& run : means.runs()) {
        int done = 0;
        constexpr int kQuads = 6; // as many as fit into the registers of AVX2
        for (; done + 4 * kQuads <= run.count; done += 4 * kQuads) {
            addQuads<kQuads>(out + done, records, recordCount, run.word + done);
        }
        for (; done + 4 <= run.count; done += 4) {
            addQuads<1>(out + done, records, recordCount, run.word + done);
        }
        for (; done < run.count; ++done) {
            addOne(out + done, records, recordCount, run.word + done);
        }
        out += run.count;
    }
}

/// All but the means, of a pixel that has `count` samples.
void Film::Impl::addOthers(std::size_t pixel, std::uint32_t count, const PathRecord& record) {
    if (hasVariance) {
        addToSpread(sumsOf(pixel) + spreadSlot, record.radiance,
                    static_cast<double>(record.filterWeight));
    }
    if (hasNearest) {
        addNearest(wordsOf(pixel), count == 0, record);
    }
    if (hasNonFinite) {
        wordsOf(pixel)[nonFiniteSlot] += record.nonFinite ? 1U : 0U;
    }
    if (count < capacity) {
        keep(pixel, count, record);
    }
}

void Film::addToDenoiser(const PixelSample* batch, ConstPathRecords records, int count) {
    if (impl_->denoiser) {
        impl_->denoiser->add(batch, records, count);
    }
}

const FilmDenoiser* Film::denoiser() const {
    return impl_->denoiser.get();
}

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

void Film::clear() {
    Impl& impl = *impl_;
    {
        const std::lock_guard lock(impl.reconstructionMutex);
        impl.reconstruction.reset();
    }
    if (impl.denoiser) {
        impl.denoiser->clear();
    }
    const std::size_t block = impl.capacity * impl.layout.size();
    for (std::size_t pixel = 0; pixel < impl.pixelCount(); ++pixel) {
        const PixelCount& count = impl.counts->data()[pixel];
        if (count.load() == 0) {
            continue;
        }
        HeldPixel held(count);
        held.setCount(0);
        if (block > 0) {
            std::memset(impl.samples->data() + pixel * block, 0, block * sizeof(float));
        }
    }
}

std::uint32_t Film::sampleCount(int x, int y) const {
    return impl_->counts->data()[impl_->pixelIndex(x, y)].load();
}

void Film::Impl::resolveMean(const PixelValues& pixel, int slot, int width, float* out) {
    const double scale = meanScale(pixel.sums[0], pixel.count);
    for (int c = 0; c < width; ++c) {
        out[c] = static_cast<float>(pixel.sums[slot + c] * scale);
    }
}

/// Variance of the ratio sum w x / sum w by linearisation, n / (n - 1) sum w^2 (x - m)^2 / (sum
/// w)^2: with equal weights the unbiased s^2 / n.
void Film::Impl::resolveVariance(const PixelValues& pixel, float* out) const {
    const double n = pixel.count;
    const double total = pixel.sums[0];
    if (n < 2.0 || total == 0.0) {
        std::fill(out, out + 3, 0.0F);
        return;
    }
    const Spread spread = readSpread(pixel.sums + spreadSlot);
    const int colorSlot = 1 + means.slot(aovs.front().recordOffset);
    for (int c = 0; c < 3; ++c) {
        const double shift = spread.mean[c] - pixel.sums[colorSlot + c] / total;
        const double squares = spread.squares[c] + spread.weight * shift * shift;
        out[c] = static_cast<float>(n / (n - 1.0) * squares / (total * total));
    }
}

template <class T>
void Film::Impl::resolvePixel(int aovIndex, const PixelValues& pixel, T* out) const {
    const AovDescriptor& aov = aovs[static_cast<std::size_t>(aovIndex)];
    const int slot = slots[static_cast<std::size_t>(aovIndex)];
    const int width = aov.width();
    const auto convert = [](auto value) {
        if constexpr (std::is_same_v<T, float> || std::is_integral_v<decltype(value)>) {
            return static_cast<T>(value);
        } else {
            return toInt(value);
        }
    };
    if (pixel.count == 0) {
        std::fill(out, out + width, convert(aov.clearValue));
        return;
    }
    float values[kMostChannels];
    switch (aov.reduction) {
    case AovReduction::kSum: {
        const bool ofSamples = aov.recordOffset == kNoRecordField;
        *out = static_cast<T>(ofSamples ? pixel.count : pixel.words[nonFiniteSlot]);
        return;
    }
    case AovReduction::kMean:
        resolveMean(pixel, slot, width, values);
        break;
    case AovReduction::kVariance:
        resolveVariance(pixel, values);
        break;
    case AovReduction::kNearest:
        if (aov.type == AovType::kInt) {
            for (int c = 0; c < width; ++c) {
                out[c] = convert(static_cast<std::int32_t>(pixel.words[slot + c]));
            }
            return;
        }
        std::memcpy(values, pixel.words + slot, static_cast<std::size_t>(width) * sizeof(float));
        break;
    }
    std::transform(values, values + width, out, convert);
}

template <class T>
void Film::Impl::resolveAll(int aovIndex, T* out) const {
    const int width = aovs[static_cast<std::size_t>(aovIndex)].width();
    T* to = out;
    for (std::size_t pixel = 0; pixel < pixelCount(); ++pixel, to += width) {
        const HeldPixel held(counts->data()[pixel]);
        resolvePixel(aovIndex, {held.count(), sumsOf(pixel), wordsOf(pixel)}, to);
    }
    replaceReconstructed(aovIndex, 0, pixelCount(), out);
}

/// Colours of consecutive pixels that were reconstructed take the place of what they resolved to.
template <class T>
void Film::Impl::replaceReconstructed(int aovIndex, std::size_t firstPixel, std::size_t pixels,
                                      T* out) const {
    if constexpr (std::is_same_v<T, float>) {
        if (!denoiser) {
            return;
        }
        const AovDescriptor& aov = aovs[static_cast<std::size_t>(aovIndex)];
        const std::vector<std::string>& names = denoiser->aovs();
        const auto found = std::find(names.begin(), names.end(), aov.name);
        std::shared_ptr<const std::vector<float>> image;
        {
            const std::lock_guard lock(reconstructionMutex);
            image = reconstruction;
        }
        if (!image || found == names.end()) {
            return;
        }
        const auto light = static_cast<std::size_t>(found - names.begin());
        const auto width = static_cast<std::size_t>(aov.width());
        for (std::size_t c = 0; c < 3; ++c) {
            const float* const from = image->data() + (light * 3 + c) * pixelCount() + firstPixel;
            for (std::size_t i = 0; i < pixels; ++i) {
                out[i * width + c] = from[i];
            }
        }
    }
}

FilmRow::FilmRow(const Film& film)
    : film_(*film.impl_),
      counts_(static_cast<std::size_t>(film_.window.data.width)),
      sums_(counts_.size() * static_cast<std::size_t>(film_.sumStride)),
      words_(counts_.size() * static_cast<std::size_t>(film_.wordStride)) {}

void FilmRow::read(int row) {
    row_ = row;
    const auto sumStride = static_cast<std::size_t>(film_.sumStride);
    const auto wordStride = static_cast<std::size_t>(film_.wordStride);
    const std::size_t first = static_cast<std::size_t>(row) * counts_.size();
    for (std::size_t i = 0; i < counts_.size(); ++i) {
        const HeldPixel held(film_.counts->data()[first + i]);
        counts_[i] = held.count();
        const double* const sums = film_.sumsOf(first + i);
        std::copy(sums, sums + sumStride, sums_.data() + i * sumStride);
        const std::uint32_t* const words = film_.wordsOf(first + i);
        std::copy(words, words + wordStride, words_.data() + i * wordStride);
    }
}

template <class T>
void FilmRow::resolveTo(int aovIndex, T* out) const {
    const int width = film_.aovs[static_cast<std::size_t>(aovIndex)].width();
    for (std::size_t i = 0; i < counts_.size(); ++i, out += width) {
        film_.resolvePixel(aovIndex,
                           {counts_[i],
                            sums_.data() + i * static_cast<std::size_t>(film_.sumStride),
                            words_.data() + i * static_cast<std::size_t>(film_.wordStride)},
                           out);
    }
}

/// Most AOVs are means of one to four channels: short loops of known length.
template <int Width>
void FilmRow::resolveMeans(const AovDescriptor& aov, int slot, float* out) const {
    const double* sums = sums_.data();
    for (const std::uint32_t count : counts_) {
        if (count == 0) {
            std::fill(out, out + Width, aov.clearValue);
        } else {
            const double scale = Film::Impl::meanScale(sums[0], count);
            for (int c = 0; c < Width; ++c) {
                out[c] = static_cast<float>(sums[slot + c] * scale);
            }
        }
        sums += film_.sumStride;
        out += Width;
    }
}

void FilmRow::resolve(int aovIndex, float* out) const {
    const AovDescriptor& aov = film_.aovs[static_cast<std::size_t>(aovIndex)];
    const int slot = film_.slots[static_cast<std::size_t>(aovIndex)];
    if (aov.reduction == AovReduction::kMean && aov.width() == 3) {
        resolveMeans<3>(aov, slot, out);
    } else if (aov.reduction == AovReduction::kMean && aov.width() == 1) {
        resolveMeans<1>(aov, slot, out);
    } else {
        resolveTo(aovIndex, out);
    }
    film_.replaceReconstructed(aovIndex, static_cast<std::size_t>(row_) * counts_.size(),
                               counts_.size(), out);
}

void FilmRow::resolveInt(int aovIndex, std::int32_t* out) const {
    resolveTo(aovIndex, out);
}

void Film::resolve(int aovIndex, float* out) const {
    impl_->resolveAll(aovIndex, out);
}

void Film::resolveInt(int aovIndex, std::int32_t* out) const {
    impl_->resolveAll(aovIndex, out);
}

int Film::findBound(const std::string& name) const {
    for (std::size_t i = 0; i < impl_->aovs.size(); ++i) {
        if (impl_->aovs[i].name == name) {
            return static_cast<int>(i);
        }
    }
    return -1;
}

const float* Film::pathSamples() const {
    return impl_->samples ? impl_->samples->data() : nullptr;
}

int Film::pathSampleCapacity() const {
    return static_cast<int>(impl_->capacity);
}

const std::vector<PathSampleField>& Film::pathSampleLayout() const {
    return impl_->layout;
}

std::size_t Film::bytes() const {
    return impl_->accumulators.bytes() + impl_->counts->bytes() +
           (impl_->samples ? impl_->samples->bytes() : 0) +
           (impl_->denoiser ? impl_->denoiser->bytes() : 0);
}

} // namespace mbfeat
