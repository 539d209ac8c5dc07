#include "film/film.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <thread>
#include <utility>

#include "film/records.h"

using namespace mbfeat;

namespace {

/// Mean of a field over the samples 0 .. n - 1 of makeRecord(), whose values grow by 1 a sample.
float expectedMean(float atFirst, int n) {
    return atFirst + static_cast<float>(n - 1) / 2.0F;
}

std::vector<float> recordValues(const PathRecord& record, const AovDescriptor& aov) {
    std::vector<float> values(aov.channels.size());
    std::memcpy(values.data(), reinterpret_cast<const char*>(&record) + aov.recordOffset,
                values.size() * sizeof(float));
    return values;
}

FilmRequest requestOf(const std::vector<std::string>& aovs) {
    FilmRequest request;
    request.window = makeWindow(3, 2);
    request.aovs = aovs;
    return request;
}

} // namespace

TEST_CASE("color is always bound, first, and once") {
    CHECK(Film(requestOf({})).aovs().size() == 1);
    const Film film(requestOf({"depth", "color", "mbfeat:albedo:0"}));
    CHECK(film.aovs().size() == 3);
    CHECK(film.aovs()[0].name == "color");
    CHECK(film.findBound("depth") == 1);
    CHECK(film.findBound("normal") == -1);
    CHECK(film.recordFlags() == (kRecordFirstHit | kRecordFeatures));
    CHECK(Film(requestOf({})).recordFlags() == 0);
}

TEST_CASE("means of all AOVs together are the means of their fields") {
    Film film(requestOf(allAovs()));
    constexpr int kSamples = 5;
    for (int s = 0; s < kSamples; ++s) {
        film.add(1, 1, makeRecord(s));
    }
    const PathRecord first = makeRecord(0);
    for (const AovDescriptor& aov : film.aovs()) {
        if (aov.reduction != AovReduction::kMean) {
            continue;
        }
        CAPTURE(aov.name);
        const std::vector<float> values = valueOf(film, aov.name, 1, 1);
        const std::vector<float> fields = recordValues(first, aov);
        for (std::size_t c = 0; c < values.size(); ++c) {
            CHECK(values[c] == expectedMean(fields[c], kSamples));
        }
    }
    CHECK(film.sampleCount(1, 1) == kSamples);
    CHECK(film.sampleCount(0, 0) == 0);
}

TEST_CASE("an AOV's value does not depend on what else is bound") {
    const std::vector<std::string> names = allAovs();
    Film together(requestOf(names));
    for (int s = 0; s < 3; ++s) {
        together.add(0, 0, makeRecord(s));
    }
    for (const std::string& name : names) {
        CAPTURE(name);
        Film alone(requestOf({name}));
        for (int s = 0; s < 3; ++s) {
            alone.add(0, 0, makeRecord(s));
        }
        CHECK(valueOf(alone, name) == valueOf(together, name));
    }
}

TEST_CASE("filter weights weigh the means") {
    Film film(requestOf({"mbfeat:direct:3"}));
    const float weights[] = {1.0F, 3.0F, -0.5F};
    double sum = 0.0;
    double total = 0.0;
    for (int s = 0; s < 3; ++s) {
        PathRecord record = makeRecord(s);
        record.filterWeight = weights[s];
        film.add(0, 0, record);
        sum += static_cast<double>(weights[s]) * record.features[3].direct.y;
        total += weights[s];
    }
    CHECK(valueOf(film, "mbfeat:direct:3")[1] == static_cast<float>(sum / total));
}

TEST_CASE("weights that cancel give the plain quotient, not a division by zero") {
    Film film(requestOf({}));
    PathRecord record = makeRecord(1);
    film.add(0, 0, record);
    record.filterWeight = -1.0F;
    film.add(0, 0, record);
    for (const float value : valueOf(film, "color")) {
        CHECK(value == 0.0F);
    }
}

