// Small scenes with closed-form answers, built without a stage.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "film/film.h"
#include "film/renderer.h"
#include "integrate/integrator.h"
#include "scene/scene.h"

namespace mbfeat::test {

/// Latitude-longitude sphere about the origin with smooth normals.
std::shared_ptr<Mesh> sphereMesh(float radius, int segments, bool inward);
/// A rectangle at `origin` spanned by u and v; front side u x v.
std::shared_ptr<Mesh> quadMesh(const Float3& origin, const Float3& u, const Float3& v);

/// A material of constants, named by its path.
Material constantMaterial(const std::string& path, const Rgb& diffuse);

/// A scene with its diagnostics; the members add prims of one slot.
struct TestScene {
    Diagnostics diagnostics;
    Scene scene{diagnostics};

    void add(const std::string& path, std::shared_ptr<const Mesh> mesh, const Material& material,
             const AffineD& toWorld = AffineD());
    void addInstances(const std::string& path, std::shared_ptr<const Mesh> mesh,
                      const Material& material, std::vector<AffineD> transforms);
    void addSky(const Rgb& radiance);
    /// A white rect light that shines down from (0, `height`, -2), at /Lamp.
    void addLamp(double height);
};

AffineD translation(double x, double y, double z);

/// At `position`, looking along -z; the image plane at distance 1 is 2 * tangent wide.
Camera testCamera(const Double3& position, float tangent);

/// Commits the integrator's scene, and sets a view of `width` x `height` pixels; both must succeed.
void prepareView(Integrator& integrator, const IntegratorRequest& request, const Camera& camera,
                 int width, int height);

/// A view of that many pixels, all of them, with a film of `color`.
RenderView viewOf(const Camera& camera, int width, int height);

/// Renders the view and waits; `interactive` as a viewer does.
RenderReport renderView(Scene& scene, const RenderView& view, const RenderOptions& options,
                        bool interactive = false);

/// Renders with the given AOVs and waits.
std::shared_ptr<Film> render(Scene& scene, const Camera& camera, int width, int height,
                             const std::vector<std::string>& aovs, const RenderOptions& options);

/// One AOV as width() floats a pixel, row 0 at the top.
std::vector<float> aov(const Film& film, const std::string& name);

/// Mean of an AOV's first channel over the image.
double meanOf(const Film& film, const std::string& name);

/// Box filter, many bounces, no clamps, paths that do not split.
RenderOptions exactOptions(int samplesPerPixel);

} // namespace mbfeat::test
