#include "delegate/products.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include "delegate/camera.h"
#include "delegate/productVar.h"
#include "delegate/tokens.h"
#include "delegate/values.h"
#include "pxr/imaging/hd/camera.h"
#include "pxr/imaging/hd/renderIndex.h"
#include "scene/imageWindow.h"

namespace mbfeat {

namespace {

using Product = HdRenderSettings::RenderProduct;

constexpr int kLargestSide = 65536;

CameraUtilConformWindowPolicy conformPolicy(const TfToken& name) {
    if (name == "adjustApertureWidth") {
        return CameraUtilMatchVertically;
    }
    if (name == "adjustApertureHeight") {
        return CameraUtilMatchHorizontally;
    }
    if (name == "cropAperture") {
        return CameraUtilCrop;
    }
    if (name == "adjustPixelAspectRatio") {
        return CameraUtilDontConform;
    }
    return CameraUtilFit;
}

float pixelAspect(const Product& product, const HdCamera& camera, Diagnostics& diagnostics) {
    const float aspect = product.pixelAspectRatio;
    if (product.aspectRatioConformPolicy == "adjustPixelAspectRatio" &&
        camera.GetHorizontalAperture() > 0.0F && camera.GetVerticalAperture() > 0.0F) {
        return camera.GetHorizontalAperture() / camera.GetVerticalAperture() *
               static_cast<float>(product.resolution[1]) /
               static_cast<float>(product.resolution[0]);
    }
    if (aspect > 0.0F && aspect < 1e6F) {
        return aspect;
    }
    diagnostics.warn(product.productPath.GetString(),
                     "pixelAspectRatio is " + std::to_string(aspect) +
                         ", and no pixel can be that wide; square ones are rendered. Author the "
                         "width of a pixel by its height, more than 0.");
    return 1.0F;
}

ImageWindow imageWindow(const Product& product, const HdCamera& camera, Diagnostics& diagnostics) {
    ImageWindow window;
    window.width = product.resolution[0];
    window.height = product.resolution[1];
    window.pixelAspectRatio = pixelAspect(product, camera, diagnostics);
    const GfVec2f min = product.dataWindowNDC.GetMin();
    const GfVec2f max = product.dataWindowNDC.GetMax();
    if (const std::optional<PixelRect> data =
            dataWindowPixels(window.width, window.height, {min[0], min[1]}, {max[0], max[1]})) {
        window.data = *data;
    } else {
        window.data = {0, 0, window.width, window.height};
        diagnostics.warn(product.productPath.GetString(),
                         "dataWindowNDC holds the centre of no pixel, or too many pixels; the "
                         "whole image is rendered. Author (left, bottom, right, top) with left "
                         "below right and bottom below top.");
    }
    return window;
}

/// What must agree for two products to be made of one film.
std::string viewKey(const Product& product) {
    const GfRange2f& ndc = product.dataWindowNDC;
    std::string key = product.cameraPath.GetString();
    for (const double number :
         {double(product.resolution[0]), double(product.resolution[1]),
          double(product.pixelAspectRatio), double(ndc.GetMin()[0]), double(ndc.GetMin()[1]),
          double(ndc.GetMax()[0]), double(ndc.GetMax()[1]), double(product.disableDepthOfField)}) {
        key += "|" + std::to_string(number);
    }
    return key + "|" + product.aspectRatioConformPolicy.GetString();
}

bool isDeep(const Product& product) {
    return product.type == tokens().deepRaster;
}

bool isExtendedAov(const std::string& name) {
    const std::optional<AovDescriptor> aov = findAov(name);
    return aov && (aov->recordFlags & kRecordExtended) != 0;
}

class Planner {
public:
    Planner(HdRenderIndex& index, const RenderOptions& options, bool exposure,
            Diagnostics& diagnostics)
        : index_(index),
          options_(options),
          exposure_(exposure),
          diagnostics_(diagnostics) {}

    ProductPlan plan(const HdRenderSettings::RenderProducts& products) {
        for (const Product& product : products) {
            const std::size_t errors = plan_.errors.size();
            sameFile_ = false;
            const bool made = add(product);
            if (!made && !product.name.IsEmpty() && !sameFile_) {
                plan_.staleFiles.push_back(product.name.GetString());
            }
            if (!made && errors == plan_.errors.size()) {
                fail(product, "it could not be set up; it is not written.");
            }
        }
        return std::move(plan_);
    }

private:
    void fail(const Product& product, const std::string& text) {
        plan_.errors.push_back({product.productPath.GetString(), text});
    }

    bool add(const Product& product) {
        if (product.name.IsEmpty()) {
            fail(product, "productName is empty; nothing is written. Author a file name, not as "
                          "time samples alone.");
            return false;
        }
        if (product.type != tokens().raster && !isDeep(product)) {
            fail(product, "productType " + product.type.GetString() +
                              " is not known; it is not written. Use raster or deepRaster.");
            return false;
        }
        const GfVec2i& size = product.resolution;
        if (size[0] < 1 || size[1] < 1 || size[0] > kLargestSide || size[1] > kLargestSide) {
            fail(product, "a resolution of " + std::to_string(size[0]) + " x " +
                              std::to_string(size[1]) +
                              " cannot be rendered; it is not written. Author one from 1 to " +
                              std::to_string(kLargestSide) + ".");
            return false;
        }
        ProductSpec spec;
        readProductAttributes(product, spec, diagnostics_);
        std::error_code ignored; // a path that cannot be resolved is compared as it is
        const auto whole = std::filesystem::weakly_canonical(spec.path, ignored);
        const auto [first, isNew] = productOfPath_.emplace(ignored ? spec.path : whole.string(),
                                                           product.productPath.GetString());
        if (!isNew) {
            fail(product, "its productName " + spec.path + " is that of " + first->second +
                              " too; only that one is written. Give each product a file of its "
                              "own.");
            sameFile_ = true;
            return false;
        }
        if (!readVars(product, spec)) {
            return false;
        }
        ProductView* const view = findView(product);
        if (view == nullptr) {
            return false;
        }
        addToFilm(*view, spec);
        view->products.push_back(std::move(spec));
        return true;
    }

