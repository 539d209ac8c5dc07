#include "film/film.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <mutex>
#include <new>
#include <optional>
#include <string_view>
#include <utility>

#include <xsimd/xsimd.hpp>

#include "film/filmImpl.h"
#include "film/pathRow.h"

namespace mbfeat {

namespace {

constexpr std::string_view kPrimvarPrefix = "primvars:";
// The AOV color reads its alpha behind its radiance.
static_assert(offsetof(PathRecord, alpha) == offsetof(PathRecord, radiance) + sizeof(Rgb));

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

} // namespace

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
