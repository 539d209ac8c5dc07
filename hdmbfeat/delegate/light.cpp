#include "delegate/light.h"

#include <cmath>

#include "delegate/conversions.h"
#include "delegate/guard.h"
#include "delegate/instancer.h"
#include "delegate/renderParam.h"
#include "delegate/values.h"
#include "pxr/imaging/hd/renderIndex.h"
#include "pxr/imaging/hd/sceneDelegate.h"
#include "scene/blackbody.h"

namespace mbfeat {

namespace {

/// Light parameters by their UsdLux names without "inputs:"; hosts use names with and without it.
class LightParameters {
public:
    LightParameters(HdSceneDelegate* delegate, const SdfPath& id) : delegate_(delegate), id_(id) {}

    VtValue get(const std::string& name) const {
        VtValue value = delegate_->GetLightParamValue(id_, TfToken(name));
        return value.IsEmpty() ? delegate_->GetLightParamValue(id_, TfToken("inputs:" + name))
                               : value;
    }
    float number(const std::string& name, float fallback) const {
        return asFloat(get(name), fallback);
    }
    bool flag(const std::string& name, bool fallback) const { return asBool(get(name), fallback); }
    Rgb color(const std::string& name, const Rgb& fallback) const {
        return asFloat3(get(name)).value_or(fallback);
    }
    std::string text(const std::string& name) const { return asText(get(name)).value_or(""); }

private:
    HdSceneDelegate* delegate_;
    const SdfPath& id_;
};

Rgb radianceOf(const LightParameters& parameters) {
    Rgb radiance = parameters.color("color", Rgb(1.0F)) * parameters.number("intensity", 1.0F) *
                   std::exp2(parameters.number("exposure", 0.0F));
    if (parameters.flag("enableColorTemperature", false)) {
        radiance = radiance * blackbodyColor(parameters.number("colorTemperature", 6500.0F));
    }
    return radiance;
}

void readShape(const LightParameters& parameters, Light& light) {
    light.width = parameters.number("width", light.width);
    light.height = parameters.number("height", light.height);
    light.radius = parameters.number("radius", light.radius);
    light.length = parameters.number("length", light.length);
    light.angle = parameters.number("angle", light.angle);
    light.treatAsPoint = parameters.flag("treatAsPoint", false);
    light.treatAsLine = parameters.flag("treatAsLine", false);
}

void readShaping(const LightParameters& parameters, LightShaping& shaping) {
    shaping.focus = parameters.number("shaping:focus", shaping.focus);
    shaping.focusTint = parameters.color("shaping:focusTint", shaping.focusTint);
    shaping.coneAngle = parameters.number("shaping:cone:angle", shaping.coneAngle);
    shaping.coneSoftness = parameters.number("shaping:cone:softness", shaping.coneSoftness);
}

/// A value of the wrong kind would spoil the light's table: say so and use something harmless.
void sanitize(Light& light, Diagnostics& diagnostics) {
    const auto repair = [&](float& value, float fallback, const char* name) {
        if (!std::isfinite(value) || value < 0.0F) {
            diagnostics.warn(light.path, std::string(name) + " is " + std::to_string(value) + "; " +
                                             std::to_string(fallback) +
                                             " is used. Author a finite value of at least 0.");
            value = fallback;
        }
    };
    repair(light.width, 1.0F, "width");
    repair(light.height, 1.0F, "height");
    repair(light.radius, 0.5F, "radius");
    repair(light.length, 1.0F, "length");
    repair(light.angle, 0.53F, "angle");
    for (int axis = 0; axis < 3; ++axis) {
        repair(light.radiance[axis], 0.0F, "color times intensity");
    }
}

/// What is authored but changes nothing here. A link of everything has an empty category.
void reportIgnored(const LightParameters& parameters, Diagnostics& diagnostics,
                   const std::string& path) {
    const auto report = [&](const char* what, const char* effect) {
        diagnostics.warn(path, std::string(what) + " not supported; " + effect + ".");
    };
    if (!parameters.text("lightLink").empty()) {
        report("light linking is", "it lights everything");
    }
    if (!parameters.text("shadowLink").empty()) {
        report("shadow linking is", "everything casts its shadows");
    }
    const VtValue filters = parameters.get("filters");
    if (filters.IsHolding<SdfPathVector>() && !filters.UncheckedGet<SdfPathVector>().empty()) {
        report("light filters are", "its light is not filtered");
    }
    if (!parameters.text("shaping:ies:file").empty()) {
        report("IES profiles are", "its light is shaped by its cone and focus alone");
    }
}

/// A host without lights in the scene puts its head light at <task>/lights/light_N, below a root
/// of its own that starts with an underscore.
bool isHostLight(const SdfPath& id) {
    const std::string& path = id.GetString();
    return id.GetName().rfind("light_", 0) == 0 && id.GetParentPath().GetName() == "lights" &&
           path.rfind("/_", 0) == 0;
}

} // namespace

LightPrim::LightPrim(const SdfPath& id, LightType type, RenderParam& param)
    : HdLight(id),
      type_(type),
      param_(param),
      messages_(param.diagnostics()) {
    param_.registerLight(this);
}

LightPrim::~LightPrim() {
    param_.unregisterLight(this);
}

void LightPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* /*renderParam*/,
                     HdDirtyBits* dirtyBits) {
    guarded(messages_, GetId().GetString(), [&] { syncPrim(delegate, dirtyBits); });
    *dirtyBits = Clean;
}

