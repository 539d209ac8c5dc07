// Colour spaces and displays against values worked out by hand or published.
#include "scene/colorManagement.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "film/temporaryDirectory.h"
#include "scene/imageFiles.h"

using namespace mbfeat;

namespace {

/// Sets an environment variable while it lives.
class ScopedEnvironment {
public:
    ScopedEnvironment(const char* name, const std::string& value) : name_(name) {
        if (const char* old = std::getenv(name)) {
            had_ = true;
            old_ = old;
        }
        setenv(name, value.c_str(), 1);
    }
    ~ScopedEnvironment() {
        if (had_) {
            setenv(name_, old_.c_str(), 1);
        } else {
            unsetenv(name_);
        }
    }
    ScopedEnvironment(const ScopedEnvironment&) = delete;
    ScopedEnvironment& operator=(const ScopedEnvironment&) = delete;

private:
    const char* name_;
    std::string old_;
    bool had_ = false;
};

void checkConverts(const ColorConfig& config, const char* from, const char* to,
                   const float (&in)[3], const double (&expected)[3], double tolerance) {
    CAPTURE(from);
    CAPTURE(to);
    const auto transform = config.transform(from, to);
    REQUIRE_MESSAGE(transform, (transform ? "" : transform.error().text));
    float rgba[8] = {in[0], in[1], in[2], 0.5F, in[0], in[1], in[2], 0.25F};
    transform.value()->apply(rgba, 2, 4);
    for (int c = 0; c < 3; ++c) {
        CHECK(static_cast<double>(rgba[c]) == doctest::Approx(expected[c]).epsilon(tolerance));
        CHECK(rgba[c + 4] == rgba[c]);
    }
    CHECK(rgba[3] == 0.5F);
    CHECK(rgba[7] == 0.25F);
}

// A config of another maker: names of its own, no built-in transforms, profile version 1.
constexpr const char* kForeignConfig = R"(ocio_profile_version: 1
search_path: luts
strictparsing: true
roles:
  default: plain
  scene_linear: plain
displays:
  monitor:
    - !<View> {name: film, colorspace: doubled}
    - !<View> {name: flat, colorspace: plain}
active_displays: []
active_views: []
colorspaces:
  - !<ColorSpace>
    name: plain
    isdata: false
    allocation: uniform
  - !<ColorSpace>
    name: doubled
    isdata: false
    allocation: uniform
    from_reference: !<MatrixTransform> {matrix: [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]}
)";

} // namespace

TEST_CASE("the sRGB curve and its inverse") {
    CHECK(decodeSrgb(0.0) == 0.0);
    CHECK(decodeSrgb(1.0) == doctest::Approx(1.0).epsilon(1e-15));
    CHECK(decodeSrgb(0.04) == doctest::Approx(0.04 / 12.92).epsilon(1e-15));
    CHECK(decodeSrgb(0.5) == doctest::Approx(0.21404114048223255).epsilon(1e-12));
    CHECK(encodeSrgb(0.18) == doctest::Approx(0.46135612950044164).epsilon(1e-12));
    for (double x = -2.0; x <= 4.0; x += 0.01) {
        CHECK(decodeSrgb(encodeSrgb(x)) == doctest::Approx(x).epsilon(1e-6));
    }
    float values[] = {0.5F, 0.5F, 0.5F, 0.5F};
    decodeSrgb(values, 1, 4);
    CHECK(values[2] == doctest::Approx(0.214041F).epsilon(1e-5));
    CHECK(values[3] == 0.5F);
    float pair[] = {0.5F, 0.5F};
    encodeSrgb(pair, 1, 2);
    CHECK(pair[0] == doctest::Approx(0.735357F).epsilon(1e-5));
    CHECK(pair[1] == 0.5F);
}

TEST_CASE("names of well-known spaces") {
    for (const char* name : {"", "lin_rec709", "LIN_REC709", "lin_rec709_scene", "lin_srgb",
                             "Linear Rec.709 (sRGB)"}) {
        CHECK(wellKnownSpace(name) == WellKnownSpace::kLinearRec709);
    }
    for (const char* name : {"sRGB", "srgb_texture", "srgb_rec709_scene", "sRGB - Texture"}) {
        CHECK(wellKnownSpace(name) == WellKnownSpace::kSrgb);
    }
    for (const char* name : {"raw", "Raw", "data", "identity"}) {
        CHECK(wellKnownSpace(name) == WellKnownSpace::kRaw);
    }
    for (const char* name : {"ACEScg", "acescg", "no such space"}) {
        CHECK(wellKnownSpace(name) == WellKnownSpace::kOther);
    }
}

