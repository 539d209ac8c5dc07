// Origins of rays that leave a surface: on its side, for triangles of any size, shape and place.
#include "families.h"

#include "core/rayOffset.h"
#include "core/warp.h"
#include "integrate/surfacePoint.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;

Float3 randomVector(TestRandom& random, float scale) {
    const float x = random.nextFloat(), y = random.nextFloat(), z = random.nextFloat();
    return Float3(x - 0.5F, y - 0.5F, z - 0.5F) * (2.0F * scale);
}

/// A point on a triangle as the integrator makes it, and the exact plane through the corners.
struct Hit {
    SurfacePoint point;
    Double3 corner, normal;

    double height(const Float3& q) const { return dot(Double3(q) - corner, normal); }
    double bound() const { return dot(abs(normal), Double3(point.pError)); }
};

Hit makeHit(const Float3& p0, const Float3& p1, const Float3& p2, Float2 b) {
    SurfaceInputs<float> in{};
    in.p0 = p0;
    in.p1 = p1;
    in.p2 = p2;
    in.b1 = b.x;
    in.b2 = b.y;
    in.sign = 1.0F;
    Hit hit;
    hit.point = surfacePoint(in);
    hit.corner = Double3(p0);
    const Double3 n = cross(Double3(p1) - Double3(p0), Double3(p2) - Double3(p0));
    hit.normal = n / length(n);
    return hit;
}

bool hasArea(const Float3& p0, const Float3& p1, const Float3& p2) {
    return lengthSquared(cross(p1 - p0, p2 - p0)) > 0.0F;
}

std::string place(const Hit& hit) {
    return Text()
        .add("x", hit.point.p.x)
        .add("y", hit.point.p.y)
        .add("z", hit.point.p.z)
        .add("bound", hit.bound());
}

/// Triangles of the given size at the given distance from the origin of space.
template <class Use>
void triangles(float size, float distance, std::uint64_t seed, const Use& use) {
    TestRandom random(seed);
    for (int i = 0; i < 20000; ++i) {
        const Float3 p0 = randomVector(random, distance);
        const Float3 p1 = p0 + randomVector(random, size);
        const Float3 p2 = p0 + randomVector(random, size);
        const Float2 b = uniformTriangle(random.nextFloat2());
        const Float3 w = uniformSphere(random.nextFloat2());
        if (hasArea(p0, p1, p2)) {
            use(makeHit(p0, p1, p2, b), w);
        }
    }
}

void checkBound(Report& report, float size, float distance) {
    triangles(size, distance, 1, [&](const Hit& hit, const Float3&) {
        report.error(std::abs(hit.height(hit.point.p)) / hit.bound(), [&] { return place(hit); });
    });
}

/// How far an origin is short of the plane, in error bounds; 0 or less on the right side.
double shortfall(const Hit& hit, const Float3& w) {
    const Float3 q = offsetRayOrigin(hit.point.p, hit.point.pError, hit.point.ng, w);
    const double side = dot(Double3(w), hit.normal) < 0.0 ? -1.0 : 1.0;
    const double height = side * hit.height(q);
    return height > 0.0 ? 0.0 : 1.0 - height / hit.bound();
}

/// Needles: one corner is off the line of the other two by its length over the aspect.
void checkNeedles(Report& report, float aspect) {
    TestRandom random(2);
    for (int i = 0; i < 40000; ++i) {
        const Float3 p0 = randomVector(random, 10.0F);
        const Float3 along = randomVector(random, 1.0F);
        const Float3 across = cross(along, randomVector(random, 1.0F));
        const float share = random.nextFloat();
        const Float3 p1 = p0 + along;
        const Float3 p2 = p0 + along * share + across * (length(along) / (length(across) * aspect));
        const Float2 b = uniformTriangle(random.nextFloat2());
        const Float3 w = uniformSphere(random.nextFloat2());
        if (!hasArea(p0, p1, p2)) {
            continue;
        }
        const Hit hit = makeHit(p0, p1, p2, b);
        // Directions within the error of the normal have no side.
        if (std::abs(dot(Double3(w), hit.normal)) >
            2.0 * length(Double3(hit.point.ng) - hit.normal)) {
            report.error(shortfall(hit, w), [&] { return place(hit); });
        }
    }
}

void checkNeedleNormals(Report& report, float aspect) {
    TestRandom random(3);
    for (int i = 0; i < 40000; ++i) {
        const Float3 p0 = randomVector(random, 10.0F);
        const Float3 along = randomVector(random, 1.0F);
        const Float3 across = cross(along, randomVector(random, 1.0F));
        const Float3 p1 = p0 + along;
        const Float3 p2 =
            p0 + along * random.nextFloat() + across * (length(along) / (length(across) * aspect));
        if (!hasArea(p0, p1, p2)) {
            continue;
        }
        const Hit hit = makeHit(p0, p1, p2, {0.3F, 0.3F});
        // The error that one rounding of each edge makes: longest edge over height.
        const Double3 e1 = Double3(p1) - Double3(p0), e2 = Double3(p2) - Double3(p0);
        const double longest = std::max(length(e1), length(e2));
        const double height = length(cross(e1, e2)) / longest;
        report.error(length(Double3(hit.point.ng) - hit.normal) / (0x1p-24 * longest / height),
                     [&] { return place(hit); });
    }
}

