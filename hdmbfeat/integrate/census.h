// The effect census: which effects a scene and a view call for, who asks for them, and how much
// there is of things.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/effects.h"
#include "integrate/accel.h"

namespace mbfeat {

/// Who asks for an effect.
struct EffectUse {
    std::size_t count = 0;          ///< prims, or AOVs, that ask for it
    std::vector<std::string> first; ///< the first of them: paths, or names of AOVs
};

/// Which effects a render calls for, and how much there is of things.
struct EffectCensus {
    std::vector<std::string> present; ///< names, e.g. "transmission", "textures", "environment"
    std::vector<std::string> absent;
    std::size_t triangles = 0, instances = 0, lights = 0, textureBytes = 0;
    std::array<EffectUse, kEffectCount> uses; ///< by Effect

    EffectSet effects() const;
    void add(Effect effect, const std::string& asker);
    /// Fills the lists of names.
    void nameEffects();
};

/// What the scene calls for. Names are not filled.
EffectCensus takeCensus(Scene& scene, const Accel& accel, const LightSampler& lights);

} // namespace mbfeat
