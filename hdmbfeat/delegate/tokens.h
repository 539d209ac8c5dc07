// The Hydra and shader tokens that the delegate compares with. Our own table: the layout of the
// library's static token structs changes between releases, their texts do not.
#pragma once

#include "pxr/pxr.h"

#include "pxr/base/tf/token.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

struct Tokens {
    // Prim types.
    const TfToken mesh{"mesh"};
    const TfToken camera{"camera"};
    const TfToken material{"material"};
    const TfToken extComputation{"extComputation"};
    const TfToken renderBuffer{"renderBuffer"};
    const TfToken renderSettings{"renderSettings"};
    const TfToken rectLight{"rectLight"};
    const TfToken diskLight{"diskLight"};
    const TfToken sphereLight{"sphereLight"};
    const TfToken cylinderLight{"cylinderLight"};
    const TfToken distantLight{"distantLight"};
    const TfToken domeLight{"domeLight"};

    // Render settings that hosts set.
    const TfToken enableInteractive{"enableInteractive"};
    const TfToken domeLightCameraVisibility{"domeLightCameraVisibility"};

    // Geometry.
    const TfToken points{"points"};
    const TfToken normals{"normals"};
    const TfToken displayColor{"displayColor"};
    const TfToken displayOpacity{"displayOpacity"};
    const TfToken leftHanded{"leftHanded"};
    const TfToken none{"none"};
    const TfToken bilinear{"bilinear"};
    const TfToken geometryTag{"geometry"};
    const TfToken instanceTransforms{"hydra:instanceTransforms"};
    const TfToken instanceRotations{"hydra:instanceRotations"};
    const TfToken instanceScales{"hydra:instanceScales"};
    const TfToken instanceTranslations{"hydra:instanceTranslations"};

    // Material terminals, nodes and render contexts.
    const TfToken surface{"surface"};
    const TfToken mtlx{"mtlx"};
    const TfToken universal{""};

    // AOVs and products.
    const TfToken color{"color"};
    const TfToken deepRaster{"deepRaster"};
    const TfToken raster{"raster"};
};

inline const Tokens& tokens() {
    static const Tokens instance;
    return instance;
}

} // namespace mbfeat
