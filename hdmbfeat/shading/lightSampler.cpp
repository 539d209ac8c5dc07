#include "shading/lightSampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/overloaded.h"
#include "shading/lightBounds.h"
#include "shading/lightChoice.h"
#include "shading/lightLanes.h"
#include "shading/preparedLight.h"

namespace mbfeat {

namespace {

void takePlace(LightSample& out, const ShapeSample<float>& s) {
    out.wi = s.wi;
    out.distance = s.distance;
    out.pdf = s.pdf;
    out.point = s.point;
    out.normal = s.normal;
}

Facing<float> facingOf(const LightReceiver& receiver) {
    return {receiver.n, receiver.twoSided};
}

/// A sample of one light for the receiver; pdf without the choice.
LightSample sampleLight(const PreparedLight& light, const LightReceiver& receiver, Float2 u) {
    LightSample out;
    out.diffuse = light.diffuse;
    out.specular = light.specular;
    out.castsShadows = light.castsShadows;
    out.delta = light.isDelta();
    out.pointError = light.pointError;
    const LightLanes<float> s = sampleOnLanes<float>(light, receiver.p, facingOf(receiver), u);
    takePlace(out, s);
    out.radiance = s.radiance;
    if (light.shaping.isOn() || light.texture) {
        const bool isPoint = std::holds_alternative<PointEmitter>(light.emitter);
        out.radiance = light.emitted(s.uv, s.wi) / (isPoint ? sqr(s.distance) : 1.0F);
    }
    return out;
}

/// Density of a shape's sampling for the point that the unit direction wi meets; no choice.
float shapePdf(const PreparedLight& light, const Float3& p, const Float3& wi, const Float3& point) {
    return std::visit(Overloaded{
                          [&](const EllipsoidShape<float>& s) { return s.pdf(p, wi, point); },
                          [&](const RectShape<float>& s) { return s.pdf(p, point); },
                          [&](const DiskShape<float>& s) { return s.pdf(p, point); },
                          [&](const CylinderShape<float>& s) { return s.pdf(p, point); },
                          [](const auto&) { return 0.0F; },
                      },
                      light.emitter);
}

struct Surface {
    Float3 normal{0.0F};
    Float2 uv{0.0F, 0.0F};
};

Surface surfaceAt(const PreparedLight& light, const Float3& point) {
    return std::visit(Overloaded{
                          [&](const EllipsoidShape<float>& s) {
                              return Surface{s.normalAt(point), {0.0F, 0.0F}};
                          },
                          [&](const CylinderShape<float>& s) {
                              return Surface{s.normalAt(point), {0.0F, 0.0F}};
                          },
                          [&](const RectShape<float>& s) {
                              return Surface{s.normal, s.local(point)};
                          },
                          [&](const DiskShape<float>& s) {
                              return Surface{s.normal, s.local(point)};
                          },
                          [](const auto&) { return Surface{}; },
                      },
                      light.emitter);
}

bool isUsable(const EmissiveTriangle& t) {
    const float area = length(cross(t.p1 - t.p0, t.p2 - t.p0));
    return std::isfinite(area) && area > std::numeric_limits<float>::min() &&
           isFinite(t.radiance) && luminance(t.radiance) > 0.0F;
}

TriangleShape<float> shapeOf(const EmissiveTriangle& t) {
    return {t.p0, t.p1, t.p2, t.doubleSided};
}

} // namespace

struct LightSampler::Impl {
    std::vector<std::optional<PreparedLight>> lights; ///< by light index
    std::vector<std::uint32_t> lightEntry;            ///< light index to entry of the choice
    std::vector<std::uint32_t> entryLight;            ///< and back; triangles come after these
    std::vector<EmissiveTriangle> triangles;
    std::vector<std::uint32_t> triangleOfUser;       ///< by userId; kNoLight where there is none
    std::vector<std::uint32_t> shapes, environments; ///< light indices
    LightChoice choice;
    std::optional<LightPair> pair; ///< that of the choice, with indices of lights

    void prepare(const std::vector<std::shared_ptr<const Light>>& sources, const Double3& origin,
                 Diagnostics& diagnostics, bool cameraLights) {
        for (std::size_t i = 0; i < sources.size(); ++i) {
            if (sources[i] && sources[i]->isCameraLight == cameraLights) {
                lights[i] = prepareLight(*sources[i], origin, diagnostics);
            }
        }
    }

    bool anyLight() const {
        return std::any_of(lights.begin(), lights.end(),
                           [](const auto& light) { return light.has_value(); });
    }

