// The closure at the limits of its parameters: float against double, energy, consistency.
#include "families.h"

#include <algorithm>

#include "oracle.h"
#include "shading/bsdfCases.h"
#include "support/chiSquared.h"

namespace mbfeat::stability {

namespace {

using test::TestRandom;

/// A closure with one parameter left open.
struct Kind {
    std::string name;
    SurfaceParameters<float> p;
    bool entering = true;
};

Kind metal(float roughness) {
    Kind k{"metal", {}, true};
    k.p.diffuseColor = Float3(1.0F);
    k.p.metallic = 1.0F;
    k.p.roughness = roughness;
    return k;
}

Kind glass(float roughness, float ior, bool entering) {
    Kind k{entering ? "glass-entering" : "glass-leaving", {}, entering};
    k.p.diffuseColor = Float3(1.0F);
    k.p.opacity = 0.0F;
    k.p.roughness = roughness;
    k.p.ior = ior;
    return k;
}

Kind plastic(float roughness, float ior) {
    Kind k{"plastic", {}, true};
    k.p.diffuseColor = Float3(1.0F);
    k.p.roughness = roughness;
    k.p.ior = ior;
    k.p.clearcoat = 1.0F;
    k.p.clearcoatRoughness = roughness;
    return k;
}

/// The inputs that are moved by a rounding each. The index has a factor of its own: near 1 it is
/// what it is beyond 1 that counts, and that comes without a rounding.
std::vector<double> doubles(const Float3& a, const Float3& b, const SurfaceParameters<float>& p) {
    std::vector<double> x;
    for (const float v : {a.x, a.y, a.z, b.x, b.y, b.z, 1.0F, p.roughness, p.clearcoatRoughness}) {
        x.push_back(static_cast<double>(v));
    }
    return x;
}

Bsdf<double> oracleOf(const Kind& kind, const std::vector<double>& x) {
    SurfaceParameters<double> p = test::convert<double>(kind.p);
    p.ior += (x[6] - 1.0) * std::min(p.ior, std::abs(p.ior - 1.0));
    p.roughness = x[7];
    p.clearcoatRoughness = x[8];
    return {p, kind.entering};
}

std::string place(const Float3& wo, const Float3& wi, double value, double truth) {
    return Text().add("wo.z", wo.z).add("wi.z", wi.z).add("value", value).add("double", truth);
}

constexpr float kCosines[] = {1.0F, 0.8F, 0.3F, 1e-2F, 1e-4F, 1e-6F};

/// Random directions of view, also at the horizon.
Float3 view(TestRandom& random, int i) {
    const float cosine = i % 8 < 6 ? kCosines[i % 8] : 0.001F + 0.999F * random.nextFloat();
    const double phi = 6.2831853 * random.nextDouble();
    const auto sine =
        std::sqrt((1.0 - static_cast<double>(cosine)) * (1.0 + static_cast<double>(cosine)));
    return {static_cast<float>(sine * std::cos(phi)), static_cast<float>(sine * std::sin(phi)),
            cosine};
}

/// evaluate() where the lobes are: in directions that double samples.
void checkEvaluate(Report& report, const Kind& kind) {
    TestRandom random(31);
    const Bsdf<float> bsdf(kind.p, kind.entering);
    for (int i = 0; i < 4000; ++i) {
        const Float3 wo = view(random, i);
        const double choice = random.nextDouble(), ux = random.nextDouble();
        const double uy = random.nextDouble();
        const BsdfSample<double> s =
            oracleOf(kind, doubles(wo, wo, kind.p)).sample(Double3(wo), choice, {ux, uy});
        const Float3 wi(s.wi);
        if (s.delta || !(s.pdf > 0.0) || wi.z == 0.0F) {
            continue;
        }
        const BsdfValue<float> value = bsdf.evaluate(wo, wi);
        const std::vector<double> inputs = doubles(wo, wi, kind.p);
        const auto exact = [&](const std::vector<double>& x) {
            return oracleOf(kind, x).evaluate(Double3(x[0], x[1], x[2]), Double3(x[3], x[4], x[5]));
        };
        const double pdf = static_cast<double>(value.pdf);
        const double total = static_cast<double>(value.total().x);
        report.error(roundings(
                         pdf, [&](const std::vector<double>& x) { return exact(x).pdf; }, inputs),
                     [&] { return "pdf: " + place(wo, wi, pdf, exact(inputs).pdf); });
        report.error(
            roundings(
                total, [&](const std::vector<double>& x) { return exact(x).total().x; }, inputs),
            [&] { return "value: " + place(wo, wi, total, exact(inputs).total().x); });
    }
}

/// sample() with the same numbers; where float and double choose different lobes there is nothing
/// to compare.
void checkSample(Report& report, const Kind& kind) {
    TestRandom random(32);
    const Bsdf<float> bsdf(kind.p, kind.entering);
    for (int i = 0; i < 4000; ++i) {
        const Float3 wo = view(random, i);
        const float choice = random.nextFloat();
        const Float2 u = random.nextFloat2();
        const BsdfSample<float> s = bsdf.sample(wo, choice, u);
        const Float3 numbers(choice, u.x, u.y);
        const auto exact = [&](const std::vector<double>& x) {
            return oracleOf(kind, x).sample(Double3(x[0], x[1], x[2]), x[3], {x[4], x[5]});
        };
        const std::vector<double> inputs = doubles(wo, numbers, kind.p);
        const BsdfSample<double> truth = exact(inputs);
        if (truth.delta != s.delta || truth.transmitted != s.transmitted ||
            truth.diffuse != s.diffuse) {
            continue;
        }
        for (int c = 0; c < 3; ++c) {
            report.error(
                roundings(
                    static_cast<double>(s.wi[c]),
                    [&](const std::vector<double>& x) { return exact(x).wi[c]; }, inputs,
                    kRoundoff),
                [&] { return place(wo, s.wi, static_cast<double>(s.wi[c]), truth.wi[c]); });
        }
    }
}

/// What sample() says of its direction is what evaluate() says of it.
void checkConsistency(Report& report, const Kind& kind) {
    TestRandom random(33);
    const Bsdf<float> bsdf(kind.p, kind.entering);
    for (int i = 0; i < 20000; ++i) {
        const Float3 wo = view(random, i);
        const float choice = random.nextFloat();
        const BsdfSample<float> s = bsdf.sample(wo, choice, random.nextFloat2());
        if (s.delta || !(s.pdf > 0.0F)) {
            continue;
        }
        const BsdfValue<float> value = bsdf.evaluate(wo, s.wi);
        report.error(ulps(static_cast<double>(s.pdf), static_cast<double>(value.pdf)));
        report.error(
            ulps(static_cast<double>(s.weight.x * s.pdf), static_cast<double>(value.total().x)),
            [&] { return Text().add("wo.z", wo.z).add("pdf", s.pdf); });
    }
}

/// The largest weight of a white closure, flux counted: no sample may carry more than it brought.
void checkWeights(Report& report, const Kind& kind) {
    TestRandom random(34);
    const Bsdf<float> bsdf(kind.p, kind.entering);
    const float ends[] = {0.0F, 0x1p-24F, 0.5F, 1.0F - 0x1p-24F};
    for (int i = 0; i < 20000; ++i) {
        const Float3 wo = view(random, i);
        float choice = random.nextFloat();
        Float2 u = random.nextFloat2();
        if (i % 3 == 0) {
            choice = ends[random.bits() % 4];
            u = {ends[random.bits() % 4], ends[random.bits() % 4]};
        }
        const BsdfSample<float> s = bsdf.sample(wo, choice, u);
        report.error(static_cast<double>(maxComponent(s.weight) * sqr(s.eta)) - 1.0,
                     [&] { return place(wo, s.wi, static_cast<double>(s.weight.x), 1.0); });
        report.error(std::abs(length(Double3(s.wi)) - 1.0) > 1e-6 ? 1.0 : 0.0,
                     [&] { return place(wo, s.wi, length(Double3(s.wi)), 1.0); });
    }
}

/// Directional albedo by quadrature over the closure's own samples, in float.
double albedo(const Kind& kind, const Float3& wo) {
    const Bsdf<float> bsdf(kind.p, kind.entering);
    constexpr int kGrid = 96;
    double sum = 0.0;
    for (int i = 0; i < kGrid * kGrid; ++i) {
        const auto lobe = static_cast<float>(std::fmod(i * 0.6180339887498949, 1.0) * 0.9999999);
        const int column = i % kGrid;
        const int row = i / kGrid;
        const Float2 u((static_cast<float>(column) + 0.5F) / kGrid,
                       (static_cast<float>(row) + 0.5F) / kGrid);
        const BsdfSample<float> s = bsdf.sample(wo, lobe, u);
        sum += static_cast<double>(s.weight.x) * static_cast<double>(sqr(s.eta));
    }
    return sum / (kGrid * kGrid);
}

void checkEnergy(Report& report, const Kind& kind) {
    for (const float cosine : kCosines) {
        const double a = albedo(kind, test::direction(static_cast<double>(cosine), 0.7));
        report.error(std::max(a - 1.0, 0.0),
                     [&] { return Text().add("cosine", cosine).add("albedo", a); });
    }
}

void checkReciprocity(Report& report, const Kind& kind) {
    TestRandom random(35);
    const Bsdf<float> bsdf(kind.p, kind.entering);
    for (int i = 0; i < 20000; ++i) {
        const Float3 a = view(random, i), b = view(random, static_cast<int>(random.bits() % 64));
        const double forth = static_cast<double>(bsdf.evaluate(a, b).total().x * a.z);
        const double back = static_cast<double>(bsdf.evaluate(b, a).total().x * b.z);
        if (std::max(forth, back) > 1e-30) {
            report.error(std::abs(forth - back) / std::max(forth, back),
                         [&] { return place(a, b, forth, back); });
        }
    }
}

/// Both outcomes at a smooth interface, around total reflection: they share out all light.
void checkEdge(Report& report, float ior) {
    const Kind kind = glass(0.0F, ior, false);
    const Bsdf<float> bsdf(kind.p, kind.entering);
    auto c = static_cast<float>(std::sqrt(1.0 - 1.0 / sqr(static_cast<double>(ior))));
    for (int i = 0; i < 300; ++i) {
        c = std::nextafter(c, 0.0F);
    }
    for (int i = 0; i < 600; ++i, c = std::nextafter(c, 1.0F)) {
        const Float3 wo = test::direction(static_cast<double>(c), 0.4);
        for (const float choice : {0.0F, 0.3F, 0.9F, 0.9999F, 1.0F - 0x1p-24F}) {
            const BsdfSample<float> s = bsdf.sample(wo, choice, {0.5F, 0.5F});
            // Where little passes, it is known to 6e-8 of all light only; so is its probability.
            report.error(std::abs(static_cast<double>(s.weight.x * sqr(s.eta)) - 1.0) *
                             static_cast<double>(s.pdf),
                         [&] { return place(wo, s.wi, static_cast<double>(s.weight.x), 1.0); });
        }
    }
}

void checkBlack(Report& report) {
    TestRandom random(36);
    for (Kind kind : {metal(0.3F), glass(0.3F, 1.5F, true), plastic(0.3F, 1.0F)}) {
        kind.p.diffuseColor = Float3(0.0F);
        kind.p.clearcoat = 0.0F;
        const bool reflects = kind.p.metallic < 1.0F && kind.p.ior != 1.0F;
        const Bsdf<float> bsdf(kind.p, kind.entering);
        for (int i = 0; i < 2000; ++i) {
            const Float3 wo = view(random, i);
            const float choice = random.nextFloat();
            const BsdfSample<float> s = bsdf.sample(wo, choice, random.nextFloat2());
            // Black glass reflects what its interface does; nothing passes.
            const bool allowed = reflects && !s.transmitted;
            report.error(allowed ? 0.0 : static_cast<double>(maxComponent(s.weight)));
        }
    }
}

void addRoughness(Catalogue& catalogue, const std::string& name, float roughness) {
    for (const Kind& kind : {metal(roughness), plastic(roughness, 1.5F),
                             glass(roughness, 1.5F, true), glass(roughness, 1.5F, false)}) {
        const bool smooth = roughness * roughness < kDeltaAlpha;
        const std::string at = "closure/" + kind.name + "-roughness-" + name;
        if (!smooth) {
            catalogue.push_back({at + "-evaluate",
                                 "value and density in float against double, in roundings of "
                                 "directions, index and roughness",
                                 64.0,
                                 "some thirty operations follow one another, each within a "
                                 "rounding or two of its inputs",
                                 [kind](Report& report) { checkEvaluate(report, kind); }});
        }
        catalogue.push_back({at + "-sample",
                             "sampled directions in float against double, in roundings of view, "
                             "numbers, index and roughness",
                             64.0, "as for evaluation",
                             [kind](Report& report) { checkSample(report, kind); }});
    }
}

void addConsistency(Catalogue& catalogue) {
    for (const auto& [name, kind] :
         {std::pair("metal-0.0142", metal(0.0142F)), std::pair("metal-1", metal(1.0F)),
          std::pair("glass-0.1-index-1+1e-6", glass(0.1F, 1.0F + 1e-6F, true)),
          std::pair("glass-0.3-index-10", glass(0.3F, 10.0F, false)),
          std::pair("plastic-0.1", plastic(0.1F, 1.5F))}) {
        catalogue.push_back({std::string("closure/consistent-") + name,
                             "density and weight of samples against evaluation, in ulps", 1.5,
                             "the same code; the weight is divided by the density and multiplied",
                             [kind = kind](Report& report) { checkConsistency(report, kind); }});
    }
}

void addEnergy(Catalogue& catalogue) {
    for (const auto& [name, kind] :
         {std::pair("metal-0", metal(0.0F)), std::pair("metal-1e-7", metal(1e-7F)),
          std::pair("metal-1", metal(1.0F)), std::pair("glass-0", glass(0.0F, 1.5F, false)),
          std::pair("glass-index-1", glass(0.0F, 1.0F, true)),
          std::pair("glass-index-1-1e-6", glass(0.0F, 1.0F - 1e-6F, true)),
          std::pair("glass-0.3-index-100", glass(0.3F, 100.0F, false)),
          std::pair("glass-1-index-10", glass(1.0F, 10.0F, false)),
          std::pair("bubble-0.2", glass(0.2F, 0.5F, true))}) {
        catalogue.push_back({std::string("closure/weights-") + name,
                             "weight of a sample of a white closure above 1, flux counted", 2e-6,
                             "weights are ratios of masking terms and of reflectances to their own "
                             "choice: at most 1 to some tens of roundings (2e-6 is 34)",
                             [kind = kind](Report& report) { checkWeights(report, kind); }});
    }
    for (const auto& [name, kind] :
         {std::pair("plastic-0", plastic(0.0F, 1.5F)),
          std::pair("plastic-0.1-index-1+1e-6", plastic(0.1F, 1.0F + 1e-6F)),
          std::pair("plastic-1-index-10", plastic(1.0F, 10.0F)),
          std::pair("plastic-0.5-index-0.1", plastic(0.5F, 0.1F)),
          std::pair("glass-0.5", glass(0.5F, 1.5F, true))}) {
        catalogue.push_back(
            {std::string("closure/energy-") + name, "directional albedo of a white closure above 1",
             2e-5,
             "where all light is reflected every sample has a weight of 1 to some "
             "tens of roundings; elsewhere more is lost than the quadrature errs by",
             [kind = kind](Report& report) { checkEnergy(report, kind); }});
    }
}

} // namespace

void addClosures(Catalogue& catalogue) {
    for (const auto& [name, roughness] :
         {std::pair("0", 0.0F), std::pair("1e-7", 1e-7F), std::pair("0.0142", 0.0142F),
          std::pair("0.05", 0.05F), std::pair("0.3", 0.3F), std::pair("1", 1.0F)}) {
        addRoughness(catalogue, name, roughness);
    }
    for (const auto& [name, ior] :
         {std::pair("1+1e-6", 1.0F + 1e-6F), std::pair("10", 10.0F), std::pair("0.1", 0.1F)}) {
        for (const Kind& kind : {glass(0.3F, ior, true), glass(0.3F, ior, false)}) {
            catalogue.push_back({"closure/" + kind.name + "-index-" + name + "-evaluate",
                                 "value and density in float against double, in roundings", 64.0,
                                 "as for roughness",
                                 [kind](Report& report) { checkEvaluate(report, kind); }});
        }
    }
    addConsistency(catalogue);
    addEnergy(catalogue);
    for (const auto& [name, kind] :
         {std::pair("metal-0.1", metal(0.1F)), std::pair("metal-1", metal(1.0F)),
          std::pair("plastic-0.3", plastic(0.3F, 1.5F))}) {
        catalogue.push_back({std::string("closure/reciprocal-") + name,
                             "value with both directions exchanged, relative", 4e-6,
                             "both are within 32 roundings of one number; the half vector is the "
                             "same sum",
                             [kind = kind](Report& report) { checkReciprocity(report, kind); }});
    }
    for (const auto& [name, ior] :
         {std::pair("1+1e-6", 1.0F + 1e-6F), std::pair("1.5", 1.5F), std::pair("10", 10.0F)}) {
        catalogue.push_back({std::string("closure/total-reflection-edge-") + name,
                             "weight of either outcome at a smooth interface against 1, flux "
                             "counted, times its probability",
                             1e-6, "a reflectance over itself: some roundings",
                             [ior = ior](Report& report) { checkEdge(report, ior); }});
    }
    catalogue.push_back({"closure/black", "weight of any sample of a black closure", 0.0,
                         "nothing times anything finite is nothing", checkBlack});
}

} // namespace mbfeat::stability
