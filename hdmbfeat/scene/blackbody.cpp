#include "scene/blackbody.h"

#include <cmath>

namespace mbfeat {

namespace {

/// Multi-lobe fit of a CIE 1931 colour matching function: a sum of skewed Gaussians.
double lobe(double nanometres, double scale, double mean, double below, double above) {
    const double t = (nanometres - mean) * (nanometres < mean ? below : above);
    return scale * std::exp(-0.5 * t * t);
}

} // namespace

Rgb blackbodyColor(float kelvin) {
    const double temperature = std::fmin(std::fmax(static_cast<double>(kelvin), 1000.0), 10000.0);
    constexpr double kSecondRadiation = 1.438776877e7; // nm K
    double x = 0.0, y = 0.0, z = 0.0;
    for (double nm = 360.0; nm <= 830.0; nm += 5.0) {
        const double power =
            std::pow(nm / 560.0, -5.0) / std::expm1(kSecondRadiation / (nm * temperature));
        x += power *
             (lobe(nm, 1.056, 599.8, 0.0264, 0.0323) + lobe(nm, 0.362, 442.0, 0.0624, 0.0374) +
              lobe(nm, -0.065, 501.1, 0.0490, 0.0382));
        y += power *
             (lobe(nm, 0.821, 568.8, 0.0213, 0.0247) + lobe(nm, 0.286, 530.9, 0.0613, 0.0322));
        z += power *
             (lobe(nm, 1.217, 437.0, 0.0845, 0.0278) + lobe(nm, 0.681, 459.0, 0.0385, 0.0725));
    }
    x /= y;
    z /= y;
    // XYZ to linear Rec.709 (ITU-R BT.709 primaries, D65).
    const double r = std::fmax(3.2404542 * x - 1.5371385 - 0.4985314 * z, 0.0);
    const double g = std::fmax(-0.9692660 * x + 1.8760108 + 0.0415560 * z, 0.0);
    const double b = std::fmax(0.0556434 * x - 0.2040259 + 1.0572252 * z, 0.0);
    const double luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    return {static_cast<float>(r / luminance), static_cast<float>(g / luminance),
            static_cast<float>(b / luminance)};
}

} // namespace mbfeat
