// The scene as plain data: pointers and counts that the passes read on the CPU and on a GPU alike.
#pragma once

#include "bvh/bvh_view.h"
#include "camera/camera.h"
#include "core/distribution.h"
#include "core/rgb.h"
#include "core/transform.h"
#include "light/light_data.h"
#include "scene/material.h"

namespace vlp {

struct Triangle {
    uint32_t v[3];
};

// A unit vector in 32 bits (octahedral, Cigolle et al. 2014); encode and decode are in geometry/octahedral.h.
struct OctNormal {
    uint32_t bits;
};

enum class GeometryKind : uint8_t { mesh, spheres };

struct Sphere {
    Vec3 center;
    float radius;
};

// A mesh or a set of spheres in its own space.
struct GeometryView {
    GeometryKind kind = GeometryKind::mesh;
    uint32_t primitive_count = 0;
    const Vec3* positions = nullptr;            // mesh
    const Triangle* triangles = nullptr;        // mesh
    const OctNormal* corner_normals = nullptr;  // mesh; null: flat
    const Vec2* uvs = nullptr;                  // mesh, active set; null: none
    bool normals_by_vertex = false, uvs_by_vertex = false;  // one a position, else 3 a triangle
    const Sphere* spheres = nullptr;            // spheres
    const uint16_t* material_slots = nullptr;   // one a primitive; null: slot 0
};

// Which rays see an instance or a lamp; the same bits as vlp_bpt.scene.Visibility.
enum Visibility : uint32_t { k_visible_to_camera = 1 };

struct InstanceView {
    Affine object_to_world;
    Affine world_to_object;
    uint32_t geometry = 0;
    uint32_t first_material = 0;  // into SceneView::material_of_slot
    uint32_t slot_count = 1;      // slots beyond the last use the last
    uint32_t first_emitter = k_none;  // into SceneView::light_of_primitive, one a primitive; k_none: none emits
    uint32_t visibility = k_visible_to_camera;
    bool mirrored = false;        // the transform turns the winding of triangles over
};

inline void place(InstanceView& instance, const Affine& object_to_world) {
    instance.object_to_world = object_to_world;
    instance.world_to_object = inverse(object_to_world);
    instance.mirrored = determinant(object_to_world) < 0;
}

struct SceneView {
    const GeometryView* geometries = nullptr;
    const InstanceView* instances = nullptr;
    const Material* materials = nullptr;
    const Lobe* lobes = nullptr;
    const uint32_t* material_of_slot = nullptr;
    const uint32_t* light_of_primitive = nullptr;
    const Light* lights = nullptr;
    Distribution light_choice;    // over lights, by power
    LightTreeView light_tree;
    uint32_t geometry_count = 0, instance_count = 0, light_count = 0;
    const uint32_t* infinite_lights = nullptr;  // indices of the environment and the suns that are no delta lights
    uint32_t infinite_light_count = 0;
    BvhView bvh;                  // every surface
    EnvironmentView environment;
    LampView lamps;               // the shapes of lamps, which rays pass through
    bool has_transparency = false;  // some material lets light pass straight through
    bool hides_from_camera = false;  // some instance is not seen by the camera
    Camera camera;
    LightGuide light_guide;       // what a pilot of the render learnt
    Vec3 center;                  // of the sphere around every surface and lamp
    float radius = 1;
    const float* albedo_tables = nullptr;  // see bsdf/albedo.h
    const float* filter_tables = nullptr;  // see film/filter.h
};

}  // namespace vlp
