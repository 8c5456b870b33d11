// Collects datablocks, then makes what the passes read: the tree, emitters, the table of lights and the bounds.
#include "scene/scene.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>

#include "bsdf/albedo_tables.h"
#include "bvh/compressed.h"
#include "film/filter_tables.h"
#include "light/light.h"
#include "scene/input_checks.h"

namespace vlp {
namespace {

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

void Scene::require_open(bool part) const {
    if (built_ || !part) throw std::logic_error("scene: nothing can be added or built again after build()");
}

uint32_t Scene::add_mesh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                         std::span<const Vec3> corner_normals, std::span<const Vec2> uvs,
                         std::span<const int32_t> slots) {
    require_open(geometry_open_);
    geometries_.push_back(make_mesh(positions, triangles, corner_normals, uvs, slots));
    return static_cast<uint32_t>(geometries_.size() - 1);
}

uint32_t Scene::add_spheres(std::span<const Vec3> centers, std::span<const float> radii,
                            std::span<const int32_t> slots) {
    require_open(geometry_open_);
    geometries_.push_back(make_spheres(centers, radii, slots));
    return static_cast<uint32_t>(geometries_.size() - 1);
}

uint32_t Scene::add_material(std::span<const LobeInput> lobes, Rgb emission) {
    require_open(open_.materials);
    materials_.push_back(build_material(lobes, emission, lobes_));
    return static_cast<uint32_t>(materials_.size() - 1);
}

void Scene::add_instance(uint32_t geometry, const Affine& object_to_world, std::span<const int32_t> materials,
                         uint32_t visibility) {
    require_open(geometry_open_);
    check_transform(object_to_world);
    check_indices(materials, materials_.size(), "instance: material of slot");
    if (geometry >= geometries_.size() || materials.empty()) {
        throw std::invalid_argument("instance: geometry " + std::to_string(geometry) + " with " +
                                    std::to_string(materials.size()) + " materials, but there are " +
                                    std::to_string(geometries_.size()) + " geometries, and one material is the least");
    }
    InstanceView instance;
    place(instance, object_to_world);
    instance.geometry = geometry;
    instance.first_material = static_cast<uint32_t>(material_of_slot_.size());
    instance.slot_count = static_cast<uint32_t>(materials.size());
    instance.visibility = visibility;
    for (const int32_t m : materials) material_of_slot_.push_back(static_cast<uint32_t>(m));
    instances_.push_back(instance);
}

void Scene::add_lamp(Light light, uint32_t visibility) {
    require_open(open_.lamps);
    light.visibility = visibility;
    lights_.push_back(light);
    ++info_.lamps;
}

void Scene::set_world(Rgb radiance) {
    require_open(open_.world);
    world_ = radiance;
}

void Scene::set_world_image(std::span<const Rgb> texels, uint32_t width, uint32_t height, const Vec3 (&to_image)[3]) {
    require_open(open_.world);
    check_world_image(texels, width, height);
    world_texels_.assign(texels.begin(), texels.end());
    world_tables_ = make_environment_tables(texels, width, height);
    world_ = world_tables_.mean;
    world_view_.width = width, world_view_.height = height;
    std::copy(std::begin(to_image), std::end(to_image), std::begin(world_view_.to_image));
}

void Scene::set_camera(const Camera& camera) {
    require_open(true);
    const uint32_t width = camera_.width, height = camera_.height;
    camera_ = camera;
    camera_.width = width;
    camera_.height = height;
}

void Scene::set_film(uint32_t width, uint32_t height, Window window, bool transparent) {
    require_open(true);
    check_film(width, height, window);
    camera_.width = width;
    camera_.height = height;
    window_ = window;
    transparent_film_ = transparent;
}

void Scene::build(unsigned threads) {
    require_open(true);
    const auto start = std::chrono::steady_clock::now();
    ThreadPool pool(threads);
    check_material_indices();
    if (geometry_open_) {
        build_surfaces(pool);
    } else {
        move_surfaces(pool);
    }
    build_lights(pool);
    if (open_.materials) revisions_[ScenePart::materials] = next_revision();
    if (open_.world) revisions_[ScenePart::world] = next_revision();
    geometry_open_ = false;
    open_ = {};
    moved_ = {std::vector<uint8_t>(geometries_.size()), std::vector<uint8_t>(instances_.size())};

    view_ = view_placed(in_place, NodeForm::wide);
    view_.geometries = geometry_views_.data();  // the passes' own copy, which lives as long as the scene
    info_.build_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    built_ = true;
}

void Scene::build_surfaces(ThreadPool& pool) {
    for (const Geometry& g : geometries_) geometry_views_.push_back(g.view(in_place));
    bvh_ = build_bvh(geometry_views_, instances_, pool);
    for (const GeometryView& g : geometry_views_) {
        (g.kind == GeometryKind::mesh ? info_.triangles : info_.spheres) += g.primitive_count;
    }
    info_.instances = instances_.size();
    for (const ScenePart part : {ScenePart::geometry, ScenePart::bvh, ScenePart::tables}) {
        revisions_[part] = next_revision();
    }
}

void Scene::build_lights(ThreadPool& pool) {
    std::vector<Rgb> emissions;
    for (const uint32_t m : material_of_slot_) emissions.push_back(materials_[m].emission);
    const auto equal = [](Rgb a, Rgb b) { return a.r == b.r && a.g == b.g && a.b == b.b; };
    const bool same_emitters = !geometry_open_ && std::ranges::equal(emissions, built_emissions_, equal);
    // Light from infinity comes through the bounds.
    const bool moves_infinite = bound() && std::ranges::any_of(lights_, is_infinite);
    if (same_emitters && !open_.lamps && !open_.world && !moves_infinite && !moves_emitters()) return;
    lights_.resize(info_.lamps);  // without what the last build added
    if (!is_black(world_)) {
        lights_.push_back(make_environment(world_));
        lights_.back().visibility = k_visible_to_camera;
    }
    collect_emitters();
    make_light_tables(pool);
    if (!same_emitters) revisions_[ScenePart::instances] = next_revision();
    revisions_[ScenePart::lights] = next_revision();
    built_emissions_ = std::move(emissions);
}

void Scene::check_material_indices() const {
    for (const uint32_t m : material_of_slot_) {
        if (m < materials_.size()) continue;
        throw std::invalid_argument("instance: material " + std::to_string(m) + ", but there are " +
                                    std::to_string(materials_.size()));
    }
}

SceneView Scene::view_placed(const Place& place, NodeForm form) const {
    using enum ScenePart;
    SceneView v;
    std::vector<GeometryView> views;
    for (const Geometry& g : geometries_) views.push_back(g.view(place));
    v.geometries = placed(views, geometry, place);
    v.instances = placed(instances_, instances, place);
    v.materials = placed(materials_, materials, place);
    v.lobes = placed(lobes_, materials, place);
    v.material_of_slot = placed(material_of_slot_, instances, place);
    v.light_of_primitive = placed(light_of_primitive_, lights, place);
    v.lights = placed(lights_, lights, place);
    v.light_choice = {placed(light_choice_, lights, place), static_cast<uint32_t>(light_choice_.size())};
    v.light_tree = {
        placed(light_tree_.nodes, lights, place),
        placed(light_tree_.places, lights, place),
        placed(light_tree_.infinite_lights, lights, place),
        {placed(light_tree_.infinite_below, lights, place), static_cast<uint32_t>(light_tree_.infinite_below.size())},
        light_tree_.infinite_irradiance};
    v.infinite_lights = placed(infinite_lights_, lights, place);
    v.infinite_light_count = static_cast<uint32_t>(infinite_lights_.size());
    v.lamps = {placed(lamps_.lights, lights, place), static_cast<uint32_t>(lamps_.lights.size()),
               placed(lamps_.nodes, lights, place), lamps_.root};
    v.environment = world_view_;
    v.environment.texels = placed(world_texels_, world, place);
    v.environment.rows_below = placed(world_tables_.rows_below, world, place);
    v.environment.columns_below = placed(world_tables_.columns_below, world, place);
    v.albedo_tables = placed(albedo_tables(), tables, place);
    v.filter_tables = placed(filter_tables(), tables, place);
    v.bvh = {nullptr, placed(bvh_.triangle_blocks, bvh, place), placed(bvh_.sphere_blocks, bvh, place),
             placed(bvh_.instance_roots, bvh, place), bvh_.root};
    if (form == NodeForm::wide) {
        v.bvh.nodes = placed(bvh_.nodes, bvh, place);
    } else if (!bvh_.nodes.empty()) {
        const size_t size = bvh_.nodes.size() * sizeof(CompressedNode);
        v.bvh.compressed = static_cast<const CompressedNode*>(place(bvh, nullptr, size));
    }
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

ByPart<size_t> Scene::bytes(NodeForm form, size_t alignment) const {
    ByPart<size_t> bytes;
    const auto count = [&](ScenePart part, const void* data, size_t size) {
        bytes[part] += (size + alignment - 1) / alignment * alignment;
        return data;
    };
    view_placed(count, form);
    return bytes;
}

// A sphere around every surface and lamp, so that light from infinity reaches all of it. Whether it is another than before.
bool Scene::bound() {
    const bool no_surface = bvh_.root == k_none;
    Vec3 low = no_surface ? Vec3{k_infinity, k_infinity, k_infinity} : bvh_.low;
    Vec3 high = no_surface ? -low : bvh_.high;
    for (const Light& lamp : std::span(lights_).first(info_.lamps)) {
        if (is_infinite(lamp)) continue;
        const bool area = lamp.kind == LightKind::area;
        const Vec2 half = area ? lamp.half_size : Vec2{length(lamp.axis_u), length(lamp.axis_v)};
        const float reach = lamp.radius + half.x + half.y;
        low = min_of(low, lamp.position - Vec3{reach, reach, reach});
        high = max_of(high, lamp.position + Vec3{reach, reach, reach});
    }
    const Vec3 center = std::exchange(center_, {});
    const float radius = std::exchange(radius_, 1.0f);
    if (low.x <= high.x) {
        center_ = (low + high) * 0.5f;
        radius_ = max_of(length(high - low) * 0.5f * 1.0001f, 1e-6f);
    }
    return !(center_ == center) || radius_ != radius;
}

bool Scene::emits(const InstanceView& instance) const {
    const std::span materials = std::span(material_of_slot_).subspan(instance.first_material, instance.slot_count);
    return std::ranges::any_of(materials, [&](uint32_t m) { return !is_black(materials_[m].emission); });
}

void Scene::collect_emitters() {
    light_of_primitive_.clear();
    info_.emitters = 0;
    for (uint32_t i = 0; i < instances_.size(); ++i) {
        instances_[i].first_emitter = k_none;
        if (emits(instances_[i])) add_emitters_of(i);
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
    infinite_lights_.clear();
    for (uint32_t i = 0; i < lights_.size(); ++i) {
        const Light& light = lights_[i];
        if (is_delta(light) || light.instance != k_none) continue;
        (is_infinite(light) ? infinite_lights_ : shapes).push_back(i);
    }
    lamps_ = build_lamp_tree(lights_, std::move(shapes), pool);
    light_tree_ = build_light_tree(lights_, pool);
}

}  // namespace vlp
