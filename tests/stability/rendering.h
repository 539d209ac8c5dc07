// Renders of small scenes for the catalogue: samples straight from the integrator, added up in
// double, never clamped.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "catalogue.h"
#include "integrate/testScenes.h"

namespace mbfeat::stability {

/// Means of a pixel's samples.
struct PixelMeans {
    Double3 color{0.0};
    double alpha = 0.0;
    double distance = 0.0; ///< of what the camera ray met
    double vertices = 0.0; ///< of the path, at most six
    int mostVertices = 0;
};

struct Estimate {
    int width = 0, height = 0;
    std::vector<PixelMeans> pixels;
    std::uint64_t paths = 0, rays = 0;

    /// Mean of the three channels, a value a pixel.
    std::vector<double> grey() const;
    double mean() const;
    /// Share of pixels in which some path had more vertices than that.
    double shareAbove(int vertices) const;
    Picture picture(const std::string& name) const;
};

/// Like test::exactOptions, with as many bounces as wanted and no Russian roulette before the last.
RenderOptions plainOptions(int samplesPerPixel, int maxBounces = 64);

/// Renders on two threads; where traps are on, with the scalar kernel and traps. Throws where a
/// sample was not finite, and where a clamp is on.
Estimate trace(test::TestScene& test, const Camera& camera, int width, int height,
               const RenderOptions& options);

/// Score of the image's mean against a value that every pixel should have.
double score(const Estimate& estimate, double truth);
/// Score of the mean difference of two renders with independent seeds of the same scene.
double score(const Estimate& a, const Estimate& b);

/// A camera like test::testCamera of another scale of lengths: clipping planes move along.
Camera cameraOfScale(const Double3& position, float tangent, double scale);

/// A rotation about a skew axis, so that nothing is aligned with the axes, times a scale.
AffineD skew(double scale);

/// sphereMesh() without its normals: a convex body of flat facets.
std::shared_ptr<Mesh> facetedSphere(float radius, int segments, bool inward = false);

} // namespace mbfeat::stability
