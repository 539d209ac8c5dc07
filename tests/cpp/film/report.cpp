#include "film/report.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "film/json.h"

using namespace mbfeat;

TEST_CASE("JSON texts are escaped and made valid UTF-8") {
    const auto written = [](const std::string& text) { return JsonWriter().value(text).text(); };
    CHECK(written("a\"b\\c") == R"("a\"b\\c")");
    CHECK(written("line\nend\x01") == R"("line\u000aend\u0001")");
    CHECK(written("caf\xC3\xA9") == "\"caf\xC3\xA9\"");
    CHECK(written(std::string("nul\0.", 5)) == R"("nul\u0000.")");
    const std::string bad = "\xEF\xBF\xBD";
    CHECK(toValidUtf8("\xFF") == bad);
    CHECK(toValidUtf8("\xC3") == bad);                               // cut off
    CHECK(toValidUtf8("\xC0\xAF") == bad + bad);                     // overlong
    CHECK(toValidUtf8("\xED\xA0\x80") == bad + bad + bad);           // surrogate
    CHECK(toValidUtf8("\xF4\x90\x80\x80") == bad + bad + bad + bad); // past U+10FFFF
    CHECK(toValidUtf8("\xF0\x9F\x98\x80") == "\xF0\x9F\x98\x80");
}

TEST_CASE("JSON numbers: shortest text, null where not finite") {
    const auto written = [](auto number) { return JsonWriter().value(number).text(); };
    CHECK(written(0.1) == "0.1");
    CHECK(written(-3.0) == "-3");
    CHECK(written(1e300) == "1e+300");
    CHECK(written(std::nan("")) == "null");
    CHECK(written(-std::numeric_limits<double>::infinity()) == "null");
    CHECK(written(std::numeric_limits<std::uint64_t>::max()) == "18446744073709551615");
    CHECK(written(std::int64_t{-5}) == "-5");
    CHECK(written(true) == "true");
}

TEST_CASE("a report as JSON") {
    RenderReport report;
    report.version = "1.0";
    report.stage = "a \"b\".usda";
    report.frame = -3;
    report.samplesPerPixel = 8;
    report.settings = {{"mbfeat:robust", true, SettingSource::kDefault},
                       {"mbfeat:seed", std::int64_t{9}, SettingSource::kEnvironment},
                       {"mbfeat:pixelFilterWidth", 1.5, SettingSource::kPrim},
                       {"mbfeat:pixelFilter", std::string("box"), SettingSource::kCommandLine}};
    report.census.add(Effect::kTextures, "/World/Wood");
    report.census.add(Effect::kTextures, "/World/Cloth");
    report.census.nameEffects();
    report.census.absent.resize(1);
    report.census.triangles = 12;
    report.kernel = {"avx2", "opaque", EffectSet(Effect::kReflection)};
    report.builds.accel.bindings = 1;
    report.memory.imageCount = 2;
    report.workers = 3;
    report.trace.paths = 100;
    report.seconds = {{"commit", 0.25}, {"sampling", 2.0}};
    report.written = {"a.exr", "b.exr"};
    report.warnings = 2;
    CHECK(report.totalSeconds() == 2.25);
    CHECK(
        report.json() ==
        R"({"version":"1.0","stage":"a \"b\".usda","frame":-3,"samplesPerPixel":8,)"
        R"("interrupted":false,"sampling":{"fewest":0,"mean":0,"most":0,"stopped":"samples",)"
        R"("forecasts":[]},"settings":{"mbfeat:robust":{"value":true,"source":"default"},)"
        R"("mbfeat:seed":{"value":9,"source":"environment"},)"
        R"("mbfeat:pixelFilterWidth":{"value":1.5,"source":"prim"},)"
        R"("mbfeat:pixelFilter":{"value":"box","source":"command line"}},)"
        R"("effects":{"present":["textures"],"absent":["reflection"],)"
        R"("askedBy":{"textures":{"count":2,"first":["/World/Wood","/World/Cloth"]}}},)"
        R"("scene":{"triangles":12,"instances":0,"lights":0,"textureBytes":0},)"
        R"("trace":{"paths":100,"rays":0,"shadowRays":0,"nonFinite":0},)"
        R"("kernel":{"instructions":"avx2","prebuilt":"opaque","branches":1,)"
        R"("handled":["reflection"]},"branches":[],)"
        R"("builds":{"meshes":0,"placements":0,"topBvh":0,"lightBvh":0,"materialBindings":1,"lightTables":0,)"
        R"("imagesLoaded":0},)"
        R"("memory":{"workers":3,"pathStateBytesEach":0,"recordBytesEach":0,"filmBytes":0,)"
        R"("filmAovs":0,"images":2,"imageBytes":0,"primvars":0,"primvarBytes":0,)"
        R"("normalBytes":0,"emitterBytes":0,"lightsInBvh":0},)"
        R"("seconds":[{"phase":"commit","seconds":0.25},{"phase":"sampling","seconds":2}],)"
        R"("totalSeconds":2.25,"samplingCpuSeconds":0,"written":["a.exr","b.exr"],"errors":[],"warnings":2})");
}

TEST_CASE("header attributes carry every setting and where it came from") {
    RenderReport report;
    report.version = "1.0";
    report.settings = {{"mbfeat:seed", std::int64_t{9}, SettingSource::kHost},
                       {"mbfeat:robust", false, SettingSource::kPrim}};
    report.interrupted = true;
    report.branches = {2, 1};
    const auto attributes = report.headerAttributes();
    const auto value = [&](const std::string& name) {
        for (const auto& [key, text] : attributes) {
            if (key == name) {
                return text;
            }
        }
        return std::string("(missing)");
    };
    CHECK(value("mbfeat:version") == "1.0");
    CHECK(value("mbfeat:seed") == "9");
    CHECK(value("mbfeat:setting:seed") == "9 (host)");
    CHECK(value("mbfeat:setting:robust") == "false (prim)");
    CHECK(value("mbfeat:effects") == "none");
    CHECK(value("mbfeat:branches") == "2, 1");
    CHECK(value("mbfeat:interrupted") != "(missing)");
    CHECK(value("mbfeat:stage") == "(missing)");
}