TEST_CASE("ACEScg to linear Rec.709 is the matrix of the ACES transforms") {
    // AP1 with the ACES white to Rec.709 with D65 by Bradford adaptation, as published with ACES.
    const auto config = ColorConfig::builtIn();
    for (const char* name : {"ACEScg", "acescg", "lin_ap1", "lin_ap1_scene"}) {
        checkConverts(*config, name, "", {1, 0, 0}, {1.70505099, -0.13025642, -0.02400336}, 1e-5);
        checkConverts(*config, name, "", {0, 1, 0}, {-0.62179212, 1.14080474, -0.12896898}, 1e-5);
        checkConverts(*config, name, "lin_rec709", {0, 0, 1},
                      {-0.08325887, -0.01054832, 1.15297234}, 1e-5);
    }
    checkConverts(*config, "", "ACEScg", {1, 1, 1}, {1, 1, 1}, 1e-5);
}

TEST_CASE("spaces built from primaries agree with their published matrices") {
    const auto config = ColorConfig::builtIn();
    // ITU-R BT.2087: BT.709 to BT.2020.
    checkConverts(*config, "", "Linear Rec.2020", {1, 0, 0}, {0.6274039, 0.0690973, 0.0163914},
                  1e-5);
    checkConverts(*config, "", "lin_rec2020_scene", {0, 0, 1}, {0.0433131, 0.0113623, 0.8955953},
                  1e-5);
    // White stays white between spaces of different white points (Bradford adaptation).
    for (const char* name : {"ACES2065-1", "ACEScg", "lin_rec2020", "lin_p3d65", "lin_adobergb",
                             "srgb_texture", "g22_rec709", "srgb_displayp3", "g22_ap1_scene"}) {
        checkConverts(*config, name, "", {1, 1, 1}, {1, 1, 1}, 3e-5);
    }
    // Curves.
    checkConverts(*config, "srgb_tx", "", {0.5F, 0.5F, 0.5F}, {0.2140411, 0.2140411, 0.2140411},
                  1e-4);
    checkConverts(*config, "g22_rec709_scene", "", {0.5F, 0.5F, 0.5F},
                  {0.2176376, 0.2176376, 0.2176376}, 1e-4);
    // IEC 61966-2-1: XYZ of linear red.
    checkConverts(*config, "", "lin_ciexyzd65_scene", {1, 0, 0}, {0.4123908, 0.2126390, 0.0193308},
                  1e-4);
}

TEST_CASE("chromaticities of files are recognised") {
    CHECK(ColorConfig::spaceOfChromaticities(
              {0.713F, 0.293F, 0.165F, 0.83F, 0.128F, 0.044F, 0.32168F, 0.33767F}) == "lin_ap1");
    CHECK(ColorConfig::spaceOfChromaticities(
              {0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.3127F, 0.329F}) == "lin_rec709");
    CHECK(ColorConfig::spaceOfChromaticities({0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.35F, 0.36F})
              .empty());
}

TEST_CASE("unknown spaces are errors that list what there is") {
    const auto transform = ColorConfig::builtIn()->transform("", "Kodak Dream");
    REQUIRE_FALSE(transform);
    CHECK(transform.error().subject == "Kodak Dream");
    CHECK(transform.error().text.find("'ACEScg'") != std::string::npos);
}

