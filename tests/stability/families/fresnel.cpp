// Fresnel reflectance in float, where cancellation would ruin the textbook's formulas.
#include "families.h"

#include "oracle.h"
#include "shading/fresnel.h"

namespace mbfeat::stability {

namespace {

double reflectance(double ior, bool entering, double c) {
    return fresnelDielectric(RelativeIndex<double>::make(ior, entering), c);
}

/// The inputs are the cosine, and eta^2 and k = eta^2 - 1 as they are stored, each rounded on its
/// own. The index itself is not moved: near 1 a rounding of it would be a large part of k, and
/// k is made without such a loss.
double fresnelRoundings(float value, float ior, bool entering, float c) {
    return roundings(static_cast<double>(value),
                     [&](const std::vector<double>& x) {
                         auto index =
                             RelativeIndex<double>::make(static_cast<double>(ior), entering);
                         index.etaSquared *= x[0];
                         index.k *= x[1];
                         return fresnelDielectric(index, x[2]);
                     },
                     {1.0, 1.0, static_cast<double>(c)});
}

/// Cosines from 0 to 1, dense at both ends.
template <class Use>
void cosines(const Use& use) {
    use(0.0F);
    for (int e = -126; e < 0; ++e) {
        use(std::ldexp(1.0F, e));
        use(std::ldexp(1.7F, e - 1));
        use(1.0F - std::ldexp(1.3F, e));
    }
    for (int i = 1; i < 4096; ++i) {
        use(static_cast<float>(i) / 4096.0F);
    }
    use(1.0F);
}

void checkIndex(Report& report, float ior) {
    for (const bool entering : {true, false}) {
        const auto index = RelativeIndex<float>::make(ior, entering);
        cosines([&](float c) {
            const float value = fresnelDielectric(index, c);
            const auto where = [&] {
                return Text()
                    .add("cosine", c)
                    .add("entering", entering ? 1 : 0)
                    .add("value", value);
            };
            if (index.k == 0.0F && c * c < std::numeric_limits<float>::min()) {
                // Light in the very plane of an interface that is none: as at the horizon.
                report.require(value == 0.0F || value == 1.0F, where);
                return;
            }
            report.error(fresnelRoundings(value, ior, entering, c), where);
        });
    }
}

/// Around the critical angle, float by float.
void checkCriticalAngle(Report& report, float ior) {
    const auto index = RelativeIndex<float>::make(ior, false);
    auto c = static_cast<float>(std::sqrt(-static_cast<double>(index.k)));
    for (int i = 0; i < 200; ++i) {
        c = std::nextafter(c, 0.0F);
    }
    for (int i = 0; i < 400; ++i, c = std::nextafter(c, 1.0F)) {
        const float value = fresnelDielectric(index, c);
        report.error(fresnelRoundings(value, ior, false, c),
                     [&] { return Text().add("cosine", c).add("value", value); });
    }
}

/// The same interface from both sides: equal reflectance at angles of one refraction.
void checkSymmetry(Report& report) {
    for (const double ior : {1.0 + 1e-6, 1.1, 1.5, 10.0}) {
        cosines([&](float cosine) {
            // Nearer to the horizon, double loses the refracted cosine to total reflection.
            const double c = std::max(static_cast<double>(cosine), 1e-3);
            const auto index = RelativeIndex<double>::make(ior, true);
            const double inside = std::sqrt(index.refractedSquared(c)) / index.eta;
            const double there = reflectance(ior, true, c);
            const double back = reflectance(ior, false, inside);
            // The refracted cosine is rounded too.
            report.error(roundings(back,
                                   [&](const std::vector<double>& x) {
                                       return reflectance(ior, true, x[0]);
                                   },
                                   {c}),
                         [&] {
                             return Text()
                                 .add("ior", ior)
                                 .add("cosine", c)
                                 .add("there", there)
                                 .add("back", back);
                         });
        });
    }
}

double average(double ior) {
    // 2 c dc over the hemisphere by the midpoint rule in t, c = t^4: near an index of 1 all of it
    // is at grazing angles.
    constexpr int kSteps = 20000;
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps;
        sum += 8.0 * std::pow(t, 7.0) * reflectance(ior, true, std::pow(t, 4.0));
    }
    return sum / kSteps;
}

} // namespace

void addFresnel(Catalogue& catalogue) {
    const auto add = [&](const std::string& name, float ior) {
        catalogue.push_back(
            {"fresnel/index-" + name,
             "float reflectance against double, in roundings of eta^2, eta^2 - 1 and cosine", 16.0,
             "about ten operations, each within one rounding of an input or result",
             [ior](Report& report) { checkIndex(report, ior); }});
    };
    add("1", 1.0F);
    add("1+1e-6", 1.0F + 1e-6F);
    add("1-1e-6", 1.0F - 1e-6F);
    add("1.5", 1.5F);
    add("10", 10.0F);
    add("0.1", 0.1F);
    add("100", 100.0F);
    for (const auto& [name, ior] :
         {std::pair("1+1e-6", 1.0F + 1e-6F), std::pair("1.5", 1.5F), std::pair("10", 10.0F)}) {
        catalogue.push_back({std::string("fresnel/critical-angle-") + name,
                             "float reflectance around total reflection, in roundings", 16.0,
                             "as for the other angles: the condition grows, the steps do not",
                             [ior = ior](Report& report) { checkCriticalAngle(report, ior); }});
    }
    catalogue.push_back(
        {"fresnel/both-sides", "reflectance from inside at the refracted angle, in float roundings",
         0.1,
         "Snell's law and Fresnel's are symmetric; evaluated in double, which loses 1e-6 of a "
         "cosine of 1e-3",
         checkSymmetry});
    catalogue.push_back(
        {"fresnel/average", "the fit of the mean reflectance below the integral, relative", 0.02,
         "what shading/fresnel.h promises; above the integral is an error of any "
         "size",
         [](Report& report) {
             for (const double ior : {1.0 + 1e-5, 1.001, 1.01, 1.1, 1.33, 1.5, 2.0, 4.0, 10.0}) {
                 const double truth = average(ior);
                 const auto fit =
                     static_cast<double>(fresnelDielectricAverage(static_cast<float>(ior)));
                 const double above = (fit - truth) / truth;
                 report.error(above > 1e-4 ? 1.0 : std::max(-above, 0.0), [&] {
                     return Text().add("ior", ior).add("fit", fit).add("integral", truth);
                 });
             }
         }});
}

} // namespace mbfeat::stability
