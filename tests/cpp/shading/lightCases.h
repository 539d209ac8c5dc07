// Lights and receivers for the tests of the choice between lights.
#pragma once

#include <cmath>
#include <vector>

#include "core/frame.h"
#include "core/warp.h"
#include "shading/lightChoice.h"
#include "support/check.h"

namespace mbfeat::test {

inline Float3 uniformDirection(TestRandom& random) {
    return uniformSphere(random.nextFloat2());
}

inline Float3 uniformPoint(TestRandom& random, float size) {
    const float x = random.nextFloat(), y = random.nextFloat(), z = random.nextFloat();
    return Float3(x, y, z) * size;
}

/// An equilateral triangle of that circumradius whose front looks along n.
inline EmissiveTriangle triangleLight(const Float3& center, const Float3& n, float radius,
                                      float radiance, bool doubleSided) {
    const auto frame = Frame<float>::fromNormal(n);
    EmissiveTriangle t;
    t.p0 = center + frame.toWorld({radius, 0.0F, 0.0F});
    t.p1 = center + frame.toWorld({-0.5F * radius, 0.8660254F * radius, 0.0F});
    t.p2 = center + frame.toWorld({-0.5F * radius, -0.8660254F * radius, 0.0F});
    t.radiance = Rgb(radiance);
    t.doubleSided = doubleSided;
    return t;
}

/// Triangles of random place, direction, size and radiance in a cube; every other has two sides.
inline std::vector<EmissiveTriangle> scatteredTriangles(int count, float size, TestRandom& random) {
    std::vector<EmissiveTriangle> out;
    for (int i = 0; i < count; ++i) {
        const Float3 center = uniformPoint(random, size), n = uniformDirection(random);
        const float radius =
            0.1F * size * random.nextFloat() / std::cbrt(static_cast<float>(count));
        const float radiance = 0.1F + 10.0F * std::pow(random.nextFloat(), 4.0F);
        out.push_back(triangleLight(center, n, radius, radiance, i % 2 == 0));
        out.back().userId = static_cast<std::uint32_t>(i);
    }
    return out;
}

inline std::vector<LightBounds> boundsOfAll(const std::vector<EmissiveTriangle>& triangles) {
    std::vector<LightBounds> out;
    for (const EmissiveTriangle& t : triangles) {
        out.push_back(boundsOf(t));
    }
    return out;
}

/// A point in the cube or up to its size outside, one-sided or two-sided.
inline LightReceiver randomReceiver(float size, TestRandom& random) {
    LightReceiver r;
    r.p = uniformPoint(random, 3.0F * size) - Float3(size);
    r.n = uniformDirection(random);
    r.twoSided = random.nextFloat() < 0.5F;
    return r;
}

/// Irradiance from the point with the given weights on a triangle, shadows left out.
inline double irradianceFrom(const EmissiveTriangle& t, const LightReceiver& r, float b1,
                             float b2) {
    const Double3 e1 = Double3(t.p1) - Double3(t.p0), e2 = Double3(t.p2) - Double3(t.p0);
    const Double3 n = cross(e1, e2) * 0.5; // times the area
    const Double3 d =
        Double3(t.p0) + e1 * static_cast<double>(b1) + e2 * static_cast<double>(b2) - Double3(r.p);
    const double d2 = dot(d, d);
    const double out = t.doubleSided ? std::abs(dot(d, n)) : -dot(d, n);
    const double in = r.twoSided ? std::abs(dot(d, Double3(r.n))) : dot(d, Double3(r.n));
    return out > 0.0 && in > 0.0 ? static_cast<double>(t.radiance.x) * out * in / (d2 * d2) : 0.0;
}

/// Sum over entries of the probability of the choice; 0 where nothing can arrive.
inline double sumOfProbabilities(const LightChoice& choice, std::size_t entries,
                                 const LightReceiver& receiver) {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < entries; ++i) {
        sum += static_cast<double>(choice.probability(i, receiver));
    }
    return sum;
}

/// The sum is one to rounding, or zero and then nothing is sampled.
inline void checkSum(const LightChoice& choice, std::size_t entries,
                     const LightReceiver& receiver) {
    const double sum = sumOfProbabilities(choice, entries, receiver);
    if (choice.sample(receiver, 0.5F).probability > 0.0F) {
        CHECK(isNear(sum, 1.0, 1e-5));
    } else {
        CHECK(sum == 0.0);
    }
}

/// How often each entry is picked, against its probability; and that both tell the same number.
/// Passed where there is nothing to choose between.
inline ChiSquaredResult pickTest(const LightChoice& choice, std::size_t entries,
                                 const LightReceiver& receiver, int samples, std::uint64_t seed) {
    std::vector<double> observed(entries, 0.0), expected;
    TestRandom random(seed);
    bool same = true;
    for (int i = 0; i < samples; ++i) {
        const LightChoice::Pick pick = choice.sample(receiver, random.nextFloat());
        same = same && (pick.probability == 0.0F ||
                        pick.probability == choice.probability(pick.entry, receiver));
        observed[pick.entry] += pick.probability > 0.0F ? 1.0 : 0.0;
    }
    CHECK(same);
    int usable = 0;
    for (std::uint32_t i = 0; i < entries; ++i) {
        expected.push_back(static_cast<double>(choice.probability(i, receiver)) * samples);
        usable += expected.back() > 5.0 ? 1 : 0;
        if (expected.back() == 0.0) {
            CHECK(observed[i] == 0.0);
        }
    }
    ChiSquaredResult nothingToChoose;
    nothingToChoose.passed = true;
    return usable > 1 ? chiSquaredTest(observed, expected) : nothingToChoose;
}

} // namespace mbfeat::test
