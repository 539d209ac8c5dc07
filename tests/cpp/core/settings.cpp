#include "core/settings.h"

#include <cstdlib>

#include <doctest/doctest.h>

#include "core/editDistance.h"

using namespace mbfeat;

namespace {

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

/// Sets an environment variable for the length of a test.
class EnvironmentVariable {
public:
    EnvironmentVariable(std::string name, const char* value) : name_(std::move(name)) {
        setenv(name_.c_str(), value, 1);
    }
    ~EnvironmentVariable() { unsetenv(name_.c_str()); }
    EnvironmentVariable(const EnvironmentVariable&) = delete;
    EnvironmentVariable& operator=(const EnvironmentVariable&) = delete;

private:
    std::string name_;
};

} // namespace

TEST_CASE("edit distance counts inserts, deletions, replacements and swaps, not case") {
    CHECK(editDistance("", "") == 0);
    CHECK(editDistance("", "abc") == 3);
    CHECK(editDistance("abc", "") == 3);
    CHECK(editDistance("seed", "SEED") == 0);
    CHECK(editDistance("sede", "seed") == 1);
    CHECK(editDistance("kitten", "sitting") == 3);
    CHECK(editDistance("box", "blackmanHarris") == editDistance("blackmanHarris", "box"));
    CHECK(nearestName("gausian", {"box", "gaussian", "mitchell"}) == "gaussian");
    CHECK(nearestName("x", {}).empty());
}

TEST_CASE("each pixel filter has a width of its own until one is set") {
    Settings settings;
    const auto widthOf = [&](const char* filter) {
        REQUIRE_FALSE(
            settings.set(SettingSource::kPrim, "mbfeat:pixelFilter", std::string(filter)));
        return resolveOptions(settings).pixelFilterWidth;
    };
    CHECK(widthOf("box") == 1.0F);
    CHECK(widthOf("triangle") == 2.0F);
    CHECK(widthOf("mitchell") == 4.0F);
    CHECK(widthOf("gaussian") == 3.0F);
    REQUIRE_FALSE(settings.set(SettingSource::kPrim, "mbfeat:pixelFilterWidth", 2.5));
    CHECK(widthOf("box") == 2.5F);
    REQUIRE_FALSE(settings.set(SettingSource::kPrim, "mbfeat:pixelFilterWidth", 1e-6));
    CHECK(widthOf("box") == 1e-6F); // what is too small for a filter is for the filter to say
}

TEST_CASE("the table's defaults are the renderer's") {
    const RenderOptions defaults;
    const RenderOptions options = resolveOptions(Settings());
    CHECK(options.samplesPerPixel == defaults.samplesPerPixel);
    CHECK(options.maxBounces == defaults.maxBounces);
    CHECK(options.seed == defaults.seed);
    CHECK(options.threads == defaults.threads);
    CHECK(options.pixelFilter == defaults.pixelFilter);
    CHECK(options.pixelFilterWidth == defaults.pixelFilterWidth);
    CHECK(options.russianRouletteStart == defaults.russianRouletteStart);
    CHECK(options.clampDirect == defaults.clampDirect);
    CHECK(options.clampIndirect == defaults.clampIndirect);
    CHECK(options.robust == defaults.robust);
    CHECK(options.tileSize == defaults.tileSize);
    CHECK(options.viewAov == defaults.viewAov);
    CHECK(options.onError == defaults.onError);
    CHECK(options.pathSampleMemory == defaults.pathSampleMemory);
}

TEST_CASE("every default passes its own check, as a value and as the text it prints as") {
    for (const SettingDescriptor& descriptor : settingTable()) {
        CAPTURE(descriptor.name);
        Settings settings;
        CHECK_FALSE(settings.set(SettingSource::kHost, descriptor.name, descriptor.defaultValue));
        CHECK_FALSE(
            settings.set(SettingSource::kPrim, descriptor.name, toString(descriptor.defaultValue)));
        CHECK(settings.value(descriptor.name) == descriptor.defaultValue);
        CHECK(descriptor.name.rfind("mbfeat:", 0) == 0);
        CHECK_FALSE(descriptor.label.empty());
        CHECK_FALSE(descriptor.doc.empty());
    }
}

