#include "integrate/accel.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/floatTraps.h"

namespace mbfeat {

namespace {

constexpr RTCFormat kAffineFormat = RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
static_assert(sizeof(AffineF) == 12 * sizeof(float), "an Affine is Embree's column-major 3x4");

void deviceError(void* diagnostics, RTCError code, const char* text) {
    if (code == RTC_ERROR_CANCELLED) {
        return; // an edit or the host stopped the build
    }
    static_cast<Diagnostics*>(diagnostics)
        ->error("Embree", "error " + std::to_string(static_cast<int>(code)) + ": " +
                              (text != nullptr ? text : "no text") +
                              "; what it was building is left out. Free memory, or report this.");
}

bool keepBuilding(void* stop, double /*fraction*/) {
    const StopCheck& shouldStop = *static_cast<const StopCheck*>(stop);
    return !shouldStop || !shouldStop();
}

bool stopRequested(const StopCheck& shouldStop) {
    return shouldStop && shouldStop();
}

/// Object to render space, with the large translations cancelled in double.
AffineF renderTransform(const AffineD& toWorld, const Double3& origin) {
    AffineD transform = toWorld;
    transform.t = transform.t - origin;
    return transform.as<float>();
}

bool sameTransforms(const std::vector<AffineD>& a, const std::vector<AffineD>& b) {
    return a.size() == b.size() &&
           std::equal(a.begin(), a.end(), b.begin(), [](const AffineD& p, const AffineD& q) {
               return p.x == q.x && p.y == q.y && p.z == q.z && p.t == q.t;
           });
}

/// Infinity norm of the linear part: the largest row sum of the column-vector matrix.
double linearNorm(const AffineD& m) {
    return maxComponent(abs(m.x) + abs(m.y) + abs(m.z));
}

RTCDevice newDevice() {
    const FloatTrapsMasked foreignCode; // for the threads that it starts, too
    return rtcNewDevice(nullptr);
}

void commitScene(RTCScene scene, const StopCheck& shouldStop) {
    const FloatTrapsMasked foreignCode;
    rtcSetSceneProgressMonitorFunction(scene, keepBuilding, const_cast<StopCheck*>(&shouldStop));
    rtcCommitScene(scene);
    rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
}

EmbreeGeometry triangleGeometry(RTCDevice device, const std::vector<Float3>& points,
                                const Mesh& mesh) {
    EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    // Shared buffers: Embree reads 16 bytes at the last point, so the vector has spare capacity.
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               points.data(), 0, sizeof(Float3), points.size());
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(Triangle), mesh.triangles.size());
    rtcSetGeometryBuildQuality(geometry.get(), RTC_BUILD_QUALITY_MEDIUM);
    const FloatTrapsMasked foreignCode;
    rtcCommitGeometry(geometry.get());
    return geometry;
}

} // namespace

Accel::Accel(Diagnostics& diagnostics)
    : diagnostics_(diagnostics),
      bindingMessages_(diagnostics),
      device_(newDevice()) {
    rtcSetDeviceErrorFunction(device_.get(), deviceError, &diagnostics_);
}

Accel::~Accel() = default;