TEST_CASE("displays and views of the built-in config") {
    const auto config = ColorConfig::builtIn();
    CHECK(config->source() == "built-in ACES");
    CHECK(config->defaultDisplay() == "sRGB - Display");
    CHECK(config->defaultView("sRGB - Display") == "ACES 1.0 - SDR Video");
    const auto plain = config->displayTransform("", "sRGB - Display", "Un-tone-mapped");
    REQUIRE(plain);
    float grey[] = {0.18F, 0.5F, 0.02F, 1.0F};
    plain.value()->apply(grey, 1, 4);
    CHECK(grey[0] == doctest::Approx(encodeSrgb(0.18)).epsilon(1e-3));
    CHECK(grey[1] == doctest::Approx(encodeSrgb(0.5)).epsilon(1e-3));
    CHECK(grey[2] == doctest::Approx(encodeSrgb(0.02)).epsilon(1e-3));
    const auto film = config->displayTransform("", "", "");
    REQUIRE(film);
    float scene[] = {0.18F, 0.18F, 0.18F, 100.0F, 100.0F, 100.0F};
    film.value()->apply(scene, 2, 3);
    // ACES 1.0 SDR video shows middle grey at about 10 nits of 100.
    CHECK(decodeSrgb(static_cast<double>(scene[0])) == doctest::Approx(0.10).epsilon(0.05));
    // ... and highlights at display white, while 100 untone-mapped would be far above it.
    CHECK(scene[3] == doctest::Approx(1.0).epsilon(0.05));
    CHECK_FALSE(config->displayTransform("", "Cinema 9", ""));
    CHECK_FALSE(config->displayTransform("", "", "Sepia"));
    CHECK_FALSE(config->displayTransform("no space", "", ""));
}

TEST_CASE("the config comes from OCIO, and a bad one is reported and passed over") {
    const TemporaryDirectory folder;
    writeText(folder.file("foreign.ocio"), kForeignConfig);
    writeText(folder.file("broken.ocio"), "ocio_profile_version: 2\ncolorspaces: [\n");
    const ScopedEnvironment noConfig("MBFEAT_OCIO_CONFIG", "");
    const ScopedEnvironment noFolder("MBFEAT_OCIO_DIR", folder.path().string());
    {
        Diagnostics diagnostics;
        const ScopedEnvironment ocio("OCIO", folder.file("foreign.ocio"));
        const auto config = ColorConfig::fromEnvironment(diagnostics);
        CHECK(config->source() == folder.file("foreign.ocio"));
        CHECK(diagnostics.messages().empty());
        CHECK(config->displays() == std::vector<std::string>{"monitor"});
        checkConverts(*config, "plain", "doubled", {1, 2, 3}, {2, 4, 6}, 1e-6);
        const auto shown = config->displayTransform("scene_linear", "monitor", "film");
        REQUIRE(shown);
        float rgb[] = {1, 2, 3};
        shown.value()->apply(rgb, 1, 3);
        CHECK(rgb[2] == 6.0F);
        // Spaces that it lacks are still known.
        checkConverts(*config, "ACEScg", "lin_rec709", {1, 0, 0},
                      {1.70505099, -0.13025642, -0.02400336}, 1e-5);
        // Nothing says how its spaces relate to others: an error, no guess.
        CHECK_FALSE(config->transform("ACEScg", "doubled"));
    }
    for (const std::string& bad : {folder.file("broken.ocio"), folder.file("missing.ocio"),
                                   std::string("ocio://nonsense")}) {
        Diagnostics diagnostics;
        const ScopedEnvironment ocio("OCIO", bad);
        const auto config = ColorConfig::fromEnvironment(diagnostics);
        REQUIRE(diagnostics.messages().size() == 1);
        CHECK(diagnostics.messages()[0].subject == "OCIO");
        CHECK(diagnostics.messages()[0].text.find(bad) != std::string::npos);
        CHECK(config->transform("ACEScg", ""));
    }
    {
        Diagnostics diagnostics;
        const ScopedEnvironment none("OCIO", "");
        const ScopedEnvironment own("MBFEAT_OCIO_CONFIG", folder.file("foreign.ocio"));
        CHECK(ColorConfig::fromEnvironment(diagnostics)->source() == folder.file("foreign.ocio"));
    }
}

TEST_CASE("configs are found by name in the folder of configs") {
    const TemporaryDirectory folder;
    writeText(folder.file("house.ocio"), kForeignConfig);
    const ScopedEnvironment directory("MBFEAT_OCIO_DIR", folder.path().string());
    const auto config = ColorConfig::open("ocio://house");
    REQUIRE(config);
    CHECK(config.value()->source() == folder.file("house.ocio"));
}
