#include "denoise/denoiser.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "core/clock.h"
#include "core/parallel.h"
#include "denoise/atrous.h"
#include "denoise/splat.h"

namespace mbfeat {

namespace {

/// Paths that one thread gives to the network at once: their channels stay in its cache.
constexpr std::size_t kChunk = 2048;
/// Paths of a pixel that are looked at together.
constexpr std::size_t kMostSamples = 16;

/// A tile with what surrounds it: `core` is computed from `region`, both inside the image.
struct Tile {
    SplatTile core, region;
};

std::int64_t width(const SplatTile& t) {
    return t.x1 - t.x0;
}
std::int64_t height(const SplatTile& t) {
    return t.y1 - t.y0;
}
std::size_t area(const SplatTile& t) {
    return static_cast<std::size_t>(width(t)) * static_cast<std::size_t>(height(t));
}

/// The most paths that a pixel has.
std::size_t mostSamples(const PathSamples& paths) {
    return paths.counts.empty() ? static_cast<std::size_t>(paths.capacity)
                                : *std::max_element(paths.counts.begin(), paths.counts.end());
}

/// The network's outputs of a tile, cut to it where the network was given more.
class TileOutputs {
public:
    /// `grid` columns and rows were given, of which the first `columns` and `rows` are the tile.
    /// `weights` are the numbers of outputs that are no images.
    TileOutputs(OnnxSession::Outputs outputs, const std::vector<std::size_t>& weights,
                std::int64_t gridColumns, std::int64_t gridRows, std::int64_t columns,
                std::int64_t rows)
        : outputs_(std::move(outputs)) {
        for (std::size_t i = 0; i < outputs_.size(); ++i) {
            views_.push_back(outputs_[i]);
            TensorView& view = views_.back();
            const std::size_t axes = view.shape.size();
            const bool isImage = std::find(weights.begin(), weights.end(), i) == weights.end() &&
                                 axes >= 2 && view.shape[axes - 1] == gridColumns &&
                                 view.shape[axes - 2] == gridRows;
            if (!isImage || (gridColumns == columns && gridRows == rows)) {
                continue;
            }
            const std::size_t planes =
                view.size() / static_cast<std::size_t>(gridColumns * gridRows);
            std::vector<float>& cut = memory_.emplace_back(
                planes * static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
            float* to = cut.data();
            for (std::size_t plane = 0; plane < planes; ++plane) {
                for (std::int64_t y = 0; y < rows; ++y, to += columns) {
                    const std::int64_t row = static_cast<std::int64_t>(plane) * gridRows + y;
                    std::copy_n(view.data + row * gridColumns, columns, to);
                }
            }
            view.data = cut.data();
            view.shape[axes - 1] = columns;
            view.shape[axes - 2] = rows;
        }
    }

    const TensorView& operator[](std::size_t index) const { return views_[index]; }

private:
    OnnxSession::Outputs outputs_;
    std::vector<TensorView> views_;
    std::vector<std::vector<float>> memory_; ///< of views that were cut
};

/// What both kinds of models share: tiles, the splat, the image.
class Reconstruction {
public:
    Reconstruction(const DenoiseModel& model, const DenoiseOptions& options, int imageWidth,
                   int imageHeight, std::size_t lightChannels, ThreadPool& pool)
        : model_(model),
          contract_(model.contract()),
          options_(options),
          width_(imageWidth),
          height_(imageHeight),
          lightChannels_(lightChannels),
          pool_(pool) {
        result_.image.resize(lightChannels * pixelCount());
    }

protected:
    ~Reconstruction() = default;
    Reconstruction(const Reconstruction&) = delete;
    Reconstruction& operator=(const Reconstruction&) = delete;

    std::size_t pixelCount() const {
        return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    }
    bool isOver() const {
        return failure_.has_value() ||
               (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed));
    }

    template <class TileFunction>
    void forEachTile(std::size_t samples, const TileFunction& reconstruct) {
        const std::vector<Tile> tiles = makeTiles(samples);
        result_.tiles = static_cast<int>(tiles.size());
        for (std::size_t i = 0; i < tiles.size() && !isOver(); ++i) {
            reconstruct(tiles[i]);
        }
    }

    Result<DenoiseResult> finished() {
        if (failure_) {
            return *failure_;
        }
        result_.stopped = isOver();
        return std::move(result_);
    }