EmbreeScene Accel::newScene() const {
    EmbreeScene scene(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene.get(), robust_ ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
    return scene;
}

void Accel::placeInstances(AccelGeometry& record) const {
    record.toRender.clear();
    record.instanceMirrored.clear();
    record.inverseError.clear();
    for (const AffineD& toWorld : record.source->transforms) {
        record.toRender.push_back(renderTransform(toWorld, origin_));
        record.instanceMirrored.push_back(toWorld.determinant() < 0.0 ? 1 : 0);
        constexpr double kRoundings = 6.0 * 0x1p-24;
        record.inverseError.push_back(
            static_cast<float>(kRoundings * linearNorm(toWorld) * linearNorm(toWorld.inverse())));
    }
}

std::unique_ptr<AccelGeometry> Accel::build(const CommittedGeometry& committed,
                                            const StopCheck& shouldStop) {
    auto record = std::make_unique<AccelGeometry>();
    record->source = committed.source;
    record->mesh = committed.source->mesh;
    record->instanced = committed.source->instanced;
    const Mesh& mesh = *record->mesh;
    if (record->instanced) {
        placeInstances(*record);
        record->prototype = newScene();
        record->geometry = triangleGeometry(device_.get(), mesh.points, mesh);
        rtcAttachGeometryByID(record->prototype.get(), record->geometry.get(), 0);
        commitScene(record->prototype.get(), shouldStop);
    } else {
        AffineD transform = committed.source->transforms.front();
        record->toRender.push_back(renderTransform(transform, origin_));
        record->mirrored = transform.determinant() < 0.0;
        transform.t = transform.t - origin_;
        record->bakedPoints.reserve(mesh.points.size() + 1);
        for (const Float3& p : mesh.points) {
            record->bakedPoints.emplace_back(Float3(transform.point(Double3(p))));
        }
        record->geometry = triangleGeometry(device_.get(), record->bakedPoints, mesh);
    }
    return record;
}

bool Accel::commit(const Scene& scene, bool robust, const StopCheck& shouldStop) {
    const bool originMoved = !(origin_ == scene.origin());
    const bool rebuildAll = robust != robust_;
    robust_ = robust;

    std::unordered_map<std::string, std::unique_ptr<AccelGeometry>> old;
    for (std::unique_ptr<AccelGeometry>& record : geometries_) {
        const std::string path = record->source->path;
        old.emplace(path, std::move(record));
    }
    geometries_.clear();
    origin_ = scene.origin();

    for (const CommittedGeometry& committed : scene.geometries()) {
        std::unique_ptr<AccelGeometry> record;
        if (const auto found = old.find(committed.source->path); found != old.end()) {
            record = std::move(found->second);
            old.erase(found);
        }
        const bool sameMesh = record && !rebuildAll && record->mesh == committed.source->mesh &&
                              record->instanced == committed.source->instanced;
        const bool samePlace =
            sameMesh && !originMoved &&
            sameTransforms(record->source->transforms, committed.source->transforms);
        if (samePlace) {
            record->source = committed.source;
        } else if (sameMesh && record->instanced) {
            // The prototype stays; only its instances move.
            ++builds_.placements;
            record->source = committed.source;
            placeInstances(*record);
        } else {
            ++builds_.meshes;
            record = build(committed, shouldStop);
            if (stopRequested(shouldStop)) {
                record.reset(); // its BVH may be half built
            }
        }
        if (stopRequested(shouldStop)) {
            // What was not reached is built by the next call; what was reached is kept.
            if (record) {
                geometries_.push_back(std::move(record));
            }
            for (auto& [path, unused] : old) {
                geometries_.push_back(std::move(unused));
            }
            return false;
        }
        geometries_.push_back(std::move(record));
    }
    bindMaterials(scene);
    updateBounds();
    return true;
}

void Accel::updateBounds() {
    bounds_ = Bounds();
    for (const std::unique_ptr<AccelGeometry>& record : geometries_) {
        if (!record->instanced) {
            for (const Float3& p : record->bakedPoints) {
                bounds_.add(p);
            }
            continue;
        }
        Bounds box;
        for (const Float3& p : record->mesh->points) {
            box.add(p);
        }
        for (const AffineF& toRender : record->toRender) {
            for (int corner = 0; corner < 8; ++corner) {
                bounds_.add(toRender.point({(corner & 1) != 0 ? box.lower.x : box.upper.x,
                                            (corner & 2) != 0 ? box.lower.y : box.upper.y,
                                            (corner & 4) != 0 ? box.lower.z : box.upper.z}));
            }
        }
    }
}

void Accel::bindMaterials(const Scene& scene) {
    ++builds_.bindings;
    bindingMessages_.withdraw();
    mayCutOut_ = false;
    triangles_ = 0;
    instances_ = 0;
    bindingCount_ = 0;
    for (std::size_t i = 0; i < geometries_.size(); ++i) {
        AccelGeometry& record = *geometries_[i];
        const CommittedGeometry& committed = scene.geometries()[i];
        record.source = committed.source;
        record.bindings.clear();
        record.materials.clear();
        record.firstBinding = static_cast<std::uint32_t>(bindingCount_);
        bindingCount_ += committed.materials.size();
        record.mayCutOut = false;
        record.emits = false;
        for (const std::uint32_t index : committed.materials) {
            record.materials.push_back(scene.materials()[index]);
            const Material& material = *record.materials.back();
            record.bindings.push_back(
                bindMaterial(material, *record.mesh, record.source->path, bindingMessages_));
            record.mayCutOut = record.mayCutOut || material.mayCutOut();
            record.emits = record.emits || material.emits();
        }
        mayCutOut_ = mayCutOut_ || record.mayCutOut;
        triangles_ += record.mesh->triangles.size();
        instances_ += record.instanced ? record.toRender.size() : 0;
    }
}

std::vector<EmissiveTriangle> Accel::collectEmissiveTriangles() {
    std::vector<EmissiveTriangle> triangles;
    emissive_.clear();
    for (std::size_t g = 0; g < geometries_.size(); ++g) {
        AccelGeometry& record = *geometries_[g];
        record.emissiveIndex.clear();
        record.emissiveCount = 0;
        if (!record.emits) {
            continue;
        }
        const Mesh& mesh = *record.mesh;
        std::vector<Rgb> radiance;
        record.emissiveIndex.assign(mesh.triangles.size(), -1);
        std::vector<std::uint32_t> emitting;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const MaterialBinding& binding = record.bindings[mesh.materialSlotOf(t)];
            if (!binding.material->emits()) {
                continue;
            }
            // For the choice of light only: the mean of the corners and the centre. The radiance
            // that counts is evaluated at the sampled point.
            const float third = 1.0F / 3.0F;
            const auto shine = [&](float b1, float b2) {
                const Rgb emission = evaluateMaterial(binding, t, b1, b2).emission;
                return record.mayCutOut ? emission * evaluateOpacity(binding, t, b1, b2) : emission;
            };
            const Rgb mean =
                (shine(0.0F, 0.0F) + shine(1.0F, 0.0F) + shine(0.0F, 1.0F) + shine(third, third)) *
                0.25F;
            record.emissiveIndex[t] = record.emissiveCount++;
            emitting.push_back(t);
            radiance.push_back(mean);
        }
        record.emissiveBase = static_cast<std::int32_t>(triangles.size());
        for (std::uint32_t i = 0; i < record.toRender.size(); ++i) {
            for (std::size_t e = 0; e < emitting.size(); ++e) {
                const Triangle& triangle = mesh.triangles[emitting[e]];
                Float3 corners[3];
                for (int c = 0; c < 3; ++c) {
                    corners[c] = record.instanced
                                     ? record.toRender[i].point(mesh.points[triangle.v[c]])
                                     : record.bakedPoints[triangle.v[c]];
                }
                EmissiveTriangle entry;
                entry.p0 = corners[0];
                entry.p1 = corners[1];
                entry.p2 = corners[2];
                entry.radiance = radiance[e];
                entry.doubleSided = true;
                entry.userId = static_cast<std::uint32_t>(triangles.size());
                triangles.push_back(entry);
                emissive_.push_back({static_cast<std::uint32_t>(g), i, emitting[e]});
            }
        }
    }
    return triangles;
}

