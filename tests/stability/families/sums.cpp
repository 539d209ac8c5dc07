// Sums: a million samples a pixel, cancelling and outlying values, halves that overflow, weights
// over the whole range of floats.
#include "families.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include <ImfFrameBuffer.h>
#include <ImfInputFile.h>
#include <half.h>

#include "film/product.h"
#include "film/report.h"
#include "film/temporaryDirectory.h"
#include "rendering.h"
#include "shading/lightWeights.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;
using test::TestScene;

constexpr int kMillion = 1000000;

/// The pixel of a film after `count` samples of radiance value(i) and filter weight weight(i).
template <class Value, class Weight>
std::vector<float> accumulate(int count, const std::string& aov, const Value& value,
                              const Weight& weight) {
    FilmRequest request;
    request.window.width = request.window.height = 1;
    request.window.data = {0, 0, 1, 1};
    request.aovs = {"color", "variance"};
    Film film(request);
    for (int i = 0; i < count; ++i) {
        PathRecord record;
        record.radiance = Rgb(value(i));
        record.alpha = 1.0F;
        record.filterWeight = weight(i);
        film.add(0, 0, record);
    }
    const int index = film.findBound(aov);
    std::vector<float> out(
        static_cast<std::size_t>(film.aovs()[static_cast<std::size_t>(index)].width()));
    film.resolve(index, out.data());
    return out;
}

float one(int /*sample*/) {
    return 1.0F;
}

void addMeans(Catalogue& catalogue) {
    const auto add = [&](const std::string& name, double truth, double budget,
                         const std::string& reason, const std::function<float(int)>& value) {
        catalogue.push_back(
            {"sum/million-" + name, "mean of a million samples against the exact one, relative",
             budget, reason, [=](Report& report) {
                 const auto mean =
                     static_cast<double>(accumulate(kMillion, "color", value, one)[0]);
                 report.error(relativeError(mean, truth),
                              [&] { return Text().add("mean", mean).add("exact", truth); });
             }});
    };
    const std::string stored = "sums are in double, the mean is stored as a float: one rounding";
    add("equal", static_cast<double>(0.1F), 6e-8, stored, [](int) { return 0.1F; });
    add("tiny", 1e-37, 1e-7, stored, [](int) { return 1e-37F; });
    add("huge", 1e37, 1e-7, stored, [](int) { return 1e37F; });
    // One firefly among dim samples: neither may swallow the other.
    const double dim = static_cast<double>(1e-3F);
    add("one-of-1e9", (static_cast<double>(1e9F) + (kMillion - 1) * dim) / kMillion, 6e-8, stored,
        [](int i) { return i == 777 ? 1e9F : 1e-3F; });
    add("growing", (kMillion - 1) / 2.0, 6e-8, stored, [](int i) { return static_cast<float>(i); });
}

void addVariances(Catalogue& catalogue) {
    // Values m +- d in turn have the variance d^2 n / (n - 1); of the mean, a n-th of it.
    for (const auto& [name, middle, spread] :
         {std::tuple("1e4-of-1e-2", 1e4F, 0.0625F), std::tuple("1-of-1e-6", 1.0F, 0x1p-20F),
          std::tuple("1e18-of-1e16", 0x1p60F, 0x1p53F)}) {
        catalogue.push_back(
            {std::string("sum/variance-") + name,
             "variance of a mean whose spread is far below it, a million samples, relative", 2e-7,
             "running mean and spread in double do not cancel; stored as a float",
             [middle = middle, spread = spread](Report& report) {
                 const auto got = static_cast<double>(accumulate(
                     kMillion, "variance",
                     [&](int i) { return i % 2 == 0 ? middle + spread : middle - spread; },
                     one)[0]);
                 const double truth = sqr(static_cast<double>(spread)) / (kMillion - 1.0);
                 report.error(relativeError(got, truth),
                              [&] { return Text().add("variance", got).add("exact", truth); });
             }});
    }
}

/// Filters with negative lobes: the mean is that of sum w x / sum w in long double.
void checkNegativeWeights(Report& report) {
    TestRandom random(91);
    std::vector<float> x, w;
    long double above = 0.0L, below = 0.0L;
    for (int i = 0; i < kMillion; ++i) {
        x.push_back(random.nextFloat() * 100.0F);
        w.push_back(random.nextFloat() < 0.3F ? -1.3F : 1.3F);
        above += static_cast<long double>(x.back()) * static_cast<long double>(w.back());
        below += static_cast<long double>(w.back());
    }
    const auto mean = static_cast<double>(accumulate(
        kMillion, "color", [&](int i) { return x[static_cast<std::size_t>(i)]; },
        [&](int i) { return w[static_cast<std::size_t>(i)]; })[0]);
    report.error(relativeError(mean, static_cast<double>(above / below)));
}