    void indexTriangles() {
        std::size_t end = 0;
        for (const EmissiveTriangle& t : triangles) {
            end = std::max(end, std::size_t{t.userId} + 1);
        }
        triangleOfUser.assign(end, kNoLight);
        for (std::uint32_t i = 0; i < triangles.size(); ++i) {
            triangleOfUser[triangles[i].userId] = i;
        }
    }

    void buildChoice() {
        std::vector<LightBounds> bounds;
        bounds.reserve(lights.size() + triangles.size());
        lightEntry.assign(lights.size(), kNoLight);
        for (std::uint32_t i = 0; i < lights.size(); ++i) {
            if (!lights[i]) {
                continue;
            }
            lightEntry[i] = static_cast<std::uint32_t>(entryLight.size());
            entryLight.push_back(i);
            bounds.push_back(boundsOf(*lights[i]));
            if (lights[i]->isShape()) {
                shapes.push_back(i);
            } else if (lights[i]->isEnvironment()) {
                environments.push_back(i);
            }
        }
        for (const EmissiveTriangle& t : triangles) {
            bounds.push_back(boundsOf(t));
        }
        choice = LightChoice(std::move(bounds));
        if (choice.pair() != nullptr && triangles.empty()) {
            pair = *choice.pair();
            pair->localEntry = entryLight[pair->localEntry];
            pair->infiniteEntry = entryLight[pair->infiniteEntry];
        }
    }
};

LightSampler::LightSampler() : impl_(std::make_unique<Impl>()) {}
LightSampler::~LightSampler() = default;
LightSampler::LightSampler(LightSampler&&) noexcept = default;
LightSampler& LightSampler::operator=(LightSampler&&) noexcept = default;

void LightSampler::commit(const std::vector<std::shared_ptr<const Light>>& lights,
                          const Double3& origin, float /*sceneRadius*/,
                          std::vector<EmissiveTriangle> triangles, Diagnostics& diagnostics) {
    auto next = std::make_unique<Impl>();
    next->lights.resize(lights.size());
    triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                   [](const EmissiveTriangle& t) { return !isUsable(t); }),
                    triangles.end());
    next->triangles = std::move(triangles);
    next->indexTriangles();
    next->prepare(lights, origin, diagnostics, false);
    if (!next->anyLight() && next->triangles.empty()) {
        next->prepare(lights, origin, diagnostics, true);
    }
    next->buildChoice();
    impl_ = std::move(next);
}

bool LightSampler::empty() const {
    return impl_->choice.empty();
}

std::size_t LightSampler::activeLightCount() const {
    return impl_->entryLight.size();
}

std::size_t LightSampler::choiceCount() const {
    return impl_->entryLight.size() + impl_->triangles.size();
}

std::uint32_t LightSampler::onlyLight() const {
    return choiceCount() == 1 && !impl_->entryLight.empty() ? impl_->entryLight.front() : kNoLight;
}

bool LightSampler::isActive(std::uint32_t light) const {
    return light < impl_->lights.size() && impl_->lights[light].has_value();
}

void LightSampler::pick(const LightReceiver* receivers, const float* uLight, int count,
                        LightPick* picks) const {
    if (impl_->choice.empty()) {
        std::fill(picks, picks + count, LightPick());
        return;
    }
    LightChoice::Pick chosen[LightChoice::kMostAtOnce];
    impl_->choice.sample(receivers, uLight, count, chosen);
    for (int i = 0; i < count; ++i) {
        picks[i] = {};
        if (!(chosen[i].probability > 0.0F)) {
            continue;
        }
        picks[i].probability = chosen[i].probability;
        if (chosen[i].entry < impl_->entryLight.size()) {
            picks[i].light = impl_->entryLight[chosen[i].entry];
        } else {
            picks[i].triangle =
                chosen[i].entry - static_cast<std::uint32_t>(impl_->entryLight.size());
        }
    }
}

LightSample LightSampler::sample(const LightReceiver& receiver, const LightPick& pick,
                                 Float2 u) const {
    LightSample out;
    if (!(pick.probability > 0.0F)) {
        return out;
    }
    if (pick.light != kNoLight) {
        out = sampleLight(*impl_->lights[pick.light], receiver, u);
        out.light = pick.light;
    } else {
        const EmissiveTriangle& triangle = impl_->triangles[pick.triangle];
        const ShapeSample<float> s = shapeOf(triangle).sample(receiver.p, u);
        takePlace(out, s);
        out.pointError = (abs(triangle.p0) + abs(triangle.p1) + abs(triangle.p2)) *
                         (4.0F * std::numeric_limits<float>::epsilon());
        out.radiance = triangle.radiance;
        out.triangle = triangle.userId;
        out.b1 = s.uv.x;
        out.b2 = s.uv.y;
    }
    out.pdf = usablePdf<float>(out.pdf * pick.probability, out.wi, out.radiance, receiver.n,
                               receiver.twoSided);
    return out;
}

