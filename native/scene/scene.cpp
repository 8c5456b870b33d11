// Collects datablocks, then makes what the passes read: the tree, emitters, the table of lights and the bounds.
#include "scene/scene.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>

#include "bsdf/albedo_tables.h"
#include "film/filter_tables.h"
#include "geometry/octahedral.h"
#include "light/light.h"
#include "scene/input_checks.h"

namespace vlp {
namespace {

std::vector<uint16_t> narrow(std::span<const int32_t> slots) {
    std::vector<uint16_t> narrowed(slots.size());
    for (size_t i = 0; i < slots.size(); ++i) narrowed[i] = static_cast<uint16_t>(slots[i]);
    return narrowed;
}

template <typename T>
size_t bytes_of(const std::vector<T>& v) {
    return v.capacity() * sizeof(T);
}

// Where a copy of the vector's elements stands; null when it is empty.
template <typename T>
const T* placed(const std::vector<T>& v, const Scene::Place& place) {
    return v.empty() ? nullptr : static_cast<const T*>(place(v.data(), v.size() * sizeof(T)));
}

const void* in_place(const void* data, size_t) { return data; }

// The factor of a transform that scales every direction alike; 0 when it does not.
float uniform_scale(const Affine& a) {
    const float x = length(a.column(0)), y = length(a.column(1)), z = length(a.column(2));
    const float tolerance = 1e-4f * x;
    const bool equal = std::fabs(x - y) <= tolerance && std::fabs(x - z) <= tolerance;
    const bool orthogonal = std::fabs(dot(a.column(0), a.column(1))) <= tolerance * x &&
                            std::fabs(dot(a.column(1), a.column(2))) <= tolerance * x &&
                            std::fabs(dot(a.column(2), a.column(0))) <= tolerance * x;
    return equal && orthogonal ? x : 0.0f;
}

}  // namespace

GeometryView Scene::Geometry::view(const Place& place) const {
    GeometryView v;
    v.kind = kind;
    v.primitive_count = static_cast<uint32_t>(kind == GeometryKind::mesh ? triangles.size() : spheres.size());
    v.positions = placed(positions, place);
    v.triangles = placed(triangles, place);
    v.corner_normals = placed(corner_normals, place);
    v.uvs = placed(uvs, place);
    v.spheres = placed(spheres, place);
    v.material_slots = placed(slots, place);
    return v;
}

size_t Scene::Geometry::bytes() const {
    return bytes_of(positions) + bytes_of(triangles) + bytes_of(corner_normals) + bytes_of(uvs) + bytes_of(spheres) +
           bytes_of(slots);
}

void Scene::require_open() const {
    if (built_) throw std::logic_error("scene: nothing can be added or built again after build()");
}

uint32_t Scene::add_mesh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                         std::span<const Vec3> corner_normals, std::span<const Vec2> uvs,
                         std::span<const int32_t> slots) {
    require_open();
    check_mesh(positions, triangles, corner_normals, uvs, slots);
    Geometry g;
    g.positions.assign(positions.begin(), positions.end());
    g.triangles.assign(triangles.begin(), triangles.end());
    g.corner_normals.resize(corner_normals.size());
    for (size_t i = 0; i < corner_normals.size(); ++i) {
        const float l = length(corner_normals[i]);
        g.corner_normals[i] = encode(l > 0 ? corner_normals[i] / l : Vec3{0, 0, 1});
    }
    g.uvs.assign(uvs.begin(), uvs.end());
    g.slots = narrow(slots);
    geometries_.push_back(std::move(g));
    return static_cast<uint32_t>(geometries_.size() - 1);
}

uint32_t Scene::add_spheres(std::span<const Vec3> centers, std::span<const float> radii,
                            std::span<const int32_t> slots) {
    require_open();
    check_spheres(centers, radii, slots);
    Geometry g;
    g.kind = GeometryKind::spheres;
    g.spheres.resize(centers.size());
    for (size_t i = 0; i < centers.size(); ++i) g.spheres[i] = {centers[i], radii[i]};
    g.slots = narrow(slots);
    geometries_.push_back(std::move(g));
    return static_cast<uint32_t>(geometries_.size() - 1);
}

uint32_t Scene::add_material(std::span<const LobeInput> lobes, Rgb emission) {
    require_open();
    materials_.push_back(build_material(lobes, emission, lobes_));
    return static_cast<uint32_t>(materials_.size() - 1);
}

