// The closure with parts left out: the same bits wherever a surface does not have those parts.
#include <doctest/doctest.h>

#include <cstring>

#include "shading/bsdfCases.h"
#include "shading/diffuseSurface.h"
#include "support/chiSquared.h"

namespace mbfeat::test {

namespace {

/// The parts that a surface has.
std::uint32_t partsOf(const SurfaceParameters<float>& p) {
    const bool reflects = p.ior != 1.0F || p.metallic > 0.0F || p.useSpecularWorkflow;
    std::uint32_t parts = 0;
    parts |= reflects ? std::uint32_t{kBsdfReflection} : 0U;
    parts |= p.opacity < 1.0F ? kBsdfReflection | kBsdfTransmission : 0U;
    parts |= p.useSpecularWorkflow ? std::uint32_t{kBsdfSpecularWorkflow} : 0U;
    // A clearcoat has the index of what lies below.
    parts |= parts != 0 && p.clearcoat > 0.0F ? std::uint32_t{kBsdfClearcoat} : 0U;
    return parts;
}

std::uint32_t bitsOf(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    return bits;
}
bool same(float a, float b) {
    return bitsOf(a) == bitsOf(b);
}
bool same(const Float3& a, const Float3& b) {
    return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z);
}

/// Compares a closure with parts E with the whole one, at random directions and numbers.
template <std::uint32_t E>
void compare(const BsdfCase& c, TestRandom& random) {
    if ((partsOf(c.parameters) & ~E) != 0) {
        return;
    }
    CAPTURE(c.name);
    CAPTURE(E);
    const Bsdf<float> whole(c.parameters, c.entering);
    const ClosureOf<float, E> part(c.parameters, c.entering);
    CHECK(part.hasNonDelta() == whole.hasNonDelta());
    CHECK(same(part.albedo(), whole.albedo()));
    int different = 0;
    for (int repeat = 0; repeat < 400; ++repeat) {
        const Float3 wo = direction(random.nextDouble(), 6.0 * random.nextDouble());
        const Float3 wi = direction(2.0 * random.nextDouble() - 1.0, 6.0 * random.nextDouble());
        // The ends of the range of random numbers, too.
        const float choice = repeat == 0   ? 0.0F
                             : repeat == 1 ? kOneMinusEpsilon
                                           : random.nextFloat();
        const Float2 u = random.nextFloat2();
        const BsdfValue<float> a = part.evaluate(part.outgoing(wo), wi);
        const BsdfValue<float> b = whole.evaluate(whole.outgoing(wo), wi);
        const BsdfSample<float> s = part.sample(part.outgoing(wo), choice, u);
        const BsdfSample<float> t = whole.sample(whole.outgoing(wo), choice, u);
        const bool equal =
            same(a.diffuse, b.diffuse) && same(a.specular, b.specular) && same(a.pdf, b.pdf) &&
            same(s.wi, t.wi) && same(s.weight, t.weight) && same(s.pdf, t.pdf) &&
            same(s.tint, t.tint) && same(s.roughness, t.roughness) && same(s.eta, t.eta) &&
            s.delta == t.delta && s.diffuse == t.diffuse && s.transmitted == t.transmitted;
        different += equal ? 0 : 1;
    }
    CHECK(different == 0);
}

} // namespace

TEST_CASE("what a surface does not have can be left out of its closure") {
    std::vector<BsdfCase> cases = bsdfCases();
    cases.push_back(bsdfCase("black", true, [](SurfaceParameters<float>& p) {
        p.diffuseColor = Float3(0.0F);
        p.ior = 1.0F;
    }));
    cases.push_back(
        bsdfCase("Lambert under a clearcoat of index 1", false, [](SurfaceParameters<float>& p) {
            p.diffuseColor = Float3(0.7F, 0.2F, 0.1F);
            p.ior = 1.0F;
            p.clearcoat = 0.5F;
            p.clearcoatRoughness = 0.4F;
        }));
    cases.push_back(bsdfCase("mirror", true, [](SurfaceParameters<float>& p) {
        p.metallic = 1.0F;
        p.roughness = 0.0F;
    }));
    TestRandom random(31);
    for (const BsdfCase& c : cases) {
        compare<0>(c, random);
        compare<kBsdfReflection>(c, random);
        compare<kBsdfReflection | kBsdfTransmission>(c, random);
        compare<kBsdfReflection | kBsdfClearcoat>(c, random);
        compare<kBsdfReflection | kBsdfSpecularWorkflow>(c, random);
        compare<kBsdfReflection | kBsdfTransmission | kBsdfClearcoat>(c, random);
        compare<kBsdfReflection | kBsdfTransmission | kBsdfSpecularWorkflow>(c, random);
        compare<kBsdfReflection | kBsdfClearcoat | kBsdfSpecularWorkflow>(c, random);
    }
}

} // namespace mbfeat::test
