// From "triangle 7, barycentrics" to a point with an error bound, normals and closure inputs.
#pragma once

#include "core/vec.h"
#include "integrate/accel.h"
#include "shading/bsdf.h"

namespace mbfeat {

/// A point on a surface, render space.
struct SurfacePoint {
    Float3 p{0.0F};
    Float3 pError{0.0F};         ///< componentwise bound of the absolute error of p
    Float3 ng{0.0F, 0.0F, 1.0F}; ///< geometric normal, unit, on the outside of the surface
    Float3 ns{0.0F, 0.0F, 1.0F}; ///< interpolated normal, unit, on the side of ng
};

SurfacePoint surfacePoint(const AccelGeometry& geometry, const RayHit& hit);

/// ns bent by the normal map of the material; unit, on the side of ng where the map allows.
Float3 mappedNormal(const AccelGeometry& geometry, const RayHit& hit, const SurfacePoint& point,
                    const SurfaceParameters<float>& parameters);

/// Three floats of a primvar (w as 0 or 1 by its width) at the hit; zero where it is absent.
Float4 primvarAt(const AccelGeometry& geometry, const RayHit& hit, const std::string& name);

} // namespace mbfeat
