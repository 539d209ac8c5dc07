// The families of the catalogue, each a file in families/.
#pragma once

#include "catalogue.h"

namespace mbfeat::stability {

void addRayOffsets(Catalogue& catalogue);
void addPlacements(Catalogue& catalogue);
void addFresnel(Catalogue& catalogue);
void addClosures(Catalogue& catalogue);
void addShadingNormals(Catalogue& catalogue);
void addWarps(Catalogue& catalogue);
void addLightShapes(Catalogue& catalogue);
void addLights(Catalogue& catalogue);
void addEnvironments(Catalogue& catalogue);
void addSums(Catalogue& catalogue);
void addEstimators(Catalogue& catalogue);
void addTextures(Catalogue& catalogue);
void addDenoiser(Catalogue& catalogue);

/// All of them, in this order.
inline Catalogue allCases() {
    Catalogue catalogue;
    for (auto* add : {addRayOffsets, addPlacements, addFresnel, addClosures, addShadingNormals,
                      addWarps, addLightShapes, addLights, addEnvironments, addSums, addEstimators,
                      addTextures, addDenoiser}) {
        add(catalogue);
    }
    return catalogue;
}

} // namespace mbfeat::stability