void Accel::attach(std::uint32_t index) {
    AccelGeometry& record = *geometries_[index];
    const FloatTrapsMasked foreignCode;
    if (!record.instanced) {
        rtcAttachGeometryByID(top_.get(), record.geometry.get(),
                              static_cast<unsigned>(topEntries_.size()));
        topEntries_.push_back({index, 0});
        return;
    }
    for (std::uint32_t i = 0; i < record.toRender.size(); ++i) {
        const EmbreeGeometry instance(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE));
        rtcSetGeometryInstancedScene(instance.get(), record.prototype.get());
        rtcSetGeometryTransform(instance.get(), 0, kAffineFormat, &record.toRender[i]);
        rtcCommitGeometry(instance.get());
        rtcAttachGeometryByID(top_.get(), instance.get(),
                              static_cast<unsigned>(topEntries_.size()));
        topEntries_.push_back({index, i});
    }
}

bool Accel::commitTop(const LightSampler& lights, bool surfacesChanged,
                      const StopCheck& shouldStop) {
    lights_ = &lights;
    if (surfacesChanged || !top_) {
        ++builds_.top;
        top_ = newScene();
        topEntries_.clear();
        for (std::uint32_t i = 0; i < geometries_.size(); ++i) {
            attach(i);
        }
        commitScene(top_.get(), shouldStop);
        if (stopRequested(shouldStop)) {
            return false;
        }
    }
    looseShapes_ = lights.shapeCount() <= kMostLooseShapes ? lights.shapeCount() : 0;
    lightShapes_ = LightShapeTree();
    if (lights.shapeCount() == looseShapes_) {
        return true;
    }
    ++builds_.lights;
    std::vector<const PreparedLight*> shapes;
    shapes.reserve(lights.shapeCount());
    for (std::uint32_t i = 0; i < lights.shapeCount(); ++i) {
        shapes.push_back(&lights.prepared(lights.lightOfShape(i)));
    }
    lightShapes_ = LightShapeTree(shapes, shouldStop);
    return !stopRequested(shouldStop);
}