TEST_CASE("every token of an enumerated setting reaches its option") {
    Settings settings;
    const PixelFilter filters[] = {PixelFilter::kBox, PixelFilter::kTriangle,
                                   PixelFilter::kGaussian, PixelFilter::kBlackmanHarris,
                                   PixelFilter::kMitchell};
    const char* const names[] = {"box", "triangle", "gaussian", "blackmanHarris", "mitchell"};
    for (int i = 0; i < 5; ++i) {
        CHECK_FALSE(
            settings.set(SettingSource::kPrim, "mbfeat:pixelFilter", std::string(names[i])));
        CHECK(resolveOptions(settings).pixelFilter == filters[i]);
    }
    CHECK_FALSE(settings.set(SettingSource::kPrim, "mbfeat:onError", std::string("abort")));
    CHECK(resolveOptions(settings).onError == OnError::kAbort);
}

TEST_CASE("later sources win, whatever the order of setting, and clearing uncovers earlier ones") {
    const std::string name = "mbfeat:samplesPerPixel";
    Settings settings;
    CHECK(settings.source(name) == SettingSource::kDefault);
    CHECK_FALSE(settings.set(SettingSource::kCommandLine, name, std::int64_t{5}));
    CHECK_FALSE(settings.set(SettingSource::kHost, name, std::int64_t{2}));
    CHECK_FALSE(settings.set(SettingSource::kEnvironment, name, std::int64_t{4}));
    CHECK_FALSE(settings.set(SettingSource::kPrim, name, std::int64_t{3}));
    for (const auto& [source, expected] : {std::pair{SettingSource::kCommandLine, 5},
                                           {SettingSource::kEnvironment, 4},
                                           {SettingSource::kPrim, 3},
                                           {SettingSource::kHost, 2}}) {
        CHECK(settings.source(name) == source);
        CHECK(settings.value(name) == SettingValue(std::int64_t{expected}));
        CHECK(resolveOptions(settings).samplesPerPixel == expected);
        settings.clear(source);
    }
    CHECK(settings.source(name) == SettingSource::kDefault);
    CHECK(settings.value(name) == SettingValue(std::int64_t{64}));
}

TEST_CASE("values are converted where nothing is lost") {
    Settings settings;
    const auto set = [&](const char* name, const SettingValue& value) {
        return settings.set(SettingSource::kPrim, name, value);
    };
    CHECK_FALSE(set("mbfeat:samplesPerPixel", 128.0));
    CHECK(settings.value("mbfeat:samplesPerPixel") == SettingValue(std::int64_t{128}));
    CHECK_FALSE(set("mbfeat:samplesPerPixel", std::string(" 1e3 ")));
    CHECK(settings.value("mbfeat:samplesPerPixel") == SettingValue(std::int64_t{1000}));
    CHECK_FALSE(set("mbfeat:samplesPerPixel", std::string("+7")));
    CHECK(settings.value("mbfeat:samplesPerPixel") == SettingValue(std::int64_t{7}));
    CHECK_FALSE(set("mbfeat:clampDirect", std::int64_t{10}));
    CHECK(settings.value("mbfeat:clampDirect") == SettingValue(10.0));
    CHECK_FALSE(set("mbfeat:robust", std::string("Off")));
    CHECK(settings.value("mbfeat:robust") == SettingValue(false));
    CHECK_FALSE(set("mbfeat:robust", std::int64_t{1}));
    CHECK(settings.value("mbfeat:robust") == SettingValue(true));
    CHECK(set("mbfeat:samplesPerPixel", 1.5));
    CHECK(set("mbfeat:samplesPerPixel", true));
    CHECK(set("mbfeat:robust", std::int64_t{2}));
    CHECK(set("mbfeat:viewAov", std::int64_t{2}));
}