    // Among the outputs, see DenoiseModel::checkGraphs().
    static constexpr std::size_t kWeight = 1, kBias = 2;
    /// Of what the passes after the splat have for each pixel; their table follows.
    std::size_t centre() const { return contract_.guides > 0 ? 5 : 4; }
    std::size_t scalePlanes() const {
        return static_cast<std::size_t>(guides::groups(contract_.guides));
    }

    /// Columns, or rows, that the network is given for so many.
    std::int64_t gridSize(std::int64_t size) const {
        const std::int64_t unit = contract_.wholeUnits ? contract_.unit : 1;
        return (size + unit - 1) / unit * unit;
    }

    /// Runs the network on a tile's inputs, which are as large as gridSize() says; nothing, and a
    /// failure, where it fails.
    std::optional<TileOutputs> infer(const Tile& tile, const std::vector<TensorView>& inputs) {
        const Clock::time_point begin = Clock::now();
        Result<OnnxSession::Outputs> outputs = model_.graph().run(inputs);
        if (!outputs) {
            failure_ = outputs.error();
            return std::nullopt;
        }
        const std::int64_t columns = width(tile.region), rows = height(tile.region);
        TileOutputs found(std::move(outputs.value()), {kWeight, kBias, centre() + 1},
                          gridSize(columns), gridSize(rows), columns, rows);
        result_.inferenceSeconds += secondsSince(begin);
        return found;
    }

    std::vector<Tile> makeTiles(std::size_t samples) {
        const auto unit = static_cast<std::int64_t>(contract_.unit);
        const std::int64_t margin =
            (contract_.receptiveField + contract_.spread() + unit - 1) / unit * unit;
        const std::pair<std::int64_t, std::int64_t> sides = tileSides(margin, samples);
        const std::int64_t sideX = sides.first, sideY = sides.second;
        result_.tileSize = static_cast<int>(std::max(sideX, sideY));
        std::vector<Tile> tiles;
        for (std::int64_t y = 0; y < height_; y += sideY) {
            for (std::int64_t x = 0; x < width_; x += sideX) {
                const auto cut = [&, x0 = x, y0 = y](std::int64_t border) {
                    const auto w = static_cast<std::int64_t>(width_);
                    const auto h = static_cast<std::int64_t>(height_);
                    return SplatTile{static_cast<int>(std::max<std::int64_t>(x0 - border, 0)),
                                     static_cast<int>(std::max<std::int64_t>(y0 - border, 0)),
                                     static_cast<int>(std::min(x0 + sideX + border, w)),
                                     static_cast<int>(std::min(y0 + sideY + border, h))};
                };
                tiles.push_back({cut(0), cut(margin)});
            }
        }
        return tiles;
    }

    /// Width and height of tiles whose runs fit into the memory, such that all margins together are
    /// least; multiples of the unit.
    std::pair<std::int64_t, std::int64_t> tileSides(std::int64_t margin,
                                                    std::size_t samples) const {
        const auto side = [this](std::int64_t size, std::int64_t parts) {
            const std::int64_t unit = contract_.unit;
            return ((size + parts - 1) / parts + unit - 1) / unit * unit;
        };
        if (options_.tile > 0) {
            return {side(options_.tile, 1), side(options_.tile, 1)};
        }
        const double bytes = 4.0 * static_cast<double>(samples) * contract_.workingFloats;
        const double pixels = options_.memory * 1073741824.0 / bytes;
        // Smaller ones would cost more than they save, whatever the memory.
        constexpr std::int64_t kLeast = 64;
        const auto most = [](std::int64_t size) {
            return std::max<std::int64_t>(size / kLeast, 1);
        };
        std::pair<std::int64_t, std::int64_t> best{side(width_, most(width_)),
                                                   side(height_, most(height_))};
        double least = std::numeric_limits<double>::infinity();
        for (std::int64_t columns = 1; columns <= most(width_); ++columns) {
            for (std::int64_t rows = 1; rows <= most(height_); ++rows) {
                const std::int64_t x = side(width_, columns), y = side(height_, rows);
                const auto regionX = std::min<std::int64_t>(x + 2 * margin, width_);
                const auto regionY = std::min<std::int64_t>(y + 2 * margin, height_);
                const double region = static_cast<double>(regionX) * static_cast<double>(regionY);
                const double all = region * static_cast<double>(columns * rows);
                if (region <= pixels && all < least) {
                    least = all;
                    best = {x, y};
                }
            }
        }
        return best;
    }

