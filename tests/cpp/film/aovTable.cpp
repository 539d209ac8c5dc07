#include "film/aovTable.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <set>

#include "integrate/pathRecord.h"

using namespace mbfeat;

namespace {

const AovDescriptor& aov(const std::string& name) {
    const auto& table = aovTable();
    const auto found = std::find_if(table.begin(), table.end(),
                                    [&](const AovDescriptor& entry) { return entry.name == name; });
    REQUIRE_MESSAGE(found != table.end(), name);
    return *found;
}

} // namespace

TEST_CASE("every AOV lies inside the record, has channels and says what it means") {
    std::set<std::string> names;
    for (const AovDescriptor& entry : aovTable()) {
        CAPTURE(entry.name);
        CHECK(names.insert(entry.name).second);
        CHECK(entry.width() >= 1);
        CHECK(entry.doc.size() > 20);
        CHECK(entry.doc.back() == '.');
        if (entry.recordOffset != kNoRecordField && entry.reduction != AovReduction::kSum) {
            CHECK(entry.recordOffset % 4 == 0);
            CHECK(entry.recordOffset + entry.channels.size() * 4 <= sizeof(PathRecord));
        }
        std::set<std::string> channels(entry.channels.begin(), entry.channels.end());
        CHECK(channels.size() == entry.channels.size());
    }
}

TEST_CASE("the paper's 54 values are the table's features in the record's order") {
    std::size_t offset = offsetof(PathRecord, features);
    int values = 0;
    for (const AovDescriptor& entry : aovTable()) {
        if (entry.name == "albedo" || (entry.recordFlags & kRecordFeatures) == 0) {
            continue;
        }
        CHECK(entry.recordOffset == offset);
        offset += static_cast<std::size_t>(entry.width()) * sizeof(float);
        values += entry.width();
    }
    CHECK(values == 54);
    CHECK(aov("mbfeat:albedo:0").vertex == 0);
    CHECK(aov("mbfeat:direct:5").vertex == 5);
    CHECK(aov("mbfeat:normal:2").channels == std::vector<std::string>{"X", "Y", "Z"});
}

TEST_CASE("names of the table are those of the documented AOVs") {
    const std::vector<std::string> standard = {
        "color",      "alpha",     "depth",  "cameraDepth", "normal",   "Neye",        "primId",
        "instanceId", "elementId", "albedo", "mbfeat:raw",  "variance", "sampleCount", "nonFinite"};
    for (std::size_t i = 0; i < standard.size(); ++i) {
        CHECK(aovTable()[i].name == standard[i]);
    }
    for (const char* name :
         {"mbfeat:contribution:0", "mbfeat:contribution:5", "mbfeat:contribution:emission",
          "mbfeat:contribution:tail", "mbfeat:firstNonDelta:albedo", "mbfeat:firstNonDelta:normal",
          "mbfeat:firstNonDelta:depth", "mbfeat:firstNonDelta:tint", "mbfeat:roughness:0",
          "mbfeat:distance:1", "mbfeat:throughput:4", "mbfeat:event:5"}) {
        CHECK(findAov(name).has_value());
    }
    CHECK(aovTable().size() == standard.size() + 18 + 8 + 4 + 24);
    CHECK(aov("color").channels == std::vector<std::string>{"R", "G", "B", "A"});
    CHECK(aov("primId").clearValue == -1.0F);
    CHECK(aov("depth").clearValue == 1.0F);
    CHECK(aov("albedo").recordOffset == aov("mbfeat:albedo:0").recordOffset);
}

TEST_CASE("primvars are found by any name, other unknown names are not") {
    const auto st = findAov("primvars:st");
    REQUIRE(st.has_value());
    CHECK(st->name == "primvars:st");
    CHECK(st->recordFlags == kRecordPrimvars);
    CHECK(st->channels == std::vector<std::string>{"X", "Y", "Z"});
    CHECK(findAov("primvars:displayColor")->channels == std::vector<std::string>{"R", "G", "B"});
    CHECK_FALSE(findAov("primvars:").has_value());
    CHECK_FALSE(findAov("").has_value());
    CHECK_FALSE(findAov("mbfeat:albedo:6").has_value());
}

TEST_CASE("hosts that need identifiers reach every AOV") {
    for (const AovDescriptor& entry : aovTable()) {
        std::string identifier = entry.name;
        std::replace(identifier.begin(), identifier.end(), ':', '_');
        CHECK(aovOfHostName(identifier) == entry.name);
        CHECK(aovOfHostName(entry.name) == entry.name);
    }
    CHECK(aovOfHostName("primvars_st") == "primvars:st");
    CHECK(aovOfHostName("primvars_my_name") == "primvars:my_name");
    CHECK(aovOfHostName("primvars:st") == "primvars:st");
    for (const char* name : {"", "primvars_", "mbfeat_albedo_6", "mbfeat_albedo:0"}) {
        CHECK(aovOfHostName(name) == name);
    }
}

TEST_CASE("the nearest name is the one that was meant") {
    CHECK(nearestAovName("mbfeat:albdo:0") == "mbfeat:albedo:0");
    CHECK(nearestAovName("Color") == "color");
    CHECK(nearestAovName("mbfeat:direct:6").substr(0, 14) == "mbfeat:direct:");
    CHECK(nearestAovName("primvar:st") == "primvars:st");
}
