// What effects are to the kernels: parts of the closure, and parts of the path record.
#pragma once

#include <cstdint>
#include <utility>

#include "core/effects.h"
#include "integrate/pathRecord.h"
#include "shading/bsdf.h"

namespace mbfeat {

inline constexpr std::pair<Effect, RecordFlags> kRecordedEffects[] = {
    {Effect::kPathFeatures, kRecordFeatures},     {Effect::kContributions, kRecordContributions},
    {Effect::kExtendedFeatures, kRecordExtended}, {Effect::kFirstNonDelta, kRecordFirstNonDelta},
    {Effect::kFirstHit, kRecordFirstHit},         {Effect::kPrimvarAovs, kRecordPrimvars},
};

/// What recording these parts of the record (RecordFlags) is called.
constexpr EffectSet recordedEffects(std::uint32_t recordFlags) {
    EffectSet effects;
    for (const auto& [effect, flag] : kRecordedEffects) {
        effects = (recordFlags & flag) != 0 ? effects | EffectSet(effect) : effects;
    }
    return effects;
}

/// The parts of the record that these effects are about.
constexpr std::uint32_t recordFlagsOf(EffectSet effects) {
    std::uint32_t flags = 0;
    for (const auto& [effect, flag] : kRecordedEffects) {
        flags |= effects.has(effect) ? static_cast<std::uint32_t>(flag) : 0U;
    }
    return flags;
}

/// Parts of the closure (BsdfPart) that surfaces with these effects need.
constexpr std::uint32_t closureParts(EffectSet effects) {
    constexpr EffectSet kReflecting =
        EffectSet(Effect::kReflection) | Effect::kTransmission | Effect::kSpecularWorkflow;
    if ((effects & kReflecting).empty()) {
        // A clearcoat has the index of what is below it: where nothing else reflects it does not.
        return 0;
    }
    std::uint32_t parts = kBsdfReflection;
    parts |=
        effects.has(Effect::kTransmission) ? static_cast<std::uint32_t>(kBsdfTransmission) : 0U;
    parts |= effects.has(Effect::kClearcoat) ? static_cast<std::uint32_t>(kBsdfClearcoat) : 0U;
    parts |= effects.has(Effect::kSpecularWorkflow)
                 ? static_cast<std::uint32_t>(kBsdfSpecularWorkflow)
                 : 0U;
    return parts;
}

} // namespace mbfeat