void Scene::add_instance(uint32_t geometry, const Affine& object_to_world, std::span<const int32_t> materials,
                         uint32_t visibility) {
    require_open();
    check_transform(object_to_world);
    check_indices(materials, materials_.size(), "instance: material of slot");
    if (geometry >= geometries_.size() || materials.empty()) {
        throw std::invalid_argument("instance: geometry " + std::to_string(geometry) + " with " +
                                    std::to_string(materials.size()) + " materials, but there are " +
                                    std::to_string(geometries_.size()) + " geometries, and one material is the least");
    }
    InstanceView instance;
    instance.object_to_world = object_to_world;
    instance.world_to_object = inverse(object_to_world);
    instance.geometry = geometry;
    instance.first_material = static_cast<uint32_t>(material_of_slot_.size());
    instance.slot_count = static_cast<uint32_t>(materials.size());
    instance.visibility = visibility;
    instance.mirrored = determinant(object_to_world) < 0;
    for (const int32_t m : materials) material_of_slot_.push_back(static_cast<uint32_t>(m));
    instances_.push_back(instance);
}

void Scene::add_lamp(Light light, uint32_t visibility) {
    require_open();
    light.visibility = visibility;
    lights_.push_back(light);
    ++info_.lamps;
}

void Scene::set_world_image(std::span<const Rgb> texels, uint32_t width, uint32_t height, const Vec3 (&to_image)[3]) {
    require_open();
    check_world_image(texels, width, height);
    world_texels_.assign(texels.begin(), texels.end());
    world_tables_ = make_environment_tables(texels, width, height);
    world_ = world_tables_.mean;
    world_view_.width = width, world_view_.height = height;
    std::copy(std::begin(to_image), std::end(to_image), std::begin(world_view_.to_image));
}

void Scene::set_camera(const Camera& camera) {
    require_open();
    const uint32_t width = camera_.width, height = camera_.height;
    camera_ = camera;
    camera_.width = width;
    camera_.height = height;
}

void Scene::set_film(uint32_t width, uint32_t height, Window window, bool transparent) {
    require_open();
    check_film(width, height, window);
    camera_.width = width;
    camera_.height = height;
    window_ = window;
    transparent_film_ = transparent;
}

void Scene::build(unsigned threads) {
    require_open();
    const auto start = std::chrono::steady_clock::now();
    ThreadPool pool(threads);
    for (const Geometry& g : geometries_) {
        geometry_views_.push_back(g.view(in_place));
        info_.geometry_bytes += g.bytes();
    }
    bvh_ = build_bvh(geometry_views_, instances_, pool);
    bound();
    if (!is_black(world_)) {
        lights_.push_back(make_environment(world_));
        lights_.back().visibility = k_visible_to_camera;
    }
    collect_emitters();
    make_light_tables(pool);

    view_ = view_placed(in_place);
    view_.geometries = geometry_views_.data();  // the passes' own copy, which lives as long as the scene

    for (const GeometryView& g : geometry_views_) {
        (g.kind == GeometryKind::mesh ? info_.triangles : info_.spheres) += g.primitive_count;
    }
    info_.instances = instances_.size();
    info_.bvh_bytes = bvh_.bytes();
    info_.light_bytes = bytes_of(lights_) + bytes_of(lamps_.nodes) + bytes_of(world_texels_) +
                        bytes_of(world_tables_.columns_below) + bytes_of(light_choice_) + bytes_of(light_of_primitive_);
    info_.material_bytes = bytes_of(materials_) + bytes_of(lobes_) + bytes_of(material_of_slot_) + bytes_of(instances_);
    info_.build_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    built_ = true;
}

SceneView Scene::view_placed(const Place& place) const {
    SceneView v;
    std::vector<GeometryView> geometries;
    for (const Geometry& g : geometries_) geometries.push_back(g.view(place));
    v.geometries = placed(geometries, place);
    v.instances = placed(instances_, place);
    v.materials = placed(materials_, place);
    v.lobes = placed(lobes_, place);
    v.material_of_slot = placed(material_of_slot_, place);
    v.light_of_primitive = placed(light_of_primitive_, place);
    v.lights = placed(lights_, place);
    v.light_choice = {placed(light_choice_, place), static_cast<uint32_t>(light_choice_.size())};
    v.infinite_lights = placed(infinite_lights_, place);
    v.infinite_light_count = static_cast<uint32_t>(infinite_lights_.size());
    v.lamps = {placed(lamps_.lights, place), static_cast<uint32_t>(lamps_.lights.size()),
               lamps_.nodes.empty() ? nullptr : placed(lamps_.nodes, place), lamps_.root};
    v.environment = world_view_;
    v.environment.texels = placed(world_texels_, place);
    v.environment.rows_below = placed(world_tables_.rows_below, place);
    v.environment.columns_below = placed(world_tables_.columns_below, place);
    v.albedo_tables = placed(albedo_tables(), place);
    v.filter_tables = placed(filter_tables(), place);
    v.bvh = {placed(bvh_.nodes, place), placed(bvh_.triangle_blocks, place), placed(bvh_.sphere_blocks, place),
             placed(bvh_.instance_roots, place), bvh_.root};
    v.geometry_count = static_cast<uint32_t>(geometries_.size());
    v.instance_count = static_cast<uint32_t>(instances_.size());
    v.light_count = static_cast<uint32_t>(lights_.size());
    for (const Material& m : materials_) v.has_transparency |= m.pass_through > 0;
    for (const InstanceView& i : instances_) v.hides_from_camera |= !(i.visibility & k_visible_to_camera);
    v.camera = camera_;
    v.center = center_;
    v.radius = radius_;
    return v;
}

