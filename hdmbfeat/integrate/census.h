// The effect census: which effects a scene calls for, and how much there is of things.
#pragma once

#include "integrate/accel.h"
#include "integrate/integrator.h"

namespace mbfeat {

EffectCensus takeCensus(Scene& scene, const Accel& accel, const LightSampler& lights);

} // namespace mbfeat
