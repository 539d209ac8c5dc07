// Render products: what a settings prim asks for, as films to render and files to write.
#pragma once

#include "pxr/pxr.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/settings.h"
#include "film/product.h"
#include "pxr/imaging/hd/renderSettings.h"
#include "scene/camera.h"

PXR_NAMESPACE_OPEN_SCOPE
class HdRenderIndex;
PXR_NAMESPACE_CLOSE_SCOPE

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// A film and the products that are made of it: those of one camera and one window share it.
struct ProductView {
    std::string cameraPath;
    Camera camera;
    FilmRequest film;
    std::vector<ProductSpec> products;
};

struct ProductPlan {
    std::vector<ProductView> views;
    /// Products and vars that cannot be made, each naming the prim; the others are.
    std::vector<Error> errors;
    /// Files of products that are not made: what lies there is of an earlier render.
    std::vector<std::string> staleFiles;
};

/// `exposure`: apply the cameras' exposure. Camera and film problems that were worked around go to
/// `diagnostics`.
ProductPlan planProducts(const HdRenderSettings::RenderProducts& products, HdRenderIndex& index,
                         const RenderOptions& options, bool exposure, Diagnostics& diagnostics);

/// The film of a view, kept paths taking `pathSampleLimit` bytes at most. Where that or the memory
/// is short, the products concerned leave the view for the plan's errors and stale files: the deep
/// ones alone where the others can do without kept paths. Null when no product is left.
std::shared_ptr<Film> createFilm(ProductView& view, std::size_t pathSampleLimit, ProductPlan& plan);

/// Names behind the primvars:* that the products show.
std::vector<std::string> primvarsOfProducts(const HdRenderSettings::RenderProducts& products);

/// The AOV that a var shows.
std::string aovOfVar(const HdRenderSettings::RenderProduct::RenderVar& var);

} // namespace mbfeat
