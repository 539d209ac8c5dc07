// The denoiser: logits that overflow exponentials, images of one pixel, one bright path, black and
// equal paths, more and fewer samples than networks were trained with, paths that are not numbers.
#include "families.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "core/parallel.h"
#include "denoise/denoiser.h"
#include "denoise/pathEncoderLanes.h"
#include "denoise/splat.h"
#include "film/film.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;

// Splatting.

/// A splat's arrays, and what it should give in double precision.
struct Splat {
    SplatInput in;
    std::vector<float> hidden, light, weight, bias, alike;

    Splat(int width, int height, int units, int kernel, int channels = 7) {
        in.width = width;
        in.height = height;
        in.units = units;
        in.kernel = kernel;
        in.channels = channels;
        in.lights = 3;
        const auto size = [&](int planes) {
            return static_cast<std::size_t>(units) * static_cast<std::size_t>(planes) *
                   static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        };
        const auto taps = static_cast<std::size_t>(kernel) * static_cast<std::size_t>(kernel);
        hidden.resize(size(channels));
        light.resize(size(3));
        weight.resize(taps * static_cast<std::size_t>(channels));
        bias.resize(taps);
        TestRandom random(static_cast<unsigned>(width * 31 + height));
        for (std::vector<float>* values : {&hidden, &light, &weight, &bias}) {
            std::generate(values->begin(), values->end(), [&] { return random.nextFloat(); });
        }
    }

    std::vector<float> run(SplatLanes lanes) {
        in.hidden = hidden.data();
        in.light = light.data();
        in.weight = weight.data();
        in.bias = bias.data();
        in.alike = alike.data();
        std::vector<float> out(3 * pixels());
        ThreadPool pool(1);
        splat(in, {0, 0, in.width, in.height}, out.data(), pool, nullptr, lanes);
        return out;
    }