LightSample LightSampler::sample(const LightReceiver& receiver, float uLight, Float2 u) const {
    return sample(receiver, pick(receiver, uLight), u);
}

float LightSampler::choiceProbability(std::uint32_t light, const LightReceiver& receiver) const {
    return impl_->choice.probability(impl_->lightEntry[light], receiver);
}

const LightPair* LightSampler::pair() const {
    return impl_->pair ? &*impl_->pair : nullptr;
}

const PreparedLight& LightSampler::prepared(std::uint32_t light) const {
    return *impl_->lights[light];
}

float LightSampler::pdfTriangle(std::uint32_t userId, const LightReceiver& receiver,
                                const Float3& hit) const {
    const auto& table = impl_->triangleOfUser;
    const std::uint32_t index = userId < table.size() ? table[userId] : kNoLight;
    if (index == kNoLight) {
        return 0.0F;
    }
    const auto entry = static_cast<std::uint32_t>(impl_->entryLight.size()) + index;
    return impl_->choice.probability(entry, receiver) *
           shapeOf(impl_->triangles[index]).pdf(receiver.p, hit);
}

std::uint32_t LightSampler::shapeCount() const {
    return static_cast<std::uint32_t>(impl_->shapes.size());
}

std::uint32_t LightSampler::lightOfShape(std::uint32_t shape) const {
    return impl_->shapes[shape];
}

Bounds LightSampler::shapeBounds(std::uint32_t shape) const {
    return impl_->lights[impl_->shapes[shape]]->bounds;
}

float LightSampler::intersectShape(std::uint32_t shape, const Float3& origin,
                                   const Float3& direction, float tNear, float tFar) const {
    return intersectLight<float>(*impl_->lights[impl_->shapes[shape]], origin, direction, tNear,
                                 tFar);
}

LightHit LightSampler::evaluateHit(std::uint32_t light, const LightReceiver& receiver,
                                   const Float3& wi, float distance) const {
    LightHit hit;
    const PreparedLight& source = *impl_->lights[light];
    hit.point = receiver.p + wi * distance;
    const Surface surface = surfaceAt(source, hit.point);
    hit.normal = surface.normal;
    if (!(dot(wi, hit.normal) < 0.0F)) {
        return hit;
    }
    hit.radiance = source.emitted(surface.uv, wi);
    hit.pdf = choiceProbability(light, receiver) * shapePdf(source, receiver.p, wi, hit.point);
    if (!isFinite(hit.radiance) || !std::isfinite(hit.pdf)) {
        hit.radiance = Rgb(0.0F);
        hit.pdf = 0.0F;
    }
    return hit;
}

std::uint32_t LightSampler::environmentCount() const {
    return static_cast<std::uint32_t>(impl_->environments.size());
}

std::uint32_t LightSampler::lightOfEnvironment(std::uint32_t environment) const {
    return impl_->environments[environment];
}

Rgb LightSampler::environmentRadiance(std::uint32_t environment, const Float3& wi) const {
    return lookAtEnvironment<float>(*impl_->lights[impl_->environments[environment]], wi).value;
}

float LightSampler::environmentPdf(std::uint32_t environment, const LightReceiver& receiver,
                                   const Float3& wi) const {
    const std::uint32_t index = impl_->environments[environment];
    return choiceProbability(index, receiver) *
           lookAtEnvironment<float>(*impl_->lights[index], wi, facingOf(receiver)).pdf;
}

Rgb LightSampler::environmentRadiance(const Float3& wi, bool cameraRay) const {
    return radianceOfEnvironments<float>(*this, wi, cameraRay);
}

bool LightSampler::visibleToCamera(std::uint32_t light) const {
    return impl_->lights[light]->visibleToCamera;
}

bool LightSampler::castsShadows(std::uint32_t light) const {
    return impl_->lights[light]->castsShadows;
}

float LightSampler::diffuseMultiplier(std::uint32_t light) const {
    return impl_->lights[light]->diffuse;
}

float LightSampler::specularMultiplier(std::uint32_t light) const {
    return impl_->lights[light]->specular;
}

} // namespace mbfeat
