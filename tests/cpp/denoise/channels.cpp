// Paths are made ready for a network one by one and in groups on lanes, to the same bits.
#include "denoise/channels.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

using namespace mbfeat;

namespace {

constexpr std::size_t kGroup = kPathGroup;

/// Fields in an order of their own, as many as asked for, the last ones unused.
std::vector<std::string> fieldNames(std::size_t unused) {
    std::vector<std::string> names = {"validMask",
                                      "R",
                                      "G",
                                      "B",
                                      "mbfeat:normal:0.X",
                                      "mbfeat:normal:0.Y",
                                      "mbfeat:normal:0.Z",
                                      "mbfeat:event:0.Y",
                                      "mbfeat:albedo:0.R",
                                      "mbfeat:albedo:0.G",
                                      "mbfeat:albedo:0.B",
                                      "mbfeat:direct:1.R",
                                      "mbfeat:direct:1.G",
                                      "mbfeat:direct:1.B"};
    for (std::size_t i = 0; i < unused; ++i) {
        names.push_back("unused" + std::to_string(i));
    }
    return names;
}

const std::vector<std::string> kChannels = {"R",
                                            "G",
                                            "B",
                                            "mbfeat:albedo:0.R",
                                            "mbfeat:albedo:0.G",
                                            "mbfeat:normal:0.X",
                                            "mbfeat:normal:0.Y",
                                            "mbfeat:normal:0.Z",
                                            "valid:0",
                                            "valid:5",
                                            "specular:0",
                                            "diffuse:0",
                                            "mbfeat:direct:1.G"};

struct Paths {
    PathSamples samples;
    std::vector<float> values;
    std::vector<const float*> rows;

    explicit Paths(std::size_t unused) {
        samples.fields = fieldNames(unused);
        samples.width = static_cast<int>(kGroup);
        samples.height = samples.capacity = 1;
        std::mt19937 random(17);
        std::normal_distribution<float> normal;
        for (float& value : samples.worldToCamera) {
            value = normal(random);
        }
        values.resize(kGroup * samples.fields.size());
        for (float& value : values) {
            value = normal(random);
        }
        for (std::size_t i = 0; i < kGroup; ++i) {
            float* const row = values.data() + i * samples.fields.size();
            row[0] = static_cast<float>(random() % 64);
            row[7] = static_cast<float>(random() % 32);
            rows.push_back(row);
        }
        samples.data = values.data();
    }
    float& at(std::size_t path, std::size_t field) {
        return values[path * samples.fields.size() + field];
    }
};

ChannelPlan planOf(const PathSamples& samples, ShownFeatures shown) {
    Result<ChannelPlan> made = ChannelPlan::make(kChannels, samples, shown, {"mbfeat:direct:1.R"});
    REQUIRE(made);
    return std::move(made.value());
}

/// Bits of the paths that are kept; the channels of both ways are compared.
std::uint32_t writtenAlike(const Paths& paths, int count, ShownFeatures shown) {
    const ChannelPlan plan = planOf(paths.samples, shown);
    std::vector<float> alone(plan.size() * kGroup, 0.0F), group(plan.size() * kGroup, 7.0F);
    std::uint32_t expected = 0;
    for (int i = 0; i < count; ++i) {
        const auto path = static_cast<std::size_t>(i);
        if (plan.write(paths.rows[path], alone.data() + path, kGroup)) {
            expected |= 1U << static_cast<unsigned>(i);
        }
    }
    const std::uint32_t found = plan.writeGroup(paths.rows.data(), count, group.data());
    CHECK(found == expected);
    CHECK(group == alone);
    return found;
}

} // namespace

TEST_CASE("a group of paths has the channels that its paths have alone") {
    for (std::size_t unused = 0; unused < 5; ++unused) {
        const Paths paths(unused);
        for (int count = 1; count <= kPathGroup; ++count) {
            for (const ShownFeatures shown :
                 {ShownFeatures::kAll, ShownFeatures::kFirstHit, ShownFeatures::kNone}) {
                CHECK(writtenAlike(paths, count, shown) ==
                      (1U << static_cast<unsigned>(count)) - 1);
            }
        }
    }
}