/// A pixel of a product as its half values say, read back.
void checkHalfProduct(Report& report) {
    const float values[] = {0.0F,     1e-9F,    6e-8F, 0.1F,  65503.0F, 65504.0F,
                            65519.0F, 65520.0F, 1e6F,  1e30F, 3e38F};
    constexpr int kCount = 11;
    FilmRequest request;
    request.window.width = kCount;
    request.window.height = 1;
    request.window.data = {0, 0, kCount, 1};
    request.aovs = {"color"};
    Film film(request);
    for (int i = 0; i < kCount; ++i) {
        PathRecord record;
        record.radiance = Rgb(values[i]);
        film.add(i, 0, record);
    }
    const TemporaryDirectory folder;
    ProductSpec product;
    product.path = folder.file("half.exr");
    product.layers.push_back({"color", "color", PixelType::kHalf});
    if (const Status failed = writeProduct(product, film, RenderReport())) {
        throw std::runtime_error(failed->subject + " " + failed->text);
    }
    Imf::InputFile file(product.path.c_str());
    std::vector<half> red(kCount);
    Imf::FrameBuffer buffer;
    buffer.insert("R", Imf::Slice(Imf::HALF, reinterpret_cast<char*>(red.data()), sizeof(half),
                                  kCount * sizeof(half)));
    file.setFrameBuffer(buffer);
    file.readPixels(0);
    for (int i = 0; i < kCount; ++i) {
        const double truth = std::min(static_cast<double>(values[i]), 65504.0);
        const auto got = static_cast<double>(static_cast<float>(red[static_cast<std::size_t>(i)]));
        // Half of the step of halves there: 2^-11 relatively, 2^-25 below 6e-5.
        const double step = std::max(truth * 0x1p-11, 0x1p-25);
        report.error(std::abs(got - truth) / step,
                     [&] { return Text().add("value", values[i]).add("half", got); });
    }
}

/// A million paths of one pixel against the value that all have in mean.
void checkRenderedMillion(Report& report) {
    TestScene test;
    test.add("/Floor", test::quadMesh({-9, -9, 0}, {18, 0, 0}, {0, 18, 0}),
             test::constantMaterial("/M", Rgb(0.3F)));
    test.addSky(Rgb(7.0F));
    const Camera camera = test::testCamera({0, 0, 1}, 0.1F);
    const Estimate few = trace(test, camera, 16, 16, plainOptions(1 << 12, 4));
    const Estimate many = trace(test, camera, 1, 1, plainOptions(1 << 20, 4));
    report.error(score(few, 2.1));
    // A net of 2^20 points integrates so steady a function to some 1e-5.
    report.error(relativeError(many.mean(), 2.1) > 1e-4 ? 100.0 : 0.0,
                 [&] { return Text().add("mean of a million", many.mean()); });
}

/// The choice among eight weights from the smallest to nearly the largest floats.
void checkWeights(Report& report, const std::vector<float>& weights) {
    LightWeights choice{};
    double sum = 0.0;
    for (std::size_t i = 0; i < 8; ++i) {
        choice.weight[i] = weights[i];
        sum += static_cast<double>(weights[i]);
    }
    choice.sum();
    report.require(choice.any(), [&] { return Text().add("total", choice.total); });
    for (int i = 0; i < 8; ++i) {
        const double truth = static_cast<double>(weights[static_cast<std::size_t>(i)]) / sum;
        const auto told = static_cast<double>(choice.probability(i));
        // What a float cannot hold may vanish: it would not be chosen in a million years.
        const double error = truth > 1e-37 ? relativeError(told, truth) : std::abs(told - truth);
        report.error(error, [&] { return Text().add("probability", told).add("exact", truth); });
    }
    for (int i = 0; i < 4096; ++i) {
        double u = i == 4095 ? 1.0 - 0x1p-53 : i / 4096.0;
        const double before = u;
        const int lane = choice.choose(u);
        report.require(lane >= 0 && lane < 8 && weights[static_cast<std::size_t>(lane)] > 0.0F &&
                           u >= 0.0 && u < 1.0,
                       [&] { return Text().add("number", before).add("lane", lane); });
    }
}

} // namespace

void addSums(Catalogue& catalogue) {
    addMeans(catalogue);
    addVariances(catalogue);
    catalogue.push_back({"sum/negative-weights",
                         "mean of a million samples of a filter with negative lobes, relative",
                         1e-7, "sums are in double, the mean is stored as a float",
                         checkNegativeWeights});
    catalogue.push_back({"sum/half-overflow",
                         "values of a half-float product against the rendered, up to 65504, in "
                         "roundings of a half",
                         1.0,
                         "rounded to the nearest; beyond its range the largest, never infinity",
                         checkHalfProduct});
    catalogue.push_back({"sum/rendered-million",
                         "a million paths of a pixel, and 256 pixels of 4096, against the closed "
                         "form, score",
                         kLargestZ, kReasonZ, checkRenderedMillion});
    for (const auto& [name, weights] :
         {std::pair("all-sizes",
                    std::vector<float>{1e-38F, 1e-20F, 1e-9F, 0.0F, 1.0F, 1e9F, 1e20F, 1e37F}),
          std::pair("one-tiny", std::vector<float>{0, 0, 0, 1e-37F, 0, 0, 0, 0}),
          std::pair("ends", std::vector<float>{1e-30F, 0, 0, 1.0F, 0, 0, 0, 1e-30F})}) {
        catalogue.push_back(
            {std::string("sum/light-weights-") + name,
             "probabilities of a choice against double, relative; none without weight "
             "is chosen",
             3e-7, "three additions and a division, each rounded",
             [weights = weights](Report& report) { checkWeights(report, weights); }});
    }
}

} // namespace mbfeat::stability