    /// Splats a tile's units, and puts its core into the image. `divisors` are of classes, which
    /// have a softmax each; null: units are samples, which share one.
    void spread(const Tile& tile, const TileOutputs& network, const std::vector<float>& light,
                const float* presence, const std::vector<float>* divisors) {
        const Clock::time_point begin = Clock::now();
        const std::optional<SplatInput> found = splatInput(tile, network, light, divisors);
        if (!found) {
            failure_ = Error{model_.file(),
                             "what the network gives has other sizes than its metadata says. "
                             "Export it anew."};
            return;
        }
        SplatInput input = *found;
        input.presence = presence;
        std::vector<float> image(lightChannels_ * area(tile.region));
        const SplatTile core{tile.core.x0 - tile.region.x0, tile.core.y0 - tile.region.y0,
                             tile.core.x1 - tile.region.x0, tile.core.y1 - tile.region.y0};
        if (contract_.atrous.empty()) {
            splat(input, core, image.data(), pool_, options_.stop, widestSplatLanes());
        } else {
            input.separate = true;
            const std::vector<float> units =
                filteredUnits(input, core, network[centre()].data, network[centre() + 1].data);
            joinUnits(input, core, units.data(), image.data());
        }
        place(image, tile, core);
        result_.splatSeconds += secondsSince(begin);
    }

    /// Of a tile's region; nothing where sizes are not what the contract says.
    std::optional<SplatInput> splatInput(const Tile& tile, const TileOutputs& network,
                                         const std::vector<float>& light,
                                         const std::vector<float>* divisors) const {
        const std::size_t pixels = area(tile.region);
        const TensorView& hidden = network[0];
        SplatInput input;
        input.width = static_cast<int>(width(tile.region));
        input.height = static_cast<int>(height(tile.region));
        input.units = static_cast<int>(hidden.shape.empty() ? 0 : hidden.shape[0]);
        input.channels = static_cast<int>(hidden.shape.size() == 4 ? hidden.shape[1] : 0);
        const bool divided = contract_.demodulated != 0;
        const std::size_t lights = lightChannels_ * (divided ? 2 : 1);
        input.lights = static_cast<int>(lights);
        input.kernel = contract_.kernel;
        input.alikeChannels = contract_.affinity;
        const auto kernel = static_cast<std::size_t>(input.kernel);
        const auto units = static_cast<std::size_t>(input.units);
        const auto channels = static_cast<std::size_t>(input.channels);
        const std::size_t passes = contract_.atrous.size();
        // In the order of DenoiseModel::checkGraphs().
        std::vector<std::size_t> sizes = {units * channels * pixels, kernel * kernel * channels,
                                          kernel * kernel};
        if (contract_.affinity > 0) {
            sizes.push_back(units * static_cast<std::size_t>(contract_.affinity) * pixels);
        }
        if (contract_.guides > 0) {
            sizes.push_back(units * scalePlanes() * pixels);
        }
        if (passes > 0) {
            sizes.push_back(units * passes * pixels);
            sizes.push_back(passes * (atrous::kTaps + 1));
        }
        if (divided) {
            sizes.push_back(units * pixels);
        }
        bool fits = units * lights * pixels == light.size();
        for (std::size_t i = 0; i < sizes.size(); ++i) {
            fits = fits && network[i].size() == sizes[i];
        }
        if (!fits) {
            return std::nullopt;
        }
        input.hidden = hidden.data;
        input.light = light.data();
        input.weight = network[kWeight].data;
        input.bias = network[kBias].data;
        input.alike = contract_.affinity > 0 ? network[3].data : nullptr;
        input.guides = contract_.guides;
        input.scales = contract_.guides > 0 ? network[4].data : nullptr;
        input.apart = divisors != nullptr;
        if (divided && divisors != nullptr) {
            input.gate = network[sizes.size() - 1].data;
            input.divisor = divisors->data();
        }
        return input;
    }