RayHit Accel::intersect(const Float3& origin, const Float3& direction, float tNear, float tFar,
                        bool coherent) const {
    RTCRayHit query;
    query.ray.org_x = origin.x;
    query.ray.org_y = origin.y;
    query.ray.org_z = origin.z;
    query.ray.tnear = tNear;
    query.ray.dir_x = direction.x;
    query.ray.dir_y = direction.y;
    query.ray.dir_z = direction.z;
    query.ray.time = 0.0F;
    query.ray.tfar = tFar;
    query.ray.mask = ~0U;
    query.ray.id = 0;
    query.ray.flags = 0;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    embreeIntersect(top_.get(), query, coherent);
    if (!lightShapes_.empty()) {
        const LightShapeTree::Hit met =
            lightShapes_.intersect({origin, direction, tNear, query.ray.tfar});
        if (met.shape >= 0) {
            return lightHit(static_cast<std::uint32_t>(met.shape), met.t);
        }
    }
    const std::int32_t shape = meetLooseShapes<float>(origin, direction, tNear, query.ray.tfar);
    if (shape >= 0) {
        return lightHit(static_cast<std::uint32_t>(shape), query.ray.tfar);
    }
    return decode(query.hit.geomID, query.hit.instID[0], query.hit.primID, query.ray.tfar,
                  query.hit.u, query.hit.v);
}

RayHit Accel::lightHit(std::uint32_t shape, float t) const {
    RayHit hit;
    hit.kind = RayHit::Kind::kLight;
    hit.t = t;
    hit.light = lights_->lightOfShape(shape);
    return hit;
}

RayHit Accel::decode(unsigned geomId, unsigned instId, unsigned primId, float t, float b1,
                     float b2) const {
    RayHit hit;
    if (geomId == RTC_INVALID_GEOMETRY_ID) {
        return hit;
    }
    if (geomId == kLightShapesId) {
        return lightHit(primId, t);
    }
    const bool inInstance = instId != RTC_INVALID_GEOMETRY_ID;
    const TopEntry& entry = topEntries_[inInstance ? instId : geomId];
    hit.t = t;
    hit.kind = RayHit::Kind::kSurface;
    hit.geometry = entry.geometry;
    hit.instance = entry.instance;
    hit.triangle = primId;
    hit.b1 = b1;
    hit.b2 = b2;
    return hit;
}

bool Accel::occluded(const Float3& origin, const Float3& direction, float tNear, float tFar) const {
    RTCRay ray;
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.tnear = tNear;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.time = 0.0F;
    ray.tfar = tFar;
    ray.mask = ~0U;
    ray.id = 0;
    ray.flags = 0;
    return meetLooseShapes<float>(origin, direction, tNear, tFar) >= 0 ||
           embreeOccluded(top_.get(), ray) ||
           lightShapes_.occluded({origin, direction, tNear, tFar});
}

} // namespace mbfeat