TEST_CASE("ids and depths are those of the sample nearest the pixel centre, the first of equals") {
    Film film(
        requestOf({"primId", "instanceId", "elementId", "depth", "cameraDepth", "mbfeat:event:2"}));
    const Float2 positions[] = {{0.1F, 0.5F}, {0.5F, 0.75F}, {0.75F, 0.5F}, {0.5F, 0.0F}};
    for (int s = 0; s < 4; ++s) {
        PathRecord record = makeRecord(s);
        record.subpixel = positions[s];
        film.add(2, 0, record);
    }
    const PathRecord nearest = makeRecord(1);
    CHECK(valueOf(film, "primId", 2)[0] == 101.0F);
    CHECK(valueOf(film, "instanceId", 2)[0] == 201.0F);
    CHECK(valueOf(film, "elementId", 2)[0] == 301.0F);
    CHECK(valueOf(film, "depth", 2)[0] == nearest.depth);
    CHECK(valueOf(film, "cameraDepth", 2)[0] == nearest.cameraDepth);
    CHECK(valueOf(film, "mbfeat:event:2", 2)[0] == static_cast<float>(nearest.extended[2].event));
    std::vector<std::int32_t> ids(6);
    film.resolveInt(film.findBound("primId"), ids.data());
    CHECK(ids == std::vector<std::int32_t>{-1, -1, 101, -1, -1, -1});
}

TEST_CASE("variance is the unbiased variance of the mean, also far from zero") {
    constexpr double kOffset = 1e6;
    constexpr int kSamples = 1000;
    Film film(requestOf({"variance"}));
    double sum = 0.0;
    std::vector<double> values;
    for (int s = 0; s < kSamples; ++s) {
        PathRecord record;
        record.radiance.y = static_cast<float>(kOffset + (s * 7 % 16) * 0.125);
        values.push_back(record.radiance.y);
        sum += record.radiance.y;
        film.add(0, 0, record);
    }
    double squares = 0.0;
    for (const double value : values) {
        squares += (value - sum / kSamples) * (value - sum / kSamples);
    }
    const double expected = squares / (kSamples - 1.0) / kSamples;
    const std::vector<float> variance = valueOf(film, "variance");
    CHECK(variance[0] == 0.0F);
    CHECK(variance[1] == doctest::Approx(expected).epsilon(1e-6));
    CHECK(valueOf(film, "variance", 1)[1] == 0.0F);
}

TEST_CASE("variance follows the filter weights") {
    // Samples of equal weight, whatever it is, have the variance of unweighted ones.
    std::vector<float> results;
    for (const float weight : {1.0F, 0.25F}) {
        Film film(requestOf({"variance"}));
        for (int s = 0; s < 4; ++s) {
            PathRecord record = makeRecord(s);
            record.filterWeight = weight;
            film.add(0, 0, record);
        }
        results.push_back(valueOf(film, "variance")[0]);
    }
    CHECK(results[0] == doctest::Approx(5.0 / 12.0));
    CHECK(results[1] == doctest::Approx(5.0 / 12.0));
    // A single sample of weight zero beside two others changes nothing but the count.
    Film film(requestOf({"variance"}));
    PathRecord record = makeRecord(0);
    record.filterWeight = 0.0F;
    film.add(0, 0, record);
    CHECK(std::isfinite(valueOf(film, "variance")[0]));
}

TEST_CASE("counts of samples and of samples that were not finite") {
    Film film(requestOf({"sampleCount", "nonFinite"}));
    for (int s = 0; s < 4; ++s) {
        PathRecord record = makeRecord(s);
        record.nonFinite = s % 2 == 1;
        film.add(0, 1, record);
    }
    std::vector<std::int32_t> counts(6);
    film.resolveInt(film.findBound("sampleCount"), counts.data());
    CHECK(counts == std::vector<std::int32_t>{0, 0, 0, 4, 0, 0});
    film.resolveInt(film.findBound("nonFinite"), counts.data());
    CHECK(counts == std::vector<std::int32_t>{0, 0, 0, 2, 0, 0});
}

