#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "scene/takenEffects.h"

namespace mbfeat {

namespace {

bool isFinite(const Double3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool isFinite(const AffineD& m) {
    return isFinite(m.x) && isFinite(m.y) && isFinite(m.z) && isFinite(m.t);
}

/// False for transforms that flatten: their determinant is nothing beside what rows of these
/// lengths can give.
bool isInvertible(const AffineD& m) {
    constexpr double kFlat = 1e-12;
    const double volume = length(m.x) * length(m.y) * length(m.z);
    return volume > 0.0 && std::isfinite(volume) && std::abs(m.determinant()) > kFlat * volume;
}

bool isEqual(const AffineD& a, const AffineD& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.t == b.t;
}

bool isEqual(const std::vector<AffineD>& a, const std::vector<AffineD>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const AffineD& m, const AffineD& n) { return isEqual(m, n); });
}

/// Drops transforms that cannot be used.
void cleanTransforms(Geometry& geometry, Diagnostics& diagnostics) {
    const std::size_t count = geometry.transforms.size();
    if (!geometry.instanceIds.empty() && geometry.instanceIds.size() != count) {
        diagnostics.warn(geometry.path, "has " + std::to_string(geometry.instanceIds.size()) +
                                            " instance ids for " + std::to_string(count) +
                                            " instances; instances are numbered instead");
        geometry.instanceIds.clear();
    }
    const auto isGood = [](const AffineD& m) { return isFinite(m) && isInvertible(m); };
    if (std::all_of(geometry.transforms.begin(), geometry.transforms.end(), isGood)) {
        return;
    }
    std::vector<AffineD> transforms;
    std::vector<std::int32_t> ids;
    for (std::size_t i = 0; i < count; ++i) {
        if (isGood(geometry.transforms[i])) {
            transforms.push_back(geometry.transforms[i]);
            ids.push_back(geometry.instanceIds.empty() ? static_cast<std::int32_t>(i)
                                                       : geometry.instanceIds[i]);
        }
    }
    diagnostics.warn(geometry.path,
                     std::to_string(count - transforms.size()) + " of " + std::to_string(count) +
                         " transforms are not finite or not invertible (a scale of zero?); what "
                         "they place is not rendered");
    geometry.transforms = std::move(transforms);
    geometry.instanceIds = std::move(ids);
}

/// Makes every slot that the mesh uses exist.
void cleanSlots(Geometry& geometry, Diagnostics& diagnostics) {
    std::uint16_t last = 0;
    if (geometry.mesh) {
        for (const std::uint16_t slot : geometry.mesh->triangleMaterials) {
            last = std::max(last, slot);
        }
    }
    const std::size_t needed = std::size_t(last) + 1;
    if (geometry.materials.size() < needed) {
        if (!geometry.materials.empty()) {
            diagnostics.warn(geometry.path,
                             "has triangles in material slot " + std::to_string(last) +
                                 ", but only " + std::to_string(geometry.materials.size()) +
                                 " materials; the default material is used for the others");
        }
        geometry.materials.resize(needed);
    }
}

std::shared_ptr<const Material> makeDefaultMaterial() {
    auto material = std::make_shared<Material>();
    material->diffuseColor.source = MaterialInput::Source::kPrimvar;
    material->diffuseColor.primvar = "displayColor";
    return material;
}

/// For each texture of the material whether an input that is rendered reads it.
std::vector<bool> texturesInUse(const Material& m) {
    std::vector<bool> used(m.textures.size(), false);
    for (const MaterialInput* input :
         {&m.diffuseColor, &m.emissiveColor, &m.specularColor, &m.metallic, &m.roughness,
          &m.clearcoat, &m.clearcoatRoughness, &m.opacity, &m.opacityThreshold, &m.ior,
          &m.normal}) {
        if (input->source == MaterialInput::Source::kTexture && input->texture >= 0 &&
            static_cast<std::size_t>(input->texture) < used.size()) {
            used[static_cast<std::size_t>(input->texture)] = true;
        }
    }
    return used;
}

bool readsTexture(const Light& light) {
    return light.hasTexture && (light.type == LightType::kRect || light.type == LightType::kDome);
}

/// True when consumers must rebuild what they made of the geometry's mesh.
bool meshDiffers(const Geometry& before, const Geometry& after) {
    return before.mesh != after.mesh || before.instanced != after.instanced ||
           (!after.instanced && !isEqual(before.transforms, after.transforms));
}

bool placementDiffers(const Geometry& before, const Geometry& after) {
    return before.primId != after.primId || before.instanceIds != after.instanceIds ||
           !isEqual(before.transforms, after.transforms);
}

} // namespace