    /// The units' images [units][lights][height][width], splatted and filtered, right in the core.
    std::vector<float> filteredUnits(const SplatInput& input, const SplatTile& core,
                                     const float* centre, const float* table) {
        const std::size_t plane =
            static_cast<std::size_t>(input.width) * static_cast<std::size_t>(input.height);
        const std::size_t image = static_cast<std::size_t>(input.lights) * plane;
        std::vector<float> light(static_cast<std::size_t>(input.units) * image);
        std::vector<float> filtered(light.size());
        const std::size_t passes = contract_.atrous.size();
        int border = contract_.spread() - contract_.kernel / 2; // of what later passes read
        const auto around = [&] {
            return SplatTile{std::max(core.x0 - border, 0), std::max(core.y0 - border, 0),
                             std::min(core.x1 + border, input.width),
                             std::min(core.y1 + border, input.height)};
        };
        splat(input, around(), light.data(), pool_, options_.stop, widestSplatLanes());
        for (std::size_t level = 0; level < passes; ++level) {
            ATrousPass pass;
            pass.width = input.width;
            pass.height = input.height;
            pass.lights = input.lights;
            pass.alikeChannels = input.alikeChannels;
            pass.guides = input.guides;
            pass.dilation = contract_.atrous[level];
            pass.spatial = table + level * (atrous::kTaps + 1);
            pass.sharpness = pass.spatial[atrous::kTaps];
            border -= atrous::kRadius * pass.dilation;
            for (std::size_t unit = 0; unit < static_cast<std::size_t>(input.units); ++unit) {
                pass.light = light.data() + unit * image;
                pass.alike =
                    input.alike + unit * static_cast<std::size_t>(input.alikeChannels) * plane;
                if (input.guides > 0) {
                    pass.scales = input.scales + unit * scalePlanes() * plane;
                }
                pass.centre = centre + (unit * passes + level) * plane;
                pass.out = filtered.data() + unit * image;
                filter(pass, around(), pool_, options_.stop, widestSplatLanes());
            }
            std::swap(light, filtered);
        }
        return light;
    }

    /// Puts the core of a region's image into that of the whole.
    void place(const std::vector<float>& image, const Tile& tile, const SplatTile& core) {
        const auto columns = static_cast<std::size_t>(width(tile.region));
        for (std::size_t p = 0; p < lightChannels_; ++p) {
            for (int y = core.y0; y < core.y1; ++y) {
                const float* const from = image.data() + p * area(tile.region) +
                                          static_cast<std::size_t>(y) * columns +
                                          static_cast<std::size_t>(core.x0);
                std::copy_n(from, width(core),
                            result_.image.data() + p * pixelCount() +
                                static_cast<std::size_t>(y + tile.region.y0) *
                                    static_cast<std::size_t>(width_) +
                                static_cast<std::size_t>(tile.core.x0));
            }
        }
    }

    const DenoiseModel& model_;
    const DenoiseContract& contract_;
    const DenoiseOptions& options_;
    int width_, height_;
    std::size_t lightChannels_;
    ThreadPool& pool_;
    DenoiseResult result_;
    std::optional<Error> failure_;
};

/// From sums by class: a kernel for each class of a pixel.
class ClassReconstruction : private Reconstruction {
public:
    ClassReconstruction(const PathSums& sums, const DenoiseOptions& options, ThreadPool& pool)
        : Reconstruction(sums.model(), options, sums.width(), sums.height(), sums.lightChannels(),
                         pool),
          sums_(sums) {}

    Result<DenoiseResult> run() {
        forEachTile(1, [this](const Tile& tile) { reconstruct(tile); });
        result_.repaired = sums_.repaired();
        result_.empty = sums_.emptyPixels();
        return finished();
    }

private:
    void reconstruct(const Tile& tile) {
        const std::int64_t columns = gridSize(width(tile.region));
        const std::int64_t rows = gridSize(height(tile.region));
        PathSums::Means means =
            sums_.means(tile.region, static_cast<int>(columns), static_cast<int>(rows), pool_);
        const auto planes = static_cast<std::int64_t>(sums_.planes());
        const std::optional<TileOutputs> network =
            infer(tile, {{means.classes.get(), {contract_.classes, planes, rows, columns}}});
        if (network) {
            spread(tile, *network, means.light, nullptr, &means.divisor);
        }
    }

    const PathSums& sums_;
};

/// From samples, each of which has a kernel of its own.
class SampleReconstruction : private Reconstruction {
public:
    SampleReconstruction(const DenoiseModel& model, const PathSamples& paths,
                         const DenoiseOptions& options, ChannelPlan plan, ThreadPool& pool)
        : Reconstruction(model, options, paths.width, paths.height, 3 * plan.lights().size(), pool),
          paths_(paths),
          plan_(std::move(plan)) {}

