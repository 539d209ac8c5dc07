// The path tracer: unidirectional, next-event estimation with multiple importance sampling, Russian
// roulette. One page, in pathTracer.cpp: trace().
#pragma once

#include <cstdint>

#include "core/sampler.h"
#include "core/settings.h"
#include "integrate/accel.h"
#include "integrate/cameraRay.h"
#include "integrate/pathRecord.h"
#include "shading/lightSampler.h"

namespace mbfeat {

/// Rays spent on a path.
struct PathCounts {
    std::uint32_t rays = 0, shadowRays = 0;
};

/// Everything constant over a render, by reference; any thread.
struct PathTracer {
    const Accel& accel;
    const LightSampler& lights;
    const RenderOptions& options;
    bool lightsHaveMultipliers = false; ///< some light's diffuse or specular is not 1

    /// Follows one path from the camera and fills the record's radiance, alpha, decomposition and,
    /// with Record, every feature. Values are not scaled by exposure.
    template <bool Record>
    PathCounts trace(const CameraRay& camera, const Sampler& sampler, PathRecord& record,
                     RayHit& firstHit) const;
};

} // namespace mbfeat
