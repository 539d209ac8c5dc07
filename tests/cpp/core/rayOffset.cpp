#include "core/rayOffset.h"

#include "core/warp.h"
#include "support/check.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

Float3 randomVector(TestRandom& random, float scale) {
    const float x = random.nextFloat(), y = random.nextFloat(), z = random.nextFloat();
    return Float3(x - 0.5F, y - 0.5F, z - 0.5F) * (2.0F * scale);
}

/// A triangle of some size somewhere, a point on it, and what is known of that point.
struct Hit {
    Float3 p0, p1, p2, p, error, n;
    Double3 exactNormal;

    /// Signed distance of q from the exact plane through the corners.
    double height(const Float3& q) const { return dot(Double3(q) - Double3(p0), exactNormal); }
};

Hit randomHit(TestRandom& random, int i) {
    const float offset = std::pow(10.0F, static_cast<float>(i % 8) - 2.0F);
    const float size = std::pow(10.0F, static_cast<float>(i / 8 % 5) - 2.0F);
    Hit hit;
    do {
        hit.p0 = randomVector(random, offset);
        hit.p1 = hit.p0 + randomVector(random, size);
        hit.p2 = hit.p0 + randomVector(random, size);
        // Far away, small triangles collapse to lines and points, which have no normal.
    } while (lengthSquared(cross(hit.p1 - hit.p0, hit.p2 - hit.p0)) == 0.0F);
    const Float2 b = uniformTriangle(random.nextFloat2());
    hit.p = trianglePoint(hit.p0, hit.p1, hit.p2, b.x, b.y, hit.error);
    const Double3 n = cross(Double3(hit.p1) - Double3(hit.p0), Double3(hit.p2) - Double3(hit.p0));
    hit.exactNormal = normalize(n);
    hit.n = Float3(hit.exactNormal);
    return hit;
}

} // namespace

TEST_CASE("the error bound of a point on a triangle holds") {
    TestRandom random(1);
    for (int i = 0; i < 40000; ++i) {
        const Hit hit = randomHit(random, i);
        const double bound = dot(abs(hit.exactNormal), Double3(hit.error));
        REQUIRE(std::abs(hit.height(hit.p)) <= bound);
    }
}

TEST_CASE("offset origins lie on the side that the ray goes to, and close") {
    TestRandom random(2);
    for (int i = 0; i < 40000; ++i) {
        const Hit hit = randomHit(random, i);
        const Float3 w = uniformSphere(random.nextFloat2());
        const Float3 q = offsetRayOrigin(hit.p, hit.error, hit.n, w);
        const double side = dot(w, hit.n) < 0.0F ? -1.0 : 1.0;
        REQUIRE(side * hit.height(q) > 0.0);
        // No farther than a few times what rounding can have done.
        const Float3 scale = hit.error + abs(hit.p) * 0x1p-23F;
        REQUIRE(length(q - hit.p) <= 4.0F * length(scale));
        // The normal's sign is of no consequence.
        const Float3 flipped = offsetRayOrigin(hit.p, hit.error, -hit.n, w);
        REQUIRE(flipped == q);
    }
}

TEST_CASE("points at the origin of space need next to no offset") {
    const Float3 q = offsetRayOrigin(Float3(0.0F), Float3(1e-12F), Float3(0.0F, 0.0F, 1.0F),
                                     Float3(0.6F, 0.0F, 0.8F));
    CHECK(q.z >= 1e-12F);
    CHECK(q.z < 2e-12F);
}

TEST_CASE("segments start off one surface and end before the other") {
    TestRandom random(3);
    for (int i = 0; i < 20000; ++i) {
        const Hit from = randomHit(random, i);
        const Hit to = randomHit(random, i + 3);
        const RaySegment<float> ray =
            offsetSegment(from.p, from.error, from.n, to.p, to.error, to.n);
        const Float3 towards = to.p - from.p;
        const double fromSide = dot(towards, from.n) < 0.0F ? -1.0 : 1.0;
        REQUIRE(fromSide * from.height(ray.origin) > 0.0);
        REQUIRE(std::abs(length(ray.direction) - 1.0F) < 4e-7F);
        // The end lies on the near side of the target's plane.
        const Double3 end =
            Double3(ray.origin) + Double3(ray.direction) * static_cast<double>(ray.length);
        const double toSide = dot(-towards, to.n) < 0.0F ? -1.0 : 1.0;
        REQUIRE(toSide * dot(end - Double3(to.p0), to.exactNormal) > 0.0);
    }
}

TEST_CASE("a target without normal is left where it is") {
    const RaySegment<float> ray =
        offsetSegment(Float3(0.0F), Float3(0.0F), Float3(0.0F, 0.0F, 1.0F),
                      Float3(0.0F, 0.0F, 2.0F), Float3(0.0F), Float3(0.0F));
    CHECK(ray.direction.z == 1.0F);
    CHECK(ray.length < 2.0F);
    CHECK(ray.length > 1.99999F);
}

TEST_CASE("offsets agree between float and SIMD lanes") {
    using Batch = xsimd::batch<float>;
    TestRandom random(6);
    for (int i = 0; i < 1000; ++i) {
        const Hit hit = randomHit(random, i);
        const Float3 w = uniformSphere(random.nextFloat2());
        const auto wide = [](const Float3& v) {
            return Vec3<Batch>(Batch(v.x), Batch(v.y), Batch(v.z));
        };
        const Vec3<Batch> q = offsetRayOrigin(wide(hit.p), wide(hit.error), wide(hit.n), wide(w));
        const Float3 expected = offsetRayOrigin(hit.p, hit.error, hit.n, w);
        REQUIRE(q.x.get(0) == expected.x);
        REQUIRE(q.y.get(0) == expected.y);
        REQUIRE(q.z.get(0) == expected.z);
    }
}
