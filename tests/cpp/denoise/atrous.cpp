// A pass of the à-trous filter against its definition in double, on all lanes and for any area.
#include "denoise/atrous.h"

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "core/parallel.h"

using namespace mbfeat;

namespace {

/// A pass over random planes; logits up to a few hundred where `strength` is 100.
struct Example {
    static constexpr int kLights = 4, kLearned = 2, kAlike = kLearned + guides::kCount;
    int width, height;
    std::vector<float> light, alike, scales, centre, spatial;
    ATrousPass pass;

    Example(int w, int h, int dilation, float strength) : width(w), height(h) {
        std::mt19937 random(static_cast<unsigned>(17 * w + h));
        std::normal_distribution<float> normal;
        const auto planes = [&](int count, float scale) {
            std::vector<float> values(static_cast<std::size_t>(count) * pixels());
            for (float& value : values) {
                value = scale * normal(random);
            }
            return values;
        };
        light = planes(kLights, 1.0F);
        alike = planes(kAlike, std::sqrt(strength));
        scales = planes(guides::groups(guides::kCount), 1.0F);
        centre = planes(1, strength);
        for (int tap = 0; tap < atrous::kTaps; ++tap) {
            spatial.push_back(strength * normal(random));
        }
        pass.width = w;
        pass.height = h;
        pass.lights = kLights;
        pass.alikeChannels = kAlike;
        pass.dilation = dilation;
        pass.light = light.data();
        pass.alike = alike.data();
        pass.guides = guides::kCount;
        pass.scales = scales.data();
        pass.centre = centre.data();
        pass.spatial = spatial.data();
        pass.sharpness = 0.7F;
    }

    std::size_t pixels() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
    std::size_t place(int plane, int y, int x) const {
        return static_cast<std::size_t>(plane) * pixels() +
               static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    }

    /// By the definition.
    double expected(int plane, int y, int x) const {
        std::vector<double> logits, values;
        for (int tap = 0; tap < atrous::kTaps; ++tap) {
            const int row = y + pass.dilation * (tap / atrous::kSide - atrous::kRadius);
            const int column = x + pass.dilation * (tap % atrous::kSide - atrous::kRadius);
            if (row < 0 || row >= height || column < 0 || column >= width) {
                continue;
            }
            double logit = spatial[static_cast<std::size_t>(tap)];
            if (tap == atrous::kMiddle) {
                logit += centre[place(0, y, x)];
            } else {
                for (int c = 0; c < kAlike; ++c) {
                    double change = static_cast<double>(alike[place(c, y, x)]) -
                                    static_cast<double>(alike[place(c, row, column)]);
                    if (c >= kLearned) {
                        change *= scales[place(guides::group(c - kLearned), y, x)];
                    }
                    logit -= static_cast<double>(pass.sharpness) * change * change;
                }
            }
            logits.push_back(logit);
            values.push_back(light[place(plane, row, column)]);
        }
        double largest = logits.front(), total = 0.0, sum = 0.0;
        for (const double logit : logits) {
            largest = std::max(largest, logit);
        }
        for (std::size_t i = 0; i < logits.size(); ++i) {
            const double weight = std::exp(logits[i] - largest);
            total += weight;
            sum += weight * values[i];
        }
        return sum / total;
    }

    std::vector<float> run(const SplatTile& area, SplatLanes lanes, int threads) {
        std::vector<float> out(static_cast<std::size_t>(kLights) * pixels(), -7.0F);
        pass.out = out.data();
        ThreadPool pool(threads);
        CHECK(filter(pass, area, pool, nullptr, lanes));
        return out;
    }
};

} // namespace

TEST_CASE("a pass of the à-trous filter is its definition") {
    struct Case {
        int width, height, dilation;
        float strength;
    };
    for (const Case& c : {Case{1, 1, 1, 1.0F}, Case{7, 5, 3, 1.0F}, Case{61, 13, 2, 1.0F},
                          Case{40, 40, 8, 1.0F}, Case{33, 9, 3, 100.0F}}) {
        Example example(c.width, c.height, c.dilation, c.strength);
        const SplatTile whole{0, 0, c.width, c.height};
        for (const SplatLanes lanes :
             {SplatLanes::kScalar, SplatLanes::kNarrow, SplatLanes::kWide}) {
            const std::vector<float> found = example.run(whole, lanes, 2);
            double worst = 0.0;
            for (int plane = 0; plane < Example::kLights; ++plane) {
                for (int y = 0; y < c.height; ++y) {
                    for (int x = 0; x < c.width; ++x) {
                        const double value = found[example.place(plane, y, x)];
                        worst = std::max(worst, std::abs(value - example.expected(plane, y, x)));
                    }
                }
            }
            // Logits of hundreds are rounded to some 1e-5 themselves.
            CHECK(worst < (c.strength > 1.0F ? 1e-3 : 1e-5));
        }
    }
}

TEST_CASE("a pixel of the à-trous filter depends neither on the area nor on threads") {
    Example example(50, 21, 3, 1.0F);
    const std::vector<float> whole = example.run({0, 0, 50, 21}, SplatLanes::kWide, 1);
    const SplatTile area{13, 4, 46, 19};
    const std::vector<float> part = example.run(area, SplatLanes::kWide, 2);
    for (int plane = 0; plane < Example::kLights; ++plane) {
        for (int y = 0; y < 21; ++y) {
            for (int x = 0; x < 50; ++x) {
                const bool inside = x >= area.x0 && x < area.x1 && y >= area.y0 && y < area.y1;
                const std::size_t i = example.place(plane, y, x);
                CHECK(part[i] == (inside ? whole[i] : -7.0F));
            }
        }
    }
}