TEST_CASE("pixels without samples and cleared films resolve to the clear value") {
    FilmRequest request = requestOf(allAovs());
    request.keepPathSamples = true;
    request.samplesPerPixel = 2;
    Film film(request);
    const auto checkClear = [&] {
        for (const AovDescriptor& aov : film.aovs()) {
            CAPTURE(aov.name);
            for (const float value : valueOf(film, aov.name)) {
                CHECK(value == aov.clearValue);
            }
        }
    };
    checkClear();
    film.add(0, 0, makeRecord(7));
    CHECK(valueOf(film, "depth")[0] == makeRecord(7).depth);
    CHECK(film.pathSamples()[0] == makeRecord(7).radiance.x);
    film.clear();
    checkClear();
    CHECK(film.pathSamples()[0] == 0.0F);
    film.add(0, 0, makeRecord(3));
    CHECK(valueOf(film, "sampleCount")[0] == 1.0F);
    CHECK(valueOf(film, "primId")[0] == 103.0F);
    CHECK(valueOf(film, "color")[0] == makeRecord(3).radiance.x);
}

TEST_CASE("crop and overscan windows place samples by display-window coordinates") {
    FilmRequest request = requestOf({"primId"});
    request.window = makeWindow(4, 3);
    request.window.data = {-2, -1, 7, 5};
    Film film(request);
    film.add(-2, -1, makeRecord(0));
    film.add(4, 3, makeRecord(1));
    film.add(0, 2, makeRecord(2));
    std::vector<std::int32_t> ids(35);
    film.resolveInt(film.findBound("primId"), ids.data());
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const std::int32_t expected = i == 0 ? 100 : i == 34 ? 101 : i == 3 * 7 + 2 ? 102 : -1;
        CHECK(ids[i] == expected);
    }
    std::vector<std::int32_t> row(7);
    FilmRow copy(film);
    copy.read(3);
    copy.resolveInt(film.findBound("primId"), row.data());
    CHECK(row == std::vector<std::int32_t>(ids.begin() + 21, ids.begin() + 28));
}

TEST_CASE("each primvar AOV reads its own slot") {
    Film film(requestOf({"primvars:st", "primvars:displayColor"}));
    CHECK(film.primvars() == std::vector<std::string>{"st", "displayColor"});
    const PathRecord record = makeRecord(0);
    film.add(0, 0, record);
    CHECK(valueOf(film, "primvars:st") ==
          std::vector<float>{record.primvars[0].x, record.primvars[0].y, record.primvars[0].z});
    CHECK(valueOf(film, "primvars:displayColor") ==
          std::vector<float>{record.primvars[1].x, record.primvars[1].y, record.primvars[1].z});
}

TEST_CASE("kept paths hold every field of every sample, in sample order") {
    for (const bool extended : {false, true}) {
        FilmRequest request = requestOf({});
        request.keepPathSamples = true;
        request.extendedPathSamples = extended;
        request.samplesPerPixel = 3;
        Film film(request);
        const auto& layout = film.pathSampleLayout();
        CHECK(layout.size() == (extended ? 98 : 62));
        CHECK((film.recordFlags() & kRecordFeatures) != 0);
        CHECK(((film.recordFlags() & kRecordExtended) != 0) == extended);
        for (int s = 0; s < 4; ++s) { // one more than there is room for
            film.add(1, 0, makeRecord(s));
        }
        const float* const pixel = film.pathSamples() + 3 * layout.size();
        for (int s = 0; s < 3; ++s) {
            const PathRecord record = makeRecord(s);
            for (std::size_t f = 0; f < layout.size(); ++f) {
                CAPTURE(layout[f].name);
                const float value = pixel[static_cast<std::size_t>(s) * layout.size() + f];
                const std::size_t dot = layout[f].name.rfind('.');
                const auto aov = findAov(layout[f].name.substr(0, dot));
                if (layout[f].name == "validMask") {
                    CHECK(value == static_cast<float>(record.validMask()));
                } else if (layout[f].name == "Z") {
                    CHECK(value == record.distance);
                } else if (aov && layout[f].isInteger) {
                    CHECK(value == static_cast<float>(record.extended[aov->vertex].event));
                } else if (aov) {
                    const auto channel = std::find(aov->channels.begin(), aov->channels.end(),
                                                   layout[f].name.substr(dot + 1));
                    const auto index = static_cast<std::size_t>(channel - aov->channels.begin());
                    CHECK(value == recordValues(record, *aov)[index]);
                }
            }
            CHECK(pixel[static_cast<std::size_t>(s) * layout.size()] == record.radiance.x);
        }
        CHECK(film.pathSamples()[0] == 0.0F);
        CHECK(film.pathSamples()[6 * layout.size()] == 0.0F);
    }
}

