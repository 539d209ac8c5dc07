// The fields of a path record are the same as a row and where they lie in the record.
#include "film/pathRow.h"

#include <cstring>
#include <random>
#include <vector>

#include <doctest/doctest.h>

using namespace mbfeat;

TEST_CASE("a record's fields lie where they are said to be") {
    std::mt19937 random(3);
    PathRecord record;
    // Any bytes but for what has a meaning as an integer: a row is floats.
    std::vector<float> noise(sizeof(PathRecord) / sizeof(float));
    std::normal_distribution<float> normal;
    for (float& value : noise) {
        value = normal(random);
    }
    std::memcpy(static_cast<void*>(&record), noise.data(), sizeof(PathRecord));
    record.nonFinite = false;
    int event = 1;
    for (VertexExtended& vertex : record.extended) {
        vertex.event = event;
        event = event * 2 + 1;
    }
    for (int vertices = 0; vertices <= kFeatureVertices; ++vertices) {
        record.vertexCount = static_cast<std::uint8_t>(vertices);
        const std::vector<std::string> names = pathRecordFields(true);
        const std::vector<PathFieldPlace> places = pathRecordPlaces(true);
        REQUIRE(places.size() == names.size());
        std::vector<float> row(names.size());
        const float* const rowEnd = writePathRow(record, true, row.data());
        const auto fields = static_cast<std::size_t>(rowEnd - row.data());
        REQUIRE(fields == pathRecordFields(false).size());
        REQUIRE(fields == pathRecordPlaces(false).size());
        const auto* const words = reinterpret_cast<const float*>(&record);
        for (std::size_t i = 0; i < fields; ++i) {
            CAPTURE(names[i]);
            CHECK(places[i].read(words) == row[i]);
        }
        // Behind them what each part adds: emission, vertices, tail.
        CHECK(names[fields] == "mbfeat:contribution:emission.R");
        CHECK(places[fields].read(words) == record.emission.x);
        CHECK(names[fields + 3] == "mbfeat:contribution:0.R");
        CHECK(places[fields + 4].read(words) == record.contributions[0].y);
        CHECK(names.back() == "mbfeat:contribution:tail.B");
        CHECK(places.back().read(words) == record.tail.z);
    }
}