Scene::Scene(Diagnostics& diagnostics)
    : diagnostics_(diagnostics),
      bindingMessages_(diagnostics),
      textures_(diagnostics) {
    materials_.push_back(makeDefaultMaterial());
}

Scene::~Scene() = default;

void Scene::setGeometry(Geometry geometry, Diagnostics& messages) {
    cleanTransforms(geometry, messages);
    cleanSlots(geometry, messages);
    auto shared = std::make_shared<const Geometry>(std::move(geometry));
    const std::lock_guard lock(mutex_);
    geometryByPath_[shared->path] = shared;
    ++version_;
}

void Scene::removeGeometry(const std::string& path) {
    const std::lock_guard lock(mutex_);
    version_ += geometryByPath_.erase(path);
}

void Scene::setMaterial(Material material) {
    auto shared = std::make_shared<const Material>(std::move(material));
    const std::lock_guard lock(mutex_);
    materialByPath_[shared->path] = shared;
    ++version_;
}

void Scene::removeMaterial(const std::string& path) {
    const std::lock_guard lock(mutex_);
    version_ += materialByPath_.erase(path);
}

void Scene::setLight(Light light, Diagnostics& messages) {
    if (!isFinite(light.toWorld) || !isInvertible(light.toWorld)) {
        messages.warn(light.path, "has a transform that is not finite or not invertible (a "
                                  "scale of zero?); the light is off");
        light.radiance = Rgb(0.0F);
        light.toWorld = AffineD();
    } else if (!mbfeat::isFinite(light.radiance)) {
        messages.warn(light.path, "has a color, intensity or exposure that is not finite; the "
                                  "light is off");
        light.radiance = Rgb(0.0F);
    }
    auto shared = std::make_shared<const Light>(std::move(light));
    const std::lock_guard lock(mutex_);
    lightByPath_[shared->path] = shared;
    ++version_;
}

void Scene::removeLight(const std::string& path) {
    const std::lock_guard lock(mutex_);
    version_ += lightByPath_.erase(path);
}

void Scene::setRenderingColorSpace(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (name == renderingSpace_) {
        return;
    }
    renderingSpace_ = name;
    textures_.setRenderingColorSpace(name);
    textures_.clear();
    resolvedMaterials_.clear();
    resolvedLights_.clear();
    ++version_;
}

void Scene::takeEffects(EffectSet taken) {
    const std::lock_guard lock(mutex_);
    if (taken == taken_) {
        return;
    }
    taken_ = taken;
    resolvedMaterials_.clear();
    for (auto& [path, light] : resolvedLights_) {
        light.source = nullptr; // to be made anew, but its image is held until then
    }
    ++version_;
}

std::uint64_t Scene::version() const {
    const std::lock_guard lock(mutex_);
    return version_;
}

std::vector<CommittedGeometry> Scene::gatherGeometries() const {
    std::map<std::string, const Geometry*> before;
    for (const CommittedGeometry& geometry : geometries_) {
        before.emplace(geometry.source->path, geometry.source.get());
    }
    std::vector<CommittedGeometry> gathered;
    for (const auto& [path, geometry] : geometryByPath_) {
        if (!geometry->visible || !geometry->mesh || geometry->mesh->triangles.empty() ||
            geometry->transforms.empty()) {
            continue;
        }
        const auto old = before.find(path);
        const bool changed = old == before.end() || (old->second != geometry.get() &&
                                                     meshDiffers(*old->second, *geometry));
        gathered.push_back({geometry, {}, changed});
    }
    return gathered;
}

/// Fills the geometries' material indices; returns the paths behind them, "" being the default.
std::vector<std::string> Scene::bindMaterials(std::vector<CommittedGeometry>& geometries) {
    bindingMessages_.withdraw();
    std::map<std::string, std::uint32_t> indices;
    for (const CommittedGeometry& geometry : geometries) {
        for (const std::string& path : geometry.source->materials) {
            if (!path.empty() && materialByPath_.count(path) != 0) {
                indices.emplace(path, 0);
            } else if (!path.empty()) {
                bindingMessages_.warn(geometry.source->path,
                                      "is bound to the material " + path +
                                          ", which does not exist or cannot be used; the default "
                                          "material is used instead");
            }
        }
    }
    std::vector<std::string> paths{std::string()};
    for (auto& [path, index] : indices) {
        index = static_cast<std::uint32_t>(paths.size());
        paths.push_back(path);
    }
    for (CommittedGeometry& geometry : geometries) {
        for (const std::string& path : geometry.source->materials) {
            const auto found = indices.find(path);
            geometry.materials.push_back(found == indices.end() ? 0U : found->second);
        }
    }
    return paths;
}

