#include "film/deepReader.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <new>
#include <utility>
#include <vector>

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputFile.h>
#include <ImfMatrixAttribute.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>

#include "core/clock.h"
#include "film/filmDenoiser.h"
#include "integrate/pathRecord.h"

namespace mbfeat {

namespace {

/// Rows read at once.
constexpr int kSlabRows = 8;

std::string textOf(const Imf::Header& header, const char* name) {
    const auto* const text = header.findTypedAttribute<Imf::StringAttribute>(name);
    return text != nullptr ? text->value() : std::string();
}

/// A record of the fields that pathSampleFields() names, in their order: writePathRow() backwards.
PathRecord recordOf(const float* row, bool extended) {
    PathRecord record;
    const auto rgb = [&] {
        const Rgb value(row[0], row[1], row[2]);
        row += 3;
        return value;
    };
    record.radiance = rgb();
    record.alpha = *row++;
    record.distance = *row++;
    record.subpixel = {row[0], row[1]};
    row += 2;
    const auto valid = static_cast<std::uint32_t>(std::clamp(*row++, 0.0F, 63.0F));
    for (std::uint32_t rest = valid; (rest & 1U) != 0; rest >>= 1U) {
        ++record.vertexCount;
    }
    std::memcpy(&record.features, row, sizeof(record.features));
    row += static_cast<std::ptrdiff_t>(kFeatureVertices) * 9;
    for (VertexExtended& vertex : record.extended) {
        if (!extended) {
            break;
        }
        vertex.roughness = *row++;
        vertex.distance = *row++;
        vertex.throughput = rgb();
        vertex.event = static_cast<std::int32_t>(std::clamp(*row++, 0.0F, 63.0F));
    }
    return record;
}

class DeepFile {
public:
    DeepFile(const std::string& path, int threads) : file_(path.c_str(), threads) {}

    /// What is wrong with the file, or nothing.
    Status check(const std::string& path) {
        const Imf::Header& header = file_.header();
        const auto* const matrix = header.findTypedAttribute<Imf::M44fAttribute>("worldToCamera");
        if (matrix == nullptr) {
            return Error{path, "its header lacks worldToCamera, which turns normals; nothing was "
                               "denoised. Render it anew."};
        }
        extended_ = header.channels().findChannel("mbfeat:event:0.Y") != nullptr;
        std::string missing;
        for (const PathSampleField& field : pathSampleFields(extended_)) {
            const Imf::Channel* const channel = header.channels().findChannel(field.name);
            if (channel == nullptr) {
                missing += (missing.empty() ? "" : ", ") + field.name;
            } else {
                fields_.push_back(field);
            }
        }
        if (!missing.empty()) {
            return Error{path, "it holds no paths of MBFeat: it lacks " + missing.substr(0, 200) +
                                   ". Render a product of productType deepRaster."};
        }
        const Imath::Box2i& display = header.displayWindow();
        const Imath::Box2i& data = header.dataWindow();
        window_.width = display.max.x - display.min.x + 1;
        window_.height = display.max.y - display.min.y + 1;
        window_.data = {data.min.x, data.min.y, data.max.x - data.min.x + 1,
                        data.max.y - data.min.y + 1};
        window_.pixelAspectRatio = header.pixelAspectRatio();
        for (int axis = 0; axis < 3; ++axis) {
            // Imath's vectors are rows: column `axis` is the camera's axis in the world.
            for (int k = 0; k < 3; ++k) {
                rotation_[3 * axis + k] = matrix->value()[k][axis];
            }
        }
        return std::nullopt;
    }

    const ImageWindow& window() const { return window_; }
    const float* rotation() const { return rotation_; }
    const Imf::Header& header() const { return file_.header(); }
    /// No paths, but the names of their fields.
    PathSamples fields() const {
        PathSamples none;
        for (const PathSampleField& field : fields_) {
            none.fields.push_back(field.name);
        }
        return none;
    }

    /// The largest number of paths in a pixel.
    unsigned maxCount() {
        unsigned most = 0;
        forEachSlab([&](int /*first*/, int /*rows*/) {
            most = std::max(most, *std::max_element(counts_.begin(), counts_.end()));
        });
        return most;
    }

    void addTo(Film& film) {
        std::vector<PathRecord> records;
        std::vector<PixelSample> batch;
        forEachSlab([&](int first, int rows) {
            readSlab(first, rows);
            for (int row = 0; row < rows; ++row) {
                records.clear();
                batch.clear();
                addRow(film, first + row, row, records, batch);
                film.addToDenoiser(batch.data(), records.data(), static_cast<int>(batch.size()));
            }
        });
    }

private:
    template <class F>
    void forEachSlab(const F& body) {
        const PixelRect& data = window_.data;
        counts_.resize(static_cast<std::size_t>(data.width) * kSlabRows);
        for (int y = data.y; y < data.y + data.height; y += kSlabRows) {
            const int rows = std::min(kSlabRows, data.y + data.height - y);
            std::fill(counts_.begin(), counts_.end(), 0U);
            Imf::DeepFrameBuffer buffer;
            buffer.insertSampleCountSlice(countSlice(y));
            file_.setFrameBuffer(buffer);
            file_.readPixelSampleCounts(y, y + rows - 1);
            body(y, rows);
        }
    }