TEST_CASE("requests that cannot be met are errors that say why") {
    constexpr std::size_t kLimit = 1U << 20U;
    const auto errorOf = [&](const FilmRequest& request) {
        const auto film = Film::create(request, kLimit);
        REQUIRE_FALSE(film);
        return film.error().subject + ": " + film.error().text;
    };
    CHECK(errorOf(requestOf({"mbfeat:albdo:1"})).find("mbfeat:albedo:1") != std::string::npos);
    CHECK(errorOf(requestOf({"depth", "depth"})).find("twice") != std::string::npos);
    std::vector<std::string> primvars;
    for (int i = 0; i <= kMaxPrimvarAovs; ++i) {
        primvars.push_back("primvars:p" + std::to_string(i));
    }
    CHECK(errorOf(requestOf(primvars)).find("primvars") != std::string::npos);

    FilmRequest request = requestOf({});
    request.window.data.width = 0;
    CHECK(errorOf(request).find("empty") != std::string::npos);

    request = requestOf({});
    request.keepPathSamples = true;
    request.samplesPerPixel = 1 << 30;
    CHECK(errorOf(request).find("mbfeat:pathSampleMemory") != std::string::npos);
    request.samplesPerPixel = 4;
    const auto film = Film::create(request, kLimit);
    REQUIRE(film);
    CHECK(film.value()->pathSampleCapacity() == 4);
    CHECK(film.value()->bytes() >= 6U * 4U * 62U * 4U);

    request = requestOf(allAovs());
    request.window = makeWindow(1 << 30, 1 << 30);
    CHECK(errorOf(request).find("memory") != std::string::npos);
}

TEST_CASE("readers of a film that is being rendered see whole samples") {
    Film film(requestOf({"color", "mbfeat:albedo:0", "variance", "primId", "sampleCount"}));
    std::atomic<bool> done{false};
    std::thread writer([&] {
        for (int round = 0; round < 20; ++round) {
            film.clear();
            for (int s = 0; s < 500; ++s) {
                PathRecord record;
                record.radiance = Rgb(static_cast<float>(s));
                record.features[0].albedo = Rgb(static_cast<float>(s));
                record.primId = s;
                record.filterWeight = 1.0F;
                film.add(1, 1, record);
                film.add(2, 0, record);
            }
        }
        done = true;
    });
    int wrong = 0;
    std::uint32_t most = 0;
    while (!done) {
        for (const auto& [x, y] : {std::pair(1, 1), std::pair(2, 0)}) {
            for (const char* name : {"color", "mbfeat:albedo:0", "variance"}) {
                // Sums of half a sample would give three different values.
                const std::vector<float> value = valueOf(film, name, x, y);
                wrong += value[0] == value[1] && value[1] == value[2] ? 0 : 1;
            }
            most = std::max(most, film.sampleCount(x, y));
        }
    }
    writer.join();
    CHECK(wrong == 0);
    CHECK(most <= 500);
    CHECK(valueOf(film, "sampleCount", 1, 1)[0] == 500.0F);
    CHECK(valueOf(film, "color", 2, 0)[0] == 249.5F);
}