/// Directions at a small angle to the surface.
void checkGrazing(Report& report, float sine) {
    triangles(1.0F, 10.0F, 4, [&](const Hit& hit, const Float3& w) {
        const Float3 n = hit.point.ng;
        const Float3 flat = normalize(w - n * dot(w, n));
        for (const float sign : {-1.0F, 1.0F}) {
            const Float3 grazing = normalize(flat + n * (sign * sine));
            const double exact = dot(Double3(grazing), hit.normal);
            if (exact * static_cast<double>(sign) <= 0.0) {
                continue; // rounded through the surface
            }
            report.error(shortfall(hit, grazing), [&] { return place(hit); });
        }
    });
}

/// Shadow segments between two triangles: the ends stay on the near sides.
void checkSegments(Report& report, float size, float apart) {
    TestRandom random(5);
    for (int i = 0; i < 20000; ++i) {
        const Float3 p0 = randomVector(random, size);
        const Float3 p1 = p0 + randomVector(random, size), p2 = p0 + randomVector(random, size);
        const Float3 q0 = p0 + uniformSphere(random.nextFloat2()) * apart;
        const Float3 q1 = q0 + randomVector(random, size), q2 = q0 + randomVector(random, size);
        const Float2 b = uniformTriangle(random.nextFloat2());
        const Float2 c = uniformTriangle(random.nextFloat2());
        if (!hasArea(p0, p1, p2) || !hasArea(q0, q1, q2)) {
            continue;
        }
        const Hit from = makeHit(p0, p1, p2, b), to = makeHit(q0, q1, q2, c);
        const RaySegment<float> ray = offsetSegment(from.point.p, from.point.pError, from.point.ng,
                                                    to.point.p, to.point.pError, to.point.ng);
        const Double3 towards = Double3(to.point.p) - Double3(from.point.p);
        const double fromSide = dot(towards, Double3(from.point.ng)) < 0.0 ? -1.0 : 1.0;
        const double toSide = dot(towards, Double3(to.point.ng)) > 0.0 ? -1.0 : 1.0;
        // Where the points are as near as their errors there is no way between them.
        if (fromSide * from.height(to.point.p) < 4.0 * (from.bound() + to.bound()) ||
            toSide * to.height(from.point.p) < 4.0 * (from.bound() + to.bound())) {
            continue;
        }
        const Double3 end =
            Double3(ray.origin) + Double3(ray.direction) * static_cast<double>(ray.length);
        const bool apartEnds =
            fromSide * from.height(ray.origin) > 0.0 && toSide * to.height(Float3(end)) > 0.0;
        report.require(apartEnds, [&] { return place(from); });
    }
}

} // namespace

void addRayOffsets(Catalogue& catalogue) {
    for (const auto& [name, size, distance] :
         {std::tuple("tiny-at-origin", 1e-6F, 1e-6F), std::tuple("small-far", 1.0F, 1e4F),
          std::tuple("large-far", 1e3F, 1e7F), std::tuple("huge", 1e7F, 1e7F)}) {
        catalogue.push_back({std::string("offset/point-error-") + name,
                             "distance of triangle points from the exact plane, in error bounds",
                             1.0, "the bound's derivation in core/rayOffset.h",
                             [size = size, distance = distance](Report& report) {
                                 checkBound(report, size, distance);
                             }});
    }
    for (const float aspect : {1e2F, 1e4F, 1e6F}) {
        const std::string name = Text().add("", aspect);
        catalogue.push_back({"offset/needle-origin-1e" +
                                 std::to_string(static_cast<int>(std::lround(std::log10(aspect)))),
                             "ray origins short of the exact plane of needles, in error bounds",
                             0.0, "no origin lies on the wrong side",
                             [aspect](Report& report) { checkNeedles(report, aspect); }});
        catalogue.push_back(
            {"offset/needle-normal-1e" +
                 std::to_string(static_cast<int>(std::lround(std::log10(aspect)))),
             "error of needle normals, in roundings of an edge seen from its height", 4.0,
             "two edges, each rounded once a component (sqrt 3), and the cross "
             "product's own rounding",
             [aspect](Report& report) { checkNeedleNormals(report, aspect); }});
    }
    for (const auto& [name, sine] :
         {std::pair("1e-3", 1e-3F), std::pair("1e-5", 1e-5F), std::pair("1e-6", 1e-6F)}) {
        catalogue.push_back({std::string("offset/grazing-") + name,
                             "ray origins short of the plane for grazing directions, in bounds",
                             0.0, "no origin lies on the wrong side",
                             [sine = sine](Report& report) { checkGrazing(report, sine); }});
    }
    for (const auto& [name, size, apart] :
         {std::tuple("near", 1.0F, 1e-3F), std::tuple("far", 1e-2F, 1e4F),
          std::tuple("farthest", 1.0F, 1e7F)}) {
        catalogue.push_back(
            {std::string("offset/shadow-segment-") + name,
             "shadow segments that touch one of their surfaces", 0.0,
             "both ends lie on the near sides of the exact planes",
             [size = size, apart = apart](Report& report) { checkSegments(report, size, apart); }});
    }
}

} // namespace mbfeat::stability
