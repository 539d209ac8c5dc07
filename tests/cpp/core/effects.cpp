#include "core/effects.h"

#include <doctest/doctest.h>

#include "core/settings.h"

using namespace mbfeat;

TEST_CASE("the table of effects is in the order of the enumeration and names each once") {
    for (std::size_t i = 0; i < kEffectCount; ++i) {
        CHECK(static_cast<std::size_t>(effectTable()[i].effect) == i);
        for (std::size_t k = 0; k < i; ++k) {
            CHECK(std::string(effectTable()[i].name) != effectTable()[k].name);
        }
    }
    CHECK(effectNames(EffectSet::all()).size() == kEffectCount);
    CHECK((EffectSet::all() - EffectSet::all()).empty());
}

TEST_CASE("mbfeat:effects adds effects and takes them away") {
    const auto parsed = [](const char* text) {
        const Result<EffectRequest> request = parseEffects(text);
        REQUIRE(request);
        return request.value();
    };
    CHECK(parsed("auto") == EffectRequest());
    CHECK(parsed("") == EffectRequest());
    CHECK(parsed("full").full);
    const EffectRequest both = parsed("auto, +rough glass ,-normal maps");
    CHECK_FALSE(both.full);
    CHECK(both.forced == EffectSet(Effect::kRoughGlass));
    CHECK(both.taken == EffectSet(Effect::kNormalMaps));
}

TEST_CASE("what is wrong with mbfeat:effects is said, and the value before it stays") {
    const auto problem = [](const char* text) {
        const Result<EffectRequest> request = parseEffects(text);
        REQUIRE_FALSE(request);
        return request.error().text;
    };
    CHECK(problem("-textrues").find("\"-textures\"") != std::string::npos);
    CHECK(problem("clearcoat").find("\"+clearcoat\"") != std::string::npos);
    CHECK(problem("-instancing").find("cannot be taken away") != std::string::npos);

    Settings settings;
    REQUIRE_FALSE(settings.set(SettingSource::kHost, "mbfeat:effects", std::string("full")));
    const Status status =
        settings.set(SettingSource::kPrim, "mbfeat:effects", std::string("+metals"));
    REQUIRE(status);
    CHECK(status->subject == "mbfeat:effects");
    CHECK(status->text.find("\"+metal\"") != std::string::npos);
    CHECK(resolveOptions(settings).effects.full);
}