/// Loads what new materials and lights ask for, each image once, in parallel.
Scene::Images Scene::loadImages(const std::vector<std::string>& materialPaths) {
    std::map<ImageKey, std::string> wanted; // with the first prim that asks, for messages
    for (const std::string& path : materialPaths) {
        const auto material = materialByPath_.find(path);
        if (path.empty() || resolvedMaterials_[path].source == material->second) {
            continue;
        }
        const std::vector<bool> used = texturesInUse(*material->second);
        for (std::size_t i = 0; i < used.size(); ++i) {
            if (used[i]) {
                wanted.emplace(material->second->textures[i].image, path);
            }
        }
    }
    for (const auto& [path, light] : lightByPath_) {
        if (readsTexture(*light) && resolvedLights_[path].source != light) {
            wanted.emplace(light->texture, path);
        }
    }
    const std::vector<std::pair<ImageKey, std::string>> list(wanted.begin(), wanted.end());
    std::vector<std::shared_ptr<const Image>> loaded(list.size());
    // Isolated: a waiting thread must not pick up foreign work that would want our lock.
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(std::size_t(0), list.size(), [&](std::size_t i) {
            loaded[i] = textures_.get(list[i].first, list[i].second);
        });
    });
    Images images;
    for (std::size_t i = 0; i < list.size(); ++i) {
        images.emplace(list[i].first, std::move(loaded[i]));
    }
    return images;
}

void Scene::resolveMaterials(const std::vector<std::string>& paths, const Images& images) {
    materials_.resize(1);
    std::map<std::string, Resolved<Material>> resolved;
    for (const std::string& path : paths) {
        if (path.empty()) {
            continue;
        }
        const std::shared_ptr<const Material>& source = materialByPath_.at(path);
        Resolved<Material> entry = resolvedMaterials_[path];
        if (entry.source != source) {
            auto material = std::make_shared<Material>(*source);
            const std::vector<bool> used = texturesInUse(*source);
            material->images.assign(used.size(), nullptr);
            for (std::size_t i = 0; i < used.size(); ++i) {
                if (used[i]) {
                    material->images[i] = images.at(material->textures[i].image);
                }
            }
            takeEffectsFrom(*material, taken_);
            const std::vector<bool> read = texturesInUse(*material);
            for (std::size_t i = 0; i < read.size(); ++i) {
                if (!read[i]) {
                    material->images[i] = nullptr;
                }
            }
            entry = {source, std::move(material)};
        }
        materials_.push_back(entry.resolved);
        resolved.emplace(path, std::move(entry));
    }
    resolvedMaterials_ = std::move(resolved);
}

void Scene::resolveLights(const Images& images) {
    lights_.clear();
    std::map<std::string, Resolved<Light>> resolved;
    for (const auto& [path, source] : lightByPath_) {
        Resolved<Light> entry = resolvedLights_[path];
        if (entry.source != source) {
            auto light = std::make_shared<Light>(*source);
            light->image = readsTexture(*source) ? images.at(source->texture) : nullptr;
            takeEffectsFrom(*light, taken_);
            entry = {source, std::move(light)};
        }
        if (!isTakenAway(*source, taken_)) {
            lights_.push_back(entry.resolved);
        }
        resolved.emplace(path, std::move(entry));
    }
    resolvedLights_ = std::move(resolved);
}

/// So that what is wrong with an image is no problem of a scene that reads it no more.
void Scene::releaseUnusedImages() {
    std::set<ImageKey> used;
    for (const std::shared_ptr<const Material>& material : materials_) {
        const std::vector<bool> read = texturesInUse(*material);
        for (std::size_t i = 0; i < read.size(); ++i) {
            if (read[i]) {
                used.insert(material->textures[i].image);
            }
        }
    }
    // Those taken away, too: they come back when the effect does.
    for (const auto& [path, light] : lightByPath_) {
        if (readsTexture(*light)) {
            used.insert(light->texture);
        }
    }
    textures_.releaseOthers(used);
}