TEST_CASE("bad values change nothing and say what would be right") {
    Settings settings;
    for (const char* const bad : {"0", "-3", "1048577", "many", "", "nan", "inf", "1e400", "+-4",
                                  "12abc", "9223372036854775808"}) {
        CAPTURE(bad);
        const Status status =
            settings.set(SettingSource::kCommandLine, "mbfeat:samplesPerPixel", std::string(bad));
        REQUIRE(status);
        CHECK(status->subject == "mbfeat:samplesPerPixel");
        CHECK(contains(status->text, "an integer from 1 to 1048576"));
        CHECK(contains(status->text, "command line"));
        CHECK(settings.source("mbfeat:samplesPerPixel") == SettingSource::kDefault);
    }
    const Status filter =
        settings.set(SettingSource::kPrim, "mbfeat:pixelFilter", std::string("gausian"));
    REQUIRE(filter);
    CHECK(contains(filter->text, "nearest is \"gaussian\""));
    const Status width =
        settings.set(SettingSource::kPrim, "mbfeat:pixelFilterWidth", std::string("nan"));
    REQUIRE(width);
    CHECK(contains(width->text, "from 0 to 16"));
}

TEST_CASE("an unknown name is answered with the nearest") {
    Settings settings;
    const Status status =
        settings.set(SettingSource::kPrim, "mbfeat:samplePerPixels", std::int64_t{8});
    REQUIRE(status);
    CHECK(status->subject == "mbfeat:samplePerPixels");
    CHECK(contains(status->text, "\"mbfeat:samplesPerPixel\""));
    const Status bare = settings.set(SettingSource::kPrim, "maxBounce", std::int64_t{8});
    REQUIRE(bare);
    CHECK(contains(bare->text, "\"mbfeat:maxBounces\""));
    CHECK(settings.resolved().size() == settingTable().size());
}

TEST_CASE("the environment is read anew each time, and its mistakes name the variable") {
    CHECK(settingEnvironmentName("mbfeat:samplesPerPixel") == "MBFEAT_SAMPLES_PER_PIXEL");
    CHECK(settingEnvironmentName("mbfeat:seed") == "MBFEAT_SEED");
    CHECK(settingEnvironmentName("mbfeat:denoise:tile") == "MBFEAT_DENOISE_TILE");
    Settings settings;
    {
        const EnvironmentVariable good("MBFEAT_SAMPLES_PER_PIXEL", "12");
        const EnvironmentVariable bad("MBFEAT_SEED", "twelve");
        const EnvironmentVariable unknown("MBFEAT_MAX_BOUNCE", "3");
        const EnvironmentVariable place("MBFEAT_OCIO_DIR", "somewhere");
        const std::vector<Error> errors = settings.readEnvironment();
        REQUIRE(errors.size() == 2);
        CHECK(errors[0].subject == "MBFEAT_MAX_BOUNCE");
        CHECK(contains(errors[0].text, "MBFEAT_MAX_BOUNCES"));
        CHECK(errors[1].subject == "MBFEAT_SEED");
        CHECK(contains(errors[1].text, "\"twelve\""));
        CHECK(settings.source("mbfeat:samplesPerPixel") == SettingSource::kEnvironment);
        CHECK(resolveOptions(settings).samplesPerPixel == 12);
    }
    CHECK(settings.readEnvironment().empty());
    CHECK(settings.source("mbfeat:samplesPerPixel") == SettingSource::kDefault);
}

TEST_CASE("values print as they can be given back") {
    CHECK(toString(SettingValue(true)) == "true");
    CHECK(toString(SettingValue(std::int64_t{-5})) == "-5");
    CHECK(toString(SettingValue(0.1)) == "0.1");
    CHECK(toString(SettingValue(3.0)) == "3");
    CHECK(toString(SettingValue(std::string("box"))) == "box");
}
