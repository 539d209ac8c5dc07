#include "core/warp.h"

#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

using Batch = xsimd::batch<float>;
constexpr int kWidth = LaneTraits<Batch>::kWidth;

/// Largest difference of a warp to three numbers between lane types, over random points.
template <class Warp>
void checkLaneTypes(Warp&& warp, double tolerance) {
    TestRandom random(5);
    for (int i = 0; i < 2000; ++i) {
        float ux[kWidth], uy[kWidth], out[3][kWidth];
        for (int lane = 0; lane < kWidth; ++lane) {
            ux[lane] = i == 0 && lane < 2 ? 0.5F * static_cast<float>(lane) : random.nextFloat();
            uy[lane] = i == 0 && lane < 2 ? 0.5F * static_cast<float>(lane) : random.nextFloat();
        }
        const Vec3<Batch> batch =
            warp(Vec2<Batch>(Batch::load_unaligned(ux), Batch::load_unaligned(uy)));
        batch.x.store_unaligned(out[0]);
        batch.y.store_unaligned(out[1]);
        batch.z.store_unaligned(out[2]);
        for (int lane = 0; lane < kWidth; ++lane) {
            const Float3 single = warp(Float2(ux[lane], uy[lane]));
            const Double3 exact = warp(Vec2<double>(ux[lane], uy[lane]));
            for (int axis = 0; axis < 3; ++axis) {
                REQUIRE(std::abs(single[axis] - exact[axis]) <= tolerance);
                REQUIRE(std::abs(static_cast<double>(out[axis][lane]) - exact[axis]) <= tolerance);
            }
        }
    }
}

} // namespace

TEST_CASE("concentric disk is uniform") {
    // Polar bins of equal area: radius squared and angle.
    checkPassed(chiSquaredPlane(
        {0.0, 1.0, -static_cast<double>(kPi), static_cast<double>(kPi), 30, 30},
        [](TestRandom& random) -> std::optional<Vec2<double>> {
            const Float2 p = concentricDisk(random.nextFloat2());
            return Vec2<double>(p.x * p.x + p.y * p.y, std::atan2(p.y, p.x));
        },
        // dA = r dr dphi = d(r^2) dphi / 2.
        [](double, double) { return 0.5 * concentricDiskPdf<double>(); }));
    const Float2 centre = concentricDisk(Float2(0.5F, 0.5F));
    CHECK(centre.x == 0.0F);
    CHECK(centre.y == 0.0F);
}

TEST_CASE("directions follow the pdf of their warp") {
    checkPassed(chiSquaredSphere(
        [](TestRandom& r) { return std::optional<Float3>(cosineHemisphere(r.nextFloat2())); },
        [](const Float3& d) { return cosineHemispherePdf<double>(d.z); }));
    checkPassed(chiSquaredSphere(
        [](TestRandom& r) { return std::optional<Float3>(uniformSphere(r.nextFloat2())); },
        [](const Float3&) { return uniformSpherePdf<double>(); }));
    for (const float h : {1e-6F, 0.01F, 0.7F, 1.0F, 1.9F}) {
        INFO("1 - cos of the cone: " << h);
        checkPassed(chiSquaredCap(
            [h](TestRandom& r) { return std::optional<Float3>(uniformCone(r.nextFloat2(), h)); },
            [h](const Float3&) { return uniformConePdf<double>(h); }, {0.0F, 0.0F, 1.0F},
            1.0 - static_cast<double>(h)));
    }
}

TEST_CASE("pdfs of directions integrate to one") {
    CHECK(isNear(integrateSphere([](const Float3& d) { return cosineHemispherePdf<double>(d.z); }),
                 1.0, 1e-4));
    CHECK(isNear(integrateSphere([](const Float3&) { return uniformSpherePdf<double>(); }), 1.0,
                 1e-6));
    const double cone = integrateSphere(
        [](const Float3& d) { return d.z >= 0.5F ? uniformConePdf<double>(0.5) : 0.0; });
    CHECK(isNear(cone, 1.0, 1e-4));
}

TEST_CASE("triangle weights are uniform over the triangle") {
    // In the unit right triangle the weights are Cartesian coordinates, of density 2.
    checkPassed(chiSquaredPlane(
        {0.0, 1.0, 0.0, 1.0, 32, 32},
        [](TestRandom& random) -> std::optional<Vec2<double>> {
            const Float2 b = uniformTriangle(random.nextFloat2());
            return Vec2<double>(b.x, b.y);
        },
        [](double x, double y) { return x + y <= 1.0 ? uniformTrianglePdf(0.5) : 0.0; }));
}

TEST_CASE("sampled directions are unit vectors and triangle weights are weights") {
    TestRandom random(8);
    for (int i = 0; i < 10000; ++i) {
        const Float2 u = random.nextFloat2();
        CHECK(std::abs(length(cosineHemisphere(u)) - 1.0F) < 3e-7F);
        CHECK(std::abs(length(uniformSphere(u)) - 1.0F) < 5e-7F);
        CHECK(std::abs(length(uniformCone(u, 0.3F)) - 1.0F) < 5e-7F);
        const Float2 b = uniformTriangle(u);
        CHECK((b.x >= 0.0F && b.y >= 0.0F && b.x + b.y <= 1.0F));
    }
}

TEST_CASE("warps agree between float, double and SIMD lanes") {
    // Budget: a few roundings of values up to one, and the single-precision constants.
    checkLaneTypes(
        [](auto u) {
            const auto d = concentricDisk(u);
            return Vec3<decltype(d.x)>(d.x, d.y, decltype(d.x)(0.0F));
        },
        3e-7);
    checkLaneTypes([](auto u) { return uniformSphere(u); }, 1e-6);
    checkLaneTypes([](auto u) { return uniformCone(u, decltype(u.x)(0.25F)); }, 1e-6);
    checkLaneTypes(
        [](auto u) {
            const auto b = uniformTriangle(u);
            return Vec3<decltype(b.x)>(b.x, b.y, decltype(b.x)(0.0F));
        },
        1e-7);
    // The root at the rim of the disc turns an error e into sqrt(2 e).
    checkLaneTypes([](auto u) { return cosineHemisphere(u); }, 1e-3);
}