    Result<DenoiseResult> run() {
        const std::size_t samples = std::max<std::size_t>(mostSamples(paths_), 1);
        forEachTile(samples, [&](const Tile& tile) { reconstruct(tile, samples); });
        result_.repaired = repaired_;
        return finished();
    }

private:
    void reconstruct(const Tile& tile, std::size_t samples) {
        const Clock::time_point begin = Clock::now();
        const std::size_t pixels = area(tile.region);
        const std::int64_t gridColumns = gridSize(width(tile.region));
        const std::int64_t gridRows = gridSize(height(tile.region));
        const auto grid = static_cast<std::size_t>(gridColumns * gridRows);
        std::vector<float> channels(samples * plan_.size() * grid), shares(samples * grid);
        std::vector<float> light(samples * lightChannels_ * pixels), presence(samples * pixels);
        const auto columns = static_cast<std::size_t>(width(tile.region));
        const auto pixelAt = [&](std::size_t i) {
            return (static_cast<std::size_t>(tile.region.y0) + i / columns) *
                       static_cast<std::size_t>(paths_.width) +
                   static_cast<std::size_t>(tile.region.x0) + i % columns;
        };
        const auto placeOf = [&](std::size_t i) {
            return i / columns * static_cast<std::size_t>(gridColumns) + i % columns;
        };
        pool_.run(0, static_cast<std::int64_t>(samples), 1, options_.stop,
                  [&](std::int64_t sample, int /*thread*/) {
                      const auto s = static_cast<std::size_t>(sample);
                      for (std::size_t i = 0; i < pixels; ++i) {
                          const std::size_t pixel = pixelAt(i);
                          const bool isThere =
                              gather(pixel, s, grid,
                                     channels.data() + s * plan_.size() * grid + placeOf(i));
                          presence[s * pixels + i] = isThere ? 1.0F : 0.0F;
                          if (isThere) {
                              gatherLight(pixel, s, pixels,
                                          light.data() + s * lightChannels_ * pixels + i);
                          }
                      }
                  });
        if (isOver()) {
            return;
        }
        shareAlike(samples, pixels, presence);
        for (std::size_t s = 0; s < samples; ++s) {
            for (std::size_t i = 0; i < pixels; ++i) {
                shares[s * grid + placeOf(i)] = presence[s * pixels + i];
            }
        }
        result_.gatherSeconds += secondsSince(begin);
        const auto n = static_cast<std::int64_t>(samples);
        const auto planes = static_cast<std::int64_t>(plan_.size());
        const std::optional<TileOutputs> network =
            infer(tile, {{channels.data(), {n, planes, gridRows, gridColumns}},
                         {shares.data(), {n, 1, gridRows, gridColumns}}});
        if (network) {
            spread(tile, *network, light, presence.data(), nullptr);
        }
    }

    /// Writes the colours of a pixel's sample, of which every `stride`th float is one.
    void gatherLight(std::size_t pixel, std::size_t sample, std::size_t stride, float* to) const {
        const float* const path = paths_.path(pixel, sample);
        for (const std::size_t field : plan_.lights()) {
            for (std::size_t k = 0; k < 3; ++k, to += stride) {
                *to = path[field + k];
            }
        }
    }

    /// Usable samples share the pixel.
    static void shareAlike(std::size_t samples, std::size_t pixels, std::vector<float>& shares) {
        for (std::size_t i = 0; i < pixels; ++i) {
            std::size_t used = 0;
            for (std::size_t s = 0; s < samples; ++s) {
                used += shares[s * pixels + i] > 0.0F ? 1 : 0;
            }
            for (std::size_t s = 0; s < samples && used > 0; ++s) {
                float& share = shares[s * pixels + i];
                share = share > 0.0F ? 1.0F / static_cast<float>(used) : 0.0F;
            }
        }
    }

    /// Writes a pixel's sample as the network's channels, of which every `stride`th float is one:
    /// false where there is none, and they stay zero.
    bool gather(std::size_t pixel, std::size_t sample, std::size_t stride, float* to) {
        if (sample >= paths_.countOf(pixel)) {
            return false;
        }
        if (plan_.write(paths_.path(pixel, sample), to, stride)) {
            return true;
        }
        repaired_.fetch_add(1, std::memory_order_relaxed);
        return false;
    }