// A sphere around every surface and lamp, so that light from infinity reaches all of it.
void Scene::bound() {
    const bool no_surface = bvh_.root == k_none;
    Vec3 low = no_surface ? Vec3{k_infinity, k_infinity, k_infinity} : bvh_.low;
    Vec3 high = no_surface ? -low : bvh_.high;
    for (const Light& lamp : lights_) {
        if (is_infinite(lamp)) continue;
        const float reach = lamp.radius + length(lamp.axis_u) + length(lamp.axis_v);
        low = min_of(low, lamp.position - Vec3{reach, reach, reach});
        high = max_of(high, lamp.position + Vec3{reach, reach, reach});
    }
    if (!(low.x <= high.x)) return;
    center_ = (low + high) * 0.5f;
    radius_ = max_of(length(high - low) * 0.5f * 1.0001f, 1e-6f);
}

void Scene::collect_emitters() {
    for (uint32_t i = 0; i < instances_.size(); ++i) {
        const InstanceView& instance = instances_[i];
        for (uint32_t slot = 0; slot < instance.slot_count; ++slot) {
            if (is_black(materials_[material_of_slot_[instance.first_material + slot]].emission)) continue;
            add_emitters_of(i);
            break;
        }
    }
}

// Every primitive of an instance whose material emits becomes a light. Spheres that the transform makes ellipsoids do
// not: their light is found by hitting them alone.
void Scene::add_emitters_of(uint32_t index) {
    InstanceView& instance = instances_[index];
    const GeometryView& geometry = geometry_views_[instance.geometry];
    const float scale = uniform_scale(instance.object_to_world);
    if (geometry.kind == GeometryKind::spheres && scale == 0) return;
    instance.first_emitter = static_cast<uint32_t>(light_of_primitive_.size());
    light_of_primitive_.resize(light_of_primitive_.size() + geometry.primitive_count, k_none);
    const auto to_world = [&](Vec3 p) { return transform_point(instance.object_to_world, p); };
    for (uint32_t i = 0; i < geometry.primitive_count; ++i) {
        const uint32_t slot = geometry.material_slots ? geometry.material_slots[i] : 0u;
        const uint32_t material = material_of_slot_[instance.first_material + min_of(slot, instance.slot_count - 1)];
        const Rgb radiance = materials_[material].emission;
        if (is_black(radiance)) continue;
        std::optional<Light> light;
        if (geometry.kind == GeometryKind::mesh) {
            const Triangle& t = geometry.triangles[i];
            light = make_triangle(to_world(geometry.positions[t.v[0]]), to_world(geometry.positions[t.v[1]]),
                                  to_world(geometry.positions[t.v[2]]), radiance, index, i);
        } else {
            const Sphere& s = geometry.spheres[i];
            light = make_sphere(to_world(s.center), s.radius * scale, radiance, index, i);
        }
        if (!light) continue;
        light_of_primitive_[instance.first_emitter + i] = static_cast<uint32_t>(lights_.size());
        lights_.push_back(*light);
        ++info_.emitters;
    }
}

void Scene::make_light_tables(ThreadPool& pool) {
    std::vector<double> powers;
    for (const Light& light : lights_) powers.push_back(static_cast<double>(power(light, radius_)));
    light_choice_ = make_distribution(powers);
    std::vector<uint32_t> shapes;
    for (uint32_t i = 0; i < lights_.size(); ++i) {
        const Light& light = lights_[i];
        if (is_delta(light) || light.instance != k_none) continue;
        (is_infinite(light) ? infinite_lights_ : shapes).push_back(i);
    }
    lamps_ = build_lamp_tree(lights_, std::move(shapes), pool);
}

}  // namespace vlp