SceneChanges Scene::commit() {
    const std::lock_guard lock(mutex_);
    if (version_ == committedVersion_) {
        for (CommittedGeometry& geometry : geometries_) {
            geometry.meshChanged = false;
        }
        return {};
    }
    std::vector<CommittedGeometry> gathered = gatherGeometries();
    const std::vector<std::string> paths = bindMaterials(gathered);
    const Images images = loadImages(paths);
    const auto oldMaterials = materials_;
    const auto oldLights = lights_;
    resolveMaterials(paths, images);
    resolveLights(images);
    releaseUnusedImages();

    SceneChanges changes;
    changes.materials = materials_ != oldMaterials;
    changes.lights = lights_ != oldLights;
    changes.geometry = gathered.size() != geometries_.size();
    for (std::size_t i = 0; i < gathered.size() && i < geometries_.size(); ++i) {
        const CommittedGeometry& before = geometries_[i];
        const CommittedGeometry& after = gathered[i];
        changes.geometry = changes.geometry || after.meshChanged ||
                           before.source->path != after.source->path ||
                           placementDiffers(*before.source, *after.source);
        changes.materials = changes.materials || before.materials != after.materials;
    }
    geometries_ = std::move(gathered);
    if (updateOrigin()) {
        changes.geometry = true;
        for (CommittedGeometry& geometry : geometries_) {
            geometry.meshChanged = geometry.meshChanged || !geometry.source->instanced;
        }
    }
    committedVersion_ = version_;
    return changes;
}

const Scene::Box& Scene::boundsOf(const std::shared_ptr<const Mesh>& mesh) {
    const auto known = meshBounds_.find(mesh);
    if (known != meshBounds_.end()) {
        return known->second;
    }
    Float3 lower = mesh->points[mesh->triangles.front().v[0]];
    Float3 upper = lower;
    for (const Triangle& triangle : mesh->triangles) {
        for (const std::uint32_t v : triangle.v) {
            const Float3& p = mesh->points[v];
            lower = {min(lower.x, p.x), min(lower.y, p.y), min(lower.z, p.z)};
            upper = {max(upper.x, p.x), max(upper.y, p.y), max(upper.z, p.z)};
        }
    }
    return meshBounds_.emplace(mesh, Box{Double3(lower), Double3(upper)}).first->second;
}

/// Moves the origin to the snapped centre of the world bounds, unless the old one still serves.
bool Scene::updateOrigin() {
    for (auto it = meshBounds_.begin(); it != meshBounds_.end();) {
        it = it->first.expired() ? meshBounds_.erase(it) : std::next(it);
    }
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Box world{Double3(kInfinity), Double3(-kInfinity)};
    for (const CommittedGeometry& geometry : geometries_) {
        const Box& box = boundsOf(geometry.source->mesh);
        for (const AffineD& transform : geometry.source->transforms) {
            for (int corner = 0; corner < 8; ++corner) {
                const Double3 p = transform.point({(corner & 1) ? box.upper.x : box.lower.x,
                                                   (corner & 2) ? box.upper.y : box.lower.y,
                                                   (corner & 4) ? box.upper.z : box.lower.z});
                for (int axis = 0; axis < 3; ++axis) {
                    world.lower[axis] = min(world.lower[axis], p[axis]);
                    world.upper[axis] = max(world.upper[axis], p[axis]);
                }
            }
        }
    }
    const Double3 size = world.upper - world.lower;
    const double extent = maxComponent(size);
    if (!(extent > 0.0) || !isFinite(size)) {
        return false;
    }
    // The cell is at most a quarter of the extent, so snapping moves the centre by at most an
    // eighth; a new origin is due only when the old one is a quarter away.
    const double cell = std::exp2(std::floor(std::log2(0.25 * extent)));
    const Double3 centre = world.lower + size * 0.5;
    const Double3 offset = abs(centre - origin_);
    if (maxComponent(offset) <= 0.25 * extent) {
        return false;
    }
    const Double3 snapped{std::round(centre.x / cell) * cell, std::round(centre.y / cell) * cell,
                          std::round(centre.z / cell) * cell};
    if (!isFinite(snapped) || snapped == origin_) {
        return false;
    }
    origin_ = snapped;
    return true;
}

} // namespace mbfeat