    bool readVars(const Product& product, ProductSpec& spec) {
        for (const auto& var : product.renderVars) {
            Result<ProductLayer> layer = translateVar(var);
            if (layer) {
                spec.layers.push_back(std::move(layer.value()));
            } else {
                plan_.errors.push_back(layer.error());
            }
        }
        if (!spec.layers.empty() || isDeep(product)) {
            return true;
        }
        fail(product, "it has no render var that can be made; it is not written. Add a RenderVar "
                      "such as color to orderedVars.");
        return false;
    }

    /// The film to use, made where there is none; null, with an error, where there can be none.
    ProductView* findView(const Product& product) {
        const std::string key = viewKey(product);
        const auto known = viewOfKey_.find(key);
        if (known == viewOfKey_.end()) {
            if (!makeView(product)) {
                return nullptr;
            }
            viewOfKey_[key] = plan_.views.size() - 1;
        }
        return &plan_.views[viewOfKey_[key]];
    }

    bool makeView(const Product& product) {
        const auto* const camera =
            dynamic_cast<const HdCamera*>(index_.GetSprim(tokens().camera, product.cameraPath));
        if (product.cameraPath.IsEmpty() || camera == nullptr) {
            fail(product,
                 (product.cameraPath.IsEmpty()
                      ? std::string("it names no camera")
                      : "its camera " + product.cameraPath.GetString() + " does not exist") +
                     "; it is not written. Point the camera relationship of the "
                     "product or of the render settings at a camera.");
            return false;
        }
        ProductView view;
        view.cameraPath = product.cameraPath.GetString();
        view.film.window = imageWindow(product, *camera, diagnostics_);
        view.film.samplesPerPixel = options_.samplesPerPixel;
        view.film.aovs = {tokens().color.GetString()};
        CameraRequest request;
        request.imageAspect = static_cast<double>(view.film.window.width) *
                              view.film.window.pixelAspectRatio / view.film.window.height;
        request.conform = conformPolicy(product.aspectRatioConformPolicy);
        request.depthOfField = !product.disableDepthOfField;
        request.exposure = exposure_;
        view.camera = translateCamera(*camera, request, diagnostics_);
        plan_.views.push_back(std::move(view));
        return true;
    }

    static void addToFilm(ProductView& view, const ProductSpec& spec) {
        std::vector<std::string>& aovs = view.film.aovs;
        for (const ProductLayer& layer : spec.layers) {
            if (std::find(aovs.begin(), aovs.end(), layer.aov) == aovs.end()) {
                aovs.push_back(layer.aov);
            }
        }
        view.film.keepPathSamples = view.film.keepPathSamples || spec.deep;
        view.film.extendedPathSamples =
            view.film.keepPathSamples && std::any_of(aovs.begin(), aovs.end(), isExtendedAov);
    }

    std::map<std::string, std::string> productOfPath_; ///< file to the prim that writes it
    bool sameFile_ = false;                            ///< the product at hand names another's file
    HdRenderIndex& index_;
    const RenderOptions& options_;
    bool exposure_;
    Diagnostics& diagnostics_;
    ProductPlan plan_;
    std::map<std::string, std::size_t> viewOfKey_;
};

} // namespace

ProductPlan planProducts(const HdRenderSettings::RenderProducts& products, HdRenderIndex& index,
                         const RenderOptions& options, bool exposure, Diagnostics& diagnostics) {
    return Planner(index, options, exposure, diagnostics).plan(products);
}

std::shared_ptr<Film> createFilm(ProductView& view, std::size_t pathSampleLimit,
                                 ProductPlan& plan) {
    std::vector<ProductSpec>& products = view.products;
    const auto drop = [&](const Error& error, bool deepAlone) {
        const auto lost =
            std::stable_partition(products.begin(), products.end(),
                                  [&](const ProductSpec& p) { return deepAlone && !p.deep; });
        for (auto product = lost; product != products.end(); ++product) {
            plan.errors.push_back({product->primPath, "it is not written. " + error.text});
            plan.staleFiles.push_back(product->path);
        }
        products.erase(lost, products.end());
    };
    while (!products.empty()) {
        Result<std::shared_ptr<Film>> film = Film::create(view.film, pathSampleLimit);
        if (film) {
            return film.value();
        }
        if (view.film.denoise) {
            // Rather the raw image than none.
            plan.errors.push_back(
                {film.error().subject, film.error().text + " The image stays as it is rendered."});
            view.film.denoise = nullptr;
            continue;
        }
        drop(film.error(), view.film.keepPathSamples);
        view.film.keepPathSamples = view.film.extendedPathSamples = false;
    }
    return nullptr;
}

std::vector<std::string> primvarsOfProducts(const HdRenderSettings::RenderProducts& products) {
    std::vector<std::string> names;
    for (const Product& product : products) {
        for (const auto& var : product.renderVars) {
            const std::string name = primvarOfAov(aovOfVar(var));
            if (!name.empty()) {
                names.push_back(name);
            }
        }
    }
    return names;
}

} // namespace mbfeat