std::vector<AffineD> LightPrim::computeTransforms(HdSceneDelegate* delegate) const {
    const AffineD local = toAffine(delegate->GetTransform(GetId()));
    if (GetInstancerId().IsEmpty()) {
        return {local};
    }
    HdRenderIndex& index = delegate->GetRenderIndex();
    HdInstancer::_SyncInstancerAndParents(index, GetInstancerId());
    std::vector<AffineD> transforms;
    if (const auto* const instancer =
            dynamic_cast<InstancerPrim*>(index.GetInstancer(GetInstancerId()))) {
        transforms = instancer->computeTransforms(GetId());
    }
    for (AffineD& transform : transforms) {
        transform = concatenate(local, transform);
    }
    return transforms;
}

bool LightPrim::isVisibleToCamera() const {
    return type_ != LightType::kDome || param_.settings().isDomeVisible();
}

void LightPrim::removePublished() {
    if (published_.empty()) {
        return;
    }
    Scene& scene = param_.acquireSceneForEdit();
    for (const Light& light : published_) {
        scene.removeLight(light.path);
    }
    published_.clear();
}

void LightPrim::updateDomeVisibility() {
    for (Light& light : published_) {
        if (light.visibleToCamera != isVisibleToCamera()) {
            light.visibleToCamera = isVisibleToCamera();
            param_.acquireSceneForEdit().setLight(light, messages_);
        }
    }
}

void LightPrim::syncPrim(HdSceneDelegate* delegate, HdDirtyBits* dirtyBits) {
    param_.acquireSceneForEdit(); // no job counts messages while they change
    messages_.withdraw();
    _UpdateInstancer(delegate, dirtyBits);
    removePublished();
    if (!delegate->GetVisible(GetId())) {
        return;
    }
    const LightParameters parameters(delegate, GetId());
    Light light;
    light.path = GetId().GetString();
    light.type = type_;
    light.radiance = radianceOf(parameters);
    light.diffuse = parameters.number("diffuse", 1.0F);
    light.specular = parameters.number("specular", 1.0F);
    light.normalize = parameters.flag("normalize", false);
    readShape(parameters, light);
    readShaping(parameters, light.shaping);
    light.texture.path = parameters.text("texture:file");
    light.hasTexture =
        !light.texture.path.empty() && (type_ == LightType::kDome || type_ == LightType::kRect);
    light.visibleToCamera = isVisibleToCamera();
    light.isCameraLight = isHostLight(GetId());
    // What stands behind the camera should not darken what it looks at.
    light.castsShadows = !light.isCameraLight && parameters.flag("shadow:enable", true);
    sanitize(light, messages_);
    reportIgnored(parameters, messages_, light.path);

    std::vector<AffineD> transforms = computeTransforms(delegate);
    const VtValue offset = parameters.get("domeOffset");
    for (std::size_t i = 0; i < transforms.size(); ++i) {
        Light instance = light;
        instance.toWorld =
            offset.IsHolding<GfMatrix4d>()
                ? concatenate(toAffine(offset.UncheckedGet<GfMatrix4d>()), transforms[i])
                : transforms[i];
        if (!isFinite(instance.toWorld) || instance.toWorld.determinant() == 0.0) {
            messages_.warn(light.path, "its transform is singular or not finite; it gives no "
                                       "light. Author scales that are not zero.");
            continue;
        }
        if (!GetInstancerId().IsEmpty()) {
            instance.path += "[" + std::to_string(i) + "]";
        }
        published_.push_back(instance);
        param_.acquireSceneForEdit().setLight(std::move(instance), messages_);
    }
}

void LightPrim::Finalize(HdRenderParam* renderParam) {
    removePublished();
    HdLight::Finalize(renderParam);
}

} // namespace mbfeat