    template <class T>
    char* origin(std::vector<T>& slab, int firstY) const {
        const std::ptrdiff_t pixel =
            static_cast<std::ptrdiff_t>(firstY) * window_.data.width + window_.data.x;
        const auto address = reinterpret_cast<std::uintptr_t>(slab.data());
        return reinterpret_cast<char*>(address - static_cast<std::uintptr_t>(pixel) * sizeof(T));
    }

    Imf::Slice countSlice(int firstY) {
        return {Imf::UINT, origin(counts_, firstY), sizeof(unsigned),
                sizeof(unsigned) * static_cast<std::size_t>(window_.data.width)};
    }

    void readSlab(int first, int rows) {
        const std::size_t pixels = counts_.size();
        std::size_t total = 0;
        for (const unsigned count : counts_) {
            total += count;
        }
        values_.assign(total * fields_.size(), 0.0F);
        pointers_.assign(fields_.size(), std::vector<char*>(pixels, nullptr));
        starts_.resize(pixels);
        std::size_t start = 0;
        for (std::size_t i = 0; i < pixels; ++i) {
            starts_[i] = start;
            for (std::size_t f = 0; f < fields_.size(); ++f) {
                pointers_[f][i] =
                    reinterpret_cast<char*>(values_.data() + start * fields_.size() + f);
            }
            start += counts_[i];
        }
        Imf::DeepFrameBuffer buffer;
        buffer.insertSampleCountSlice(countSlice(first));
        for (std::size_t f = 0; f < fields_.size(); ++f) {
            // OpenEXR converts integers to floats.
            buffer.insert(
                fields_[f].name,
                Imf::DeepSlice(Imf::FLOAT, origin(pointers_[f], first), sizeof(char*),
                               sizeof(char*) * static_cast<std::size_t>(window_.data.width),
                               fields_.size() * sizeof(float)));
        }
        file_.setFrameBuffer(buffer);
        file_.readPixelSampleCounts(first, first + rows - 1);
        file_.readPixels(first, first + rows - 1);
    }

    void addRow(Film& film, int y, int row, std::vector<PathRecord>& records,
                std::vector<PixelSample>& batch) {
        for (int column = 0; column < window_.data.width; ++column) {
            const std::size_t pixel =
                static_cast<std::size_t>(row) * static_cast<std::size_t>(window_.data.width) +
                static_cast<std::size_t>(column);
            const std::size_t before = records.size();
            for (unsigned s = 0; s < counts_[pixel]; ++s) {
                records.push_back(
                    recordOf(values_.data() + (starts_[pixel] + s) * fields_.size(), extended_));
                batch.push_back({window_.data.x + column, y, s});
            }
            film.add(window_.data.x + column, y, records.data() + before,
                     static_cast<int>(records.size() - before));
        }
    }

    Imf::DeepScanLineInputFile file_;
    ImageWindow window_;
    float rotation_[9] = {};
    bool extended_ = false;
    std::vector<PathSampleField> fields_;
    std::vector<unsigned> counts_; ///< of the slab's pixels
    std::vector<std::size_t> starts_;
    std::vector<float> values_; ///< [sample][field]
    std::vector<std::vector<char*>> pointers_;
};

} // namespace

Result<DenoisedFile> denoiseDeepFile(const std::string& path, const DenoiseSettings& settings,
                                     int threads, const std::vector<std::string>& aovs) {
    const Clock::time_point begin = Clock::now();
    try {
        DeepFile file(path, std::max(threads, 0));
        if (const Status problem = file.check(path)) {
            return *problem;
        }
        Result<std::shared_ptr<const FilmDenoise>> denoise =
            prepareDenoise(settings, threads, file.rotation());
        if (!denoise) {
            return denoise.error();
        }
        // A film would take what the file lacks for zeros.
        const PathSamples recorded = file.fields();
        const Result<ChannelPlan> plan = ChannelPlan::make(
            denoise.value()->model->contract().channels, recorded, ShownFeatures::kAll, {});
        if (!plan) {
            return Error{path, plan.error().text};
        }
        FilmRequest request;
        request.window = file.window();
        request.aovs = aovs;
        request.denoise = denoise.value();
        request.samplesPerPixel = static_cast<int>(file.maxCount());
        constexpr std::size_t kAnyMemory = static_cast<std::size_t>(-1);
        Result<std::shared_ptr<Film>> film = Film::create(request, kAnyMemory);
        if (!film) {
            return film.error();
        }
        file.addTo(*film.value());
        const double reading = secondsSince(begin);
        if (const Status problem = film.value()->reconstruct(nullptr)) {
            return *problem;
        }
        const DenoiseTimes times = film.value()->denoiser()->times();
        DenoisedFile result{film.value(), {}};
        result.report.version = MBFEAT_VERSION;
        result.report.stage = textOf(file.header(), "mbfeat:stage");
        result.report.samplesPerPixel = request.samplesPerPixel;
        result.report.seconds = {
            {"read", reading}, {"inference", times.inference}, {"splat", times.splat}};
        return result;
    } catch (const std::bad_alloc&) {
        return Error{path, "there is not enough memory for its paths. Denoise it with a layered "
                           "model, which keeps sums of them."};
    } catch (const std::exception& problem) {
        return Error{path, std::string("it cannot be read as a deep EXR file: ") + problem.what() +
                               ". Give the deepRaster product of a render."};
    }
}

} // namespace mbfeat
