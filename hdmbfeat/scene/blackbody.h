// Colour of thermal light, for the colour temperature of lights.
#pragma once

#include "core/vec.h"

namespace mbfeat {

/// Colour of a black body of that temperature (kelvin) in linear Rec.709: luminance 1, no channel
/// below 0. Temperatures are clamped to 1000..10000. Planck's law with the colour matching
/// functions of Wyman, Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color
/// Matching Functions", JCGT 2013.
Rgb blackbodyColor(float kelvin);

} // namespace mbfeat
