// What a sample costs in the film: nanoseconds per Film::add() for the AOV sets that renders use.
//
// Samples go to the pixels of a tile in passes, as the render thread adds them, so that
// the accumulators are as cold as they are there. Processor time of the best of several runs is
// printed: other load on the machine only ever adds to it.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "film/film.h"

using namespace mbfeat;

namespace {

constexpr int kImage = 256;
constexpr int kTile = 16;
constexpr int kSamples = 16;
constexpr int kRuns = 5;

std::vector<std::string> aovsWith(std::uint32_t flags) {
    std::vector<std::string> names;
    for (const AovDescriptor& aov : aovTable()) {
        if ((aov.recordFlags & flags) != 0) {
            names.push_back(aov.name);
        }
    }
    return names;
}

void addTile(Film& film, int left, int top, const std::vector<PathRecord>& records) {
    std::size_t next = 0;
    for (int sample = 0; sample < kSamples; ++sample) {
        for (int y = top; y < top + kTile; ++y) {
            for (int x = left; x < left + kTile; ++x) {
                film.add(x, y, records[next++ % records.size()]);
            }
        }
    }
}

/// Nanoseconds per sample.
double measure(const FilmRequest& request, const std::vector<PathRecord>& records) {
    double best = 1e30;
    Film film(request);
    for (int run = 0; run < kRuns; ++run) {
        film.clear();
        const std::clock_t start = std::clock();
        for (int top = 0; top < kImage; top += kTile) {
            for (int left = 0; left < kImage; left += kTile) {
                addTile(film, left, top, records);
            }
        }
        const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        best = std::min(best, 1e9 * seconds / (static_cast<double>(kImage) * kImage * kSamples));
    }
    return best;
}

/// Nanoseconds that a pixel of an AOV takes to be read.
double measureReading(FilmRequest request, const std::vector<PathRecord>& records) {
    request.aovs = {"color"};
    Film film(request);
    for (int y = 0; y < kImage; ++y) {
        for (int x = 0; x < kImage; ++x) {
            film.add(x, y, records[0]);
        }
    }
    std::vector<float> out(static_cast<std::size_t>(kImage) * kImage * 4);
    constexpr int kReadings = 50;
    const std::clock_t start = std::clock();
    for (int reading = 0; reading < kReadings; ++reading) {
        film.resolve(0, out.data());
    }
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    return 1e9 * seconds / (static_cast<double>(kImage) * kImage * kReadings);
}

} // namespace

int main() {
    // The integrator reuses few records a thread, so those are warm.
    std::vector<PathRecord> records(64);
    for (std::size_t i = 0; i < records.size(); ++i) {
        records[i].radiance = Rgb(0.25F * static_cast<float>(i));
        records[i].subpixel = {static_cast<float>(i % 8) / 8.0F, static_cast<float>(i / 8) / 8.0F};
        records[i].vertexCount = static_cast<int>(i % 7);
    }
    FilmRequest request;
    request.window.width = request.window.height = kImage;
    request.window.data = {0, 0, kImage, kImage};
    request.samplesPerPixel = kSamples;
    const auto print = [&](const char* name) {
        std::printf("%-28s %7.1f ns a sample\n", name, measure(request, records));
    };
    std::printf("%-28s %7.1f ns a pixel\n", "reading color", measureReading(request, records));
    print("color");
    request.aovs = aovsWith(kRecordFirstHit);
    print("first hit");
    request.aovs = {"variance", "sampleCount", "nonFinite"};
    print("statistics");
    request.aovs = aovsWith(kRecordFeatures);
    print("paper set (54 values)");
    request.aovs = aovsWith(kRecordFeatures | kRecordContributions | kRecordExtended);
    print("paper set and extended");
    request.aovs.clear();
    for (const AovDescriptor& aov : aovTable()) {
        request.aovs.push_back(aov.name);
    }
    print("whole table");
    request.aovs.clear();
    request.keepPathSamples = true;
    print("kept paths (62 values)");
    return 0;
}
