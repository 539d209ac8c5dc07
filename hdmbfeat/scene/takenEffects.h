// Materials and lights without some of their effects, for users who do without and for measuring
// what an effect costs. What stands in an effect's place is in effectTable().
#pragma once

#include "core/effects.h"
#include "scene/light.h"
#include "scene/material.h"

namespace mbfeat {

/// Of a material whose images are loaded.
void takeEffectsFrom(Material& material, EffectSet taken);
void takeEffectsFrom(Light& light, EffectSet taken);
/// Whether the light goes altogether.
bool isTakenAway(const Light& light, EffectSet taken);

} // namespace mbfeat