    const PathSamples& paths_;
    ChannelPlan plan_;
    std::atomic<std::uint64_t> repaired_{0};
};

/// Adds all kept paths up; false when it was stopped.
Result<bool> sumUp(const PathSamples& paths, PathSums& sums, const DenoiseOptions& options,
                   ThreadPool& pool) {
    const std::size_t pixels = paths.pixelCount();
    // Pixels with equally many paths in a row go together.
    const std::size_t most = std::max<std::size_t>(mostSamples(paths), 1);
    const std::size_t chunk = std::max<std::size_t>(kChunk / std::min(most, kMostSamples), 1);
    const auto chunks = static_cast<std::int64_t>((pixels + chunk - 1) / chunk);
    std::mutex mutex;
    Status failure;
    std::atomic<bool> failed{false};
    const auto addPixels = [&](std::size_t first, std::size_t last) {
        std::vector<std::size_t> places;
        std::vector<const float*> rows;
        for (std::size_t begin = first, end = first; begin < last && !failed; begin = end) {
            const std::size_t count = paths.countOf(begin);
            while (end < last && paths.countOf(end) == count) {
                ++end;
            }
            for (std::size_t s = 0; s < count; s += kMostSamples) {
                const std::size_t n = std::min(kMostSamples, count - s);
                places.clear();
                rows.clear();
                for (std::size_t pixel = begin; pixel < end; ++pixel) {
                    places.push_back(pixel);
                    for (std::size_t i = 0; i < n; ++i) {
                        rows.push_back(paths.path(pixel, s + i));
                    }
                }
                if (Status problem = sums.add(places.data(), places.size(), n, rows.data())) {
                    const std::lock_guard lock(mutex);
                    failure = std::move(problem);
                    failed = true;
                    return;
                }
            }
        }
    };
    const bool whole =
        pool.run(0, chunks, 1, options.stop, [&](std::int64_t index, int /*thread*/) {
            const std::size_t first = static_cast<std::size_t>(index) * chunk;
            addPixels(first, std::min(first + chunk, pixels));
        });
    if (failure) {
        return *failure;
    }
    return whole;
}

Result<ChannelPlan> planOf(const DenoiseModel& model, const PathSamples& paths,
                           const DenoiseOptions& options) {
    return ChannelPlan::make(model.contract().channels, paths, options.shown, options.lights);
}

int threadsOf(const DenoiseOptions& options) {
    return options.threads > 0 ? options.threads : hardwareThreads();
}

} // namespace

Result<std::unique_ptr<PathSums>> makePathSums(const std::shared_ptr<const DenoiseModel>& model,
                                               const PathSamples& paths,
                                               const DenoiseOptions& options) {
    if (model->contract().kind != DenoiseContract::Kind::kLayered) {
        return Error{model->file(), "this network needs every sample, not sums of them."};
    }
    Result<ChannelPlan> plan = planOf(*model, paths, options);
    if (!plan) {
        return plan.error();
    }
    return std::make_unique<PathSums>(model, std::move(plan.value()), paths.width, paths.height);
}

Result<DenoiseResult> denoise(const PathSums& sums, const DenoiseOptions& options) {
    ThreadPool pool(threadsOf(options));
    return ClassReconstruction(sums, options, pool).run();
}

Result<DenoiseResult> denoise(const std::shared_ptr<const DenoiseModel>& model,
                              const PathSamples& paths, const DenoiseOptions& options) {
    ThreadPool pool(threadsOf(options));
    if (model->contract().kind == DenoiseContract::Kind::kLayered) {
        const Result<std::unique_ptr<PathSums>> sums = makePathSums(model, paths, options);
        if (!sums) {
            return sums.error();
        }
        const Clock::time_point begin = Clock::now();
        const Result<bool> whole = sumUp(paths, *sums.value(), options, pool);
        if (!whole) {
            return whole.error();
        }
        const double seconds = secondsSince(begin);
        Result<DenoiseResult> result = ClassReconstruction(*sums.value(), options, pool).run();
        if (result) {
            result.value().gatherSeconds += seconds;
        }
        return result;
    }
    Result<ChannelPlan> plan = planOf(*model, paths, options);
    if (!plan) {
        return plan.error();
    }
    return SampleReconstruction(*model, paths, options, std::move(plan.value()), pool).run();
}

} // namespace mbfeat