    std::size_t pixels() const {
        return static_cast<std::size_t>(in.width) * static_cast<std::size_t>(in.height);
    }
    std::size_t at(int unit, int plane, int planes, int x, int y) const {
        return ((static_cast<std::size_t>(unit) * static_cast<std::size_t>(planes) +
                 static_cast<std::size_t>(plane)) *
                    static_cast<std::size_t>(in.height) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(in.width) +
               static_cast<std::size_t>(x);
    }

    double logit(int unit, int tap, int x, int y) const {
        double sum = bias[static_cast<std::size_t>(tap)];
        for (int c = 0; c < in.channels; ++c) {
            sum +=
                static_cast<double>(
                    weight[static_cast<std::size_t>(tap) * static_cast<std::size_t>(in.channels) +
                           static_cast<std::size_t>(c)]) *
                static_cast<double>(hidden[at(unit, c, in.channels, x, y)]);
        }
        return sum;
    }

    /// Gives units features of multiples of `step`: their squared distances are exact.
    void setAlike(int channels, float step) {
        in.alikeChannels = channels;
        alike.resize(static_cast<std::size_t>(in.units) * static_cast<std::size_t>(channels) *
                     pixels());
        int i = 0;
        for (float& value : alike) {
            value = step * static_cast<float>(++i * 7 % 11 - 5);
        }
    }

    double distance(int unit, int x, int y, int sourceX, int sourceY) const {
        double sum = 0.0;
        for (int c = 0; c < in.alikeChannels; ++c) {
            const auto value = [&](int px, int py) {
                return static_cast<double>(alike[at(unit, c, in.alikeChannels, px, py)]);
            };
            const double change = value(x, y) - value(sourceX, sourceY);
            sum += change * change;
        }
        return sum;
    }

    /// The definition, with the largest logit known beforehand.
    double truth(int channel, int x, int y) const {
        const int r = in.kernel / 2;
        std::vector<std::pair<double, double>> arriving; // logit, light
        for (int unit = 0; unit < in.units; ++unit) {
            for (int j = 0; j < in.kernel; ++j) {
                for (int i = 0; i < in.kernel; ++i) {
                    const int sx = x - r + i, sy = y - r + j;
                    if (sx >= 0 && sy >= 0 && sx < in.width && sy < in.height) {
                        arriving.emplace_back(
                            logit(unit, j * in.kernel + i, sx, sy) - distance(unit, x, y, sx, sy),
                            static_cast<double>(light[at(unit, channel, 3, sx, sy)]));
                    }
                }
            }
        }
        const double largest = std::max_element(arriving.begin(), arriving.end())->first;
        double sum = 0.0, total = 0.0;
        for (const auto& [logit, value] : arriving) {
            const double w = std::exp(logit - largest);
            sum += w * value;
            total += w;
        }
        return sum / total;
    }
};

void compareSplat(Report& report, Splat& splat) {
    for (const SplatLanes lanes : {SplatLanes::kScalar, SplatLanes::kNarrow, SplatLanes::kWide}) {
        const std::vector<float> found = splat.run(lanes);
        for (int c = 0; c < 3; ++c) {
            for (int y = 0; y < splat.in.height; ++y) {
                for (int x = 0; x < splat.in.width; ++x) {
                    const double truth = splat.truth(c, x, y);
                    const auto value = static_cast<double>(found[splat.at(0, c, 3, x, y)]);
                    report.error(relativeError(value, truth), [&] {
                        return Text()
                            .add("x", x)
                            .add("y", y)
                            .add("splat", value)
                            .add("exact", truth);
                    });
                }
            }
        }
    }
}

constexpr const char* kSplatCheck = "splat on all lanes against its definition in double, relative";

void addSplats(Catalogue& catalogue) {
    struct Size {
        const char* name;
        int width, height, units, kernel;
    };
    for (const Size& size : {Size{"1x1", 1, 1, 1, 13}, Size{"1x1-samples", 1, 1, 9, 5},
                             Size{"primes", 31, 7, 3, 11}, Size{"column", 1, 37, 2, 17},
                             Size{"row", 131, 1, 2, 3}, Size{"no-kernel", 19, 5, 4, 1}}) {
        catalogue.push_back(
            {std::string("denoiser/splat-") + size.name, kSplatCheck, 5e-6,
             "logits up to 8 of 8 terms, rounded to 1e-6, and as many in their sums",
             [=](Report& report) {
                 Splat splat(size.width, size.height, size.units, size.kernel);
                 compareSplat(report, splat);
             }});
    }
    const auto scaled = [&](const char* name, float scale, double budget, const char* reason) {
        catalogue.push_back({std::string("denoiser/splat-") + name, kSplatCheck, budget, reason,
                             [=](Report& report) {
                                 Splat splat(17, 9, 3, 5, 1);
                                 // One channel, powers of two: the logits themselves are exact.
                                 int i = 0;
                                 for (float& value : splat.hidden) {
                                     value = static_cast<float>(++i % 7 - 3) * 0.25F;
                                 }
                                 for (float& value : splat.weight) {
                                     value = scale * static_cast<float>(++i % 3 - 1);
                                 }
                                 std::fill(splat.bias.begin(), splat.bias.end(), 0.0F);
                                 compareSplat(report, splat);
                             }});
    };
    for (const auto& [name, step] :
         {std::pair("few", 0.125F), std::pair("thousands", 32.0F), std::pair("1e14", 1048576.0F)}) {
        catalogue.push_back({std::string("denoiser/splat-distances-") + name, kSplatCheck, 5e-6,
                             "exact distances; logits up to 2, rounded to 1e-6 with them",
                             [step = step](Report& report) {
                                 Splat splat(19, 8, 3, 5, 1);
                                 splat.setAlike(4, step);
                                 compareSplat(report, splat);
                             }});
    }
    const char* const exact = "exact logits, rounding of exponentials and sums";
    scaled("logits-1", 1.0F, 2e-6, exact);
    scaled("logits-1e4", 13334.0F, 2e-6, exact);
    scaled("logits-1e30", 1e30F, 2e-6, exact);
    scaled("logits-0", 0.0F, 2e-6, exact);
    catalogue.push_back({"denoiser/splat-absent-units",
                         "value where no unit is present, and beside; finite and 0", 0.0,
                         "nothing arrives, so nothing may be divided", [](Report& report) {
                             Splat splat(23, 11, 2, 5);
                             std::vector<float> presence(2 * splat.pixels(), 0.0F);
                             splat.in.presence = presence.data();
                             for (const SplatLanes lanes :
                                  {SplatLanes::kScalar, SplatLanes::kNarrow, SplatLanes::kWide}) {
                                 for (const float value : splat.run(lanes)) {
                                     report.error(std::abs(static_cast<double>(value)));
                                 }
                             }
                         }});
}

// The encoder.

PathEncoder randomEncoder(bool shared) {
    TestRandom random(shared ? 3 : 4);
    PathEncoder encoder;
    encoder.logScale = 2.0F;
    const auto layer = [&](int inputs, int outputs) {
        DenseLayer made;
        made.inputs = inputs;
        made.outputs = outputs;
        made.weights.resize(static_cast<std::size_t>(made.blocks()) * DenseLayer::kBlock *
                            static_cast<std::size_t>(inputs));
        made.bias.resize(static_cast<std::size_t>(made.blocks()) * DenseLayer::kBlock);
        for (std::vector<float>* values : {&made.weights, &made.bias}) {
            std::generate(values->begin(), values->end(),
                          [&] { return random.nextFloat() - 0.5F; });
        }
        return made;
    };
    if (shared) {
        encoder.vertex = {layer(28, 16), layer(16, 16)};
        encoder.findVertexBias();
        encoder.embedding = {layer(17 + 22 + 16, 32), layer(32, 32)};
    } else {
        encoder.embedding = {layer(17 + 6 * 22, 32), layer(32, 32)};
    }
    return encoder;
}

void addEncoders(Catalogue& catalogue) {
    struct Input {
        const char* name;
        float strength; ///< of radiance and distances
        double budget;
    };
    for (const bool shared : {true, false}) {
        for (const Input& input : {Input{"black", 0.0F, 3e-6}, Input{"plain", 1.0F, 3e-6},
                                   Input{"1e30", 1e30F, 3e-6}, Input{"1e-30", 1e-30F, 3e-6}}) {
            catalogue.push_back(
                {std::string("denoiser/encoder-") + (shared ? "" : "flat-") + input.name,
                 "embedding on all lanes against the same in double, relative to the largest",
                 input.budget, "two or four layers of up to 149 terms, each rounded",
                 [=](Report& report) {
                     const PathEncoder encoder = randomEncoder(shared);
                     TestRandom random(8);
                     std::vector<float> channels(static_cast<std::size_t>(extended::kChannels) *
                                                 kPathGroup);
                     for (int c = 0; c < extended::kChannels; ++c) {
                         const bool isBit = (c >= extended::kValid && c < extended::kExtended) ||
                                            c >= extended::kEvents;
                         const bool isLight = c < 3 || c == 5;
                         for (int lane = 0; lane < kPathGroup; ++lane) {
                             const float u = random.nextFloat();
                             channels[static_cast<std::size_t>(c) * kPathGroup +
                                      static_cast<std::size_t>(lane)] =
                                 isBit ? (u < 0.5F ? 0.0F : 1.0F)
                                       : u * (isLight ? input.strength : 1.0F);
                         }
                     }
                     const auto width = static_cast<std::size_t>(encoder.width());
                     std::vector<float> found(width * kPathGroup);
                     std::array<PathClass, kPathGroup> classes{};
                     encodePaths(encoder, channels.data(), kPathGroup, found.data(), classes.data(),
                                 nullptr);
                     for (int lane = 0; lane < kPathGroup; ++lane) {
                         PathEncoderLanes<double> exact(encoder, channels.data() + lane);
                         const double* const truth = exact.run();
                         double largest = 0.0;
                         for (std::size_t o = 0; o < width; ++o) {
                             largest = std::max(largest, std::abs(truth[o]));
                         }
                         for (std::size_t o = 0; o < width; ++o) {
                             const auto value = static_cast<double>(
                                 found[static_cast<std::size_t>(lane) * width + o]);
                             report.error(std::abs(value - truth[o]) / largest, [&] {
                                 return Text().add("found", value).add("exact", truth[o]);
                             });
                         }
                     }
                 }});
        }
    }
}

// Whole networks, those that MBFeat comes with.

struct Image {
    int width, height, samples;
    std::vector<float> paths;