TEST_CASE("fields may lie anywhere in a path's memory, and be integers") {
    using Kind = PathFieldPlace::Kind;
    Paths paths(0);
    const std::size_t count = paths.samples.fields.size();
    // Backwards in groups of colours, after a word that nobody reads; whole quads, as records have.
    const std::vector<std::size_t> order = {11, 12, 13, 8, 9, 10, 7, 4, 5, 6, 1, 2, 3, 0};
    const std::size_t words = (count + 1 + 3) / 4 * 4;
    PathSamples moved = paths.samples;
    moved.places.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        moved.places[order[i]].word = i + 1;
    }
    moved.places[0].kind = Kind::kVertexCount;
    moved.places[7].kind = Kind::kInteger;
    std::vector<float> memory(kGroup * words, std::numeric_limits<float>::quiet_NaN());
    std::vector<const float*> rows;
    for (std::size_t path = 0; path < kGroup; ++path) {
        const auto vertices = static_cast<std::uint32_t>(path % 7);
        paths.at(path, 0) = static_cast<float>((1U << vertices) - 1U);
        float* const row = memory.data() + path * words;
        for (std::size_t i = 0; i < count; ++i) {
            const float value = paths.at(path, i);
            float* const to = row + moved.places[i].word;
            // Beside the count the word has bytes of any value.
            const std::uint32_t number =
                i == 0 ? (vertices << 8U) | 0x5A5A0001U : static_cast<std::uint32_t>(value);
            if (moved.places[i].kind == Kind::kFloat) {
                *to = value;
            } else {
                std::memcpy(to, &number, sizeof(number));
            }
        }
        rows.push_back(row);
    }
    for (const ShownFeatures shown : {ShownFeatures::kAll, ShownFeatures::kFirstHit}) {
        const ChannelPlan plan = planOf(paths.samples, shown), other = planOf(moved, shown);
        std::vector<float> expected(plan.size() * kGroup), group(expected), alone(expected);
        const std::uint32_t kept = plan.writeGroup(paths.rows.data(), kPathGroup, expected.data());
        CHECK(other.writeGroup(rows.data(), kPathGroup, group.data()) == kept);
        CHECK(group == expected);
        for (std::size_t path = 0; path < kGroup; ++path) {
            CHECK(other.write(rows[path], alone.data() + path, kGroup));
        }
        CHECK(alone == expected);
    }
}

TEST_CASE("paths that are not finite are left out of a group, wherever the value is") {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
    for (const float bad : {kInfinity, -kInfinity, kNoNumber}) {
        // The mask, a colour, a normal, an event, a reconstructed colour that no channel shows.
        for (const std::size_t field : {0U, 2U, 5U, 7U, 11U}) {
            Paths paths(0);
            paths.at(3, field) = bad;
            paths.at(12, field) = bad;
            CHECK(writtenAlike(paths, kPathGroup, ShownFeatures::kAll) == 0xEFF7U);
        }
        Paths paths(0);
        paths.at(3, 10) = bad; // that nobody asks for
        CHECK(writtenAlike(paths, kPathGroup, ShownFeatures::kAll) == 0xFFFFU);
    }
    Paths paths(0);
    paths.at(0, 0) = -1.0F;
    paths.at(1, 0) = 1e10F;
    paths.at(2, 5) = 3e38F; // the rotated normal overflows
    paths.at(2, 6) = 3e38F;
    paths.at(2, 4) = 3e38F;
    writtenAlike(paths, kPathGroup, ShownFeatures::kAll);
    for (const float large : {16777216.0F, 2147483648.0F, 4294967040.0F}) {
        paths.at(5, 0) = large;
        writtenAlike(paths, kPathGroup, ShownFeatures::kAll);
    }
}
