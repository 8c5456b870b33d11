// Embree 3 or 4: default (not robust) scenes of medium build quality.
#include "bench/embree_rays.h"

#include <chrono>
#include <string>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace vlp::bench {

struct EmbreeScene::Handles {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::vector<RTCScene> instanced;
};

namespace {

RTCGeometry make_geometry(RTCDevice device, const GeometryView& view) {
    const bool mesh = view.kind == GeometryKind::mesh;
    RTCGeometry geometry = rtcNewGeometry(device, mesh ? RTC_GEOMETRY_TYPE_TRIANGLE : RTC_GEOMETRY_TYPE_SPHERE_POINT);
    if (mesh) {
        uint32_t vertices = 0;
        for (uint32_t i = 0; i < view.primitive_count; ++i) {
            for (const uint32_t v : view.triangles[i].v) vertices = max_of(vertices, v + 1);
        }
        auto* const positions = static_cast<Vec3*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3), vertices));
        auto* const triangles = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), view.primitive_count));
        std::copy(view.positions, view.positions + vertices, positions);
        std::copy(view.triangles, view.triangles + view.primitive_count, triangles);
    } else {
        auto* const spheres = static_cast<Sphere*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, sizeof(Sphere), view.primitive_count));
        std::copy(view.spheres, view.spheres + view.primitive_count, spheres);
    }
    rtcCommitGeometry(geometry);
    return geometry;
}

void attach(RTCScene scene, RTCGeometry geometry) {
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
}

}  // namespace

// Geometries that are placed once stand in the scene itself, where they are; others in scenes of their own.
EmbreeScene::EmbreeScene(const BenchScene& scene, unsigned threads) : handles_(std::make_unique<Handles>()) {
    RTCDevice device = handles_->device = rtcNewDevice(("threads=" + std::to_string(threads)).c_str());
    const auto start = std::chrono::steady_clock::now();
    handles_->scene = rtcNewScene(device);
    std::vector<uint32_t> placements(scene.geometries.size());
    for (const InstanceView& instance : scene.instances) ++placements[instance.geometry];
    handles_->instanced.resize(scene.geometries.size());
    for (size_t g = 0; g < scene.geometries.size(); ++g) {
        if (placements[g] == 1) {
            attach(handles_->scene, make_geometry(device, scene.geometries[g]));
            continue;
        }
        handles_->instanced[g] = rtcNewScene(device);
        attach(handles_->instanced[g], make_geometry(device, scene.geometries[g]));
        rtcCommitScene(handles_->instanced[g]);
    }
    for (const InstanceView& view : scene.instances) {
        if (placements[view.geometry] == 1) continue;
        RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, handles_->instanced[view.geometry]);
        rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, view.object_to_world.m);
        rtcCommitGeometry(instance);
        attach(handles_->scene, instance);
    }
    rtcCommitScene(handles_->scene);
    build_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

EmbreeScene::~EmbreeScene() {
    rtcReleaseScene(handles_->scene);
    for (RTCScene scene : handles_->instanced) {
        if (scene) rtcReleaseScene(scene);
    }
    rtcReleaseDevice(handles_->device);
}

float EmbreeScene::closest(const Ray& ray) const {
    RTCRayHit query;
    query.ray = {ray.origin.x,
                 ray.origin.y,
                 ray.origin.z,
                 0,
                 ray.direction.x,
                 ray.direction.y,
                 ray.direction.z,
                 0,
                 ray.t_max,
                 ~0u,
                 0,
                 0};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    rtcIntersect1(handles_->scene, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(handles_->scene, &context, &query);
#endif
    return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? k_infinity : query.ray.tfar;
}

std::string EmbreeScene::version() {
    return std::to_string(RTC_VERSION_MAJOR) + "." + std::to_string(RTC_VERSION_MINOR);
}

bool EmbreeScene::occluded(const Ray& ray) const {
    RTCRay query = {ray.origin.x,
                    ray.origin.y,
                    ray.origin.z,
                    0,
                    ray.direction.x,
                    ray.direction.y,
                    ray.direction.z,
                    0,
                    ray.t_max,
                    ~0u,
                    0,
                    0};
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded1(handles_->scene, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(handles_->scene, &context, &query);
#endif
    return query.tfar < 0;
}

}  // namespace vlp::bench