    Image(int w, int h, int s, const std::vector<PathSampleField>& fields)
        : width(w),
          height(h),
          samples(s),
          paths(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) *
                static_cast<std::size_t>(s) * fields.size()) {}
    float* path(std::size_t index, std::size_t fields) { return paths.data() + index * fields; }
    std::size_t count() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
               static_cast<std::size_t>(samples);
    }
};

/// Diffuse paths of one vertex and that radiance.
template <class Radiance>
Image paintedImage(int width, int height, int samples, const Radiance& radiance) {
    const std::vector<PathSampleField> fields = pathSampleFields(true);
    Image image(width, height, samples, fields);
    TestRandom random(5);
    for (std::size_t i = 0; i < image.count(); ++i) {
        float* const path = image.path(i, fields.size());
        const float value = radiance(i);
        for (std::size_t f = 0; f < fields.size(); ++f) {
            const std::string& name = fields[f].name;
            const bool ofFirst = name.find(":0.") != std::string::npos;
            path[f] = name == "R" || name == "G" || name == "B" ? value
                      : name == "validMask"                     ? 1.0F
                      : name == "mbfeat:event:0.Y"              ? 5.0F
                      : name.rfind("subpixel", 0) == 0          ? random.nextFloat()
                      : name == "A" || name == "Z" || ofFirst   ? 0.5F
                                                                : 0.0F;
        }
    }
    return image;
}

DenoiseResult reconstructed(const std::string& name, const Image& image) {
    const auto model = DenoiseModel::open(name, 1);
    if (!model) {
        throw std::runtime_error(model.error().text);
    }
    PathSamples paths;
    paths.width = image.width;
    paths.height = image.height;
    paths.capacity = image.samples;
    paths.data = image.paths.data();
    for (const PathSampleField& field : pathSampleFields(true)) {
        paths.fields.push_back(field.name);
    }
    DenoiseOptions options;
    options.threads = 1;
    Result<DenoiseResult> result = denoise(model.value(), paths, options);
    if (!result) {
        throw std::runtime_error(result.error().text);
    }
    return std::move(result.value());
}

void addNetwork(Catalogue& catalogue, const std::string& name) {
    const auto add = [&](const std::string& what, const std::string& check, double budget,
                         const std::string& reason, const std::function<void(Report&)>& run) {
        catalogue.push_back({"denoiser/" + name + "-" + what, check, budget, reason, run});
    };
    add("black", "value of an image of black paths, absolute", 0.0, "means of zeros are zero",
        [=](Report& report) {
            const Image image = paintedImage(29, 17, 4, [](std::size_t) { return 0.0F; });
            for (const float value : reconstructed(name, image).image) {
                report.error(std::abs(static_cast<double>(value)));
            }
        });
    const auto equal = [&](const std::string& what, int width, int height, int samples,
                           float level) {
        add(what, "an image of equal paths against their radiance, relative", 2e-6,
            "any weights give the mean of equal values; rounding of sums", [=](Report& report) {
                const Image image =
                    paintedImage(width, height, samples, [=](std::size_t) { return level; });
                for (const float value : reconstructed(name, image).image) {
                    report.error(
                        relativeError(static_cast<double>(value), static_cast<double>(level)));
                }
            });
    };
    equal("equal", 29, 17, 4, 0.7F);
    equal("equal-dim", 29, 17, 4, 1e-20F);
    equal("equal-bright", 29, 17, 4, 1e20F);
    equal("one-pixel", 1, 1, 4, 0.7F);
    equal("one-sample", 13, 11, 1, 0.7F);
    equal("primes", 37, 23, 3, 0.7F);
    equal("256-samples", 7, 5, 256, 0.7F);
    add("one-bright-path", "largest and smallest value beyond the range of the pixels', relative",
        2e-6, "a mean lies between what it is of; rounding of sums", [=](Report& report) {
            const Image image =
                paintedImage(31, 19, 4, [](std::size_t i) { return i == 1234 ? 1e6F : 1.0F; });
            const float most = (1e6F + 3.0F) / 4.0F;
            for (const float value : reconstructed(name, image).image) {
                report.error(static_cast<double>(std::max(value - most, 1.0F - value)),
                             [&] { return Text().add("value", static_cast<double>(value)); });
            }
        });
    add("not-numbers", "an image with paths that are no numbers against one without, relative",
        2e-6, "they are left out, the others are equal", [=](Report& report) {
            Image image = paintedImage(21, 13, 4, [](std::size_t) { return 0.7F; });
            const std::size_t fields = pathSampleFields(true).size();
            std::uint64_t spoiled = 0;
            for (std::size_t i = 0; i < image.count(); i += 9) {
                image.path(i, fields)[i % fields] = i % 2 == 0
                                                        ? std::numeric_limits<float>::quiet_NaN()
                                                        : std::numeric_limits<float>::infinity();
                ++spoiled;
            }
            const DenoiseResult result = reconstructed(name, image);
            report.require(result.repaired > 0 && result.repaired <= spoiled,
                           [&] { return Text().add("left out", double(result.repaired)); });
            for (const float value : result.image) {
                report.error(relativeError(static_cast<double>(value), 0.7));
            }
        });
}

} // namespace

void addDenoiser(Catalogue& catalogue) {
    addSplats(catalogue);
    addEncoders(catalogue);
    // Networks need ONNX Runtime, which a build may lack.
    if (OnnxRuntime::instance()) {
        for (const auto& [name, file] : DenoiseModel::installed()) {
            addNetwork(catalogue, name);
        }
    }
}

} // namespace mbfeat::stability
