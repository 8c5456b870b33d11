// Opens a built scene again, and moves what stays in it.
#include <algorithm>
#include <stdexcept>
#include <string>

#include "scene/input_checks.h"
#include "scene/scene.h"

namespace vlp {
namespace {

bool any(const std::vector<uint8_t>& flags) {
    return std::ranges::any_of(flags, [](uint8_t flag) { return flag != 0; });
}

}  // namespace

void Scene::reopen(Opened parts) {
    if (!built_) throw std::logic_error("scene: reopen() before build()");
    built_ = false;
    open_ = parts;
    if (parts.materials) {
        materials_.clear();
        lobes_.clear();
    }
    if (parts.lamps) {
        lights_.clear();
        info_.lamps = 0;
    }
    if (parts.world) {
        world_ = {};
        world_texels_.clear();
        world_tables_ = {};
        world_view_ = {};
    }
}

// The geometry, which must be of this kind and size.
Geometry& Scene::movable(uint32_t geometry, GeometryKind kind, size_t vertices_or_spheres) {
    require_open(!geometry_open_);
    if (geometry < geometries_.size() && geometries_[geometry].kind == kind) {
        Geometry& g = geometries_[geometry];
        const size_t had = kind == GeometryKind::mesh ? g.positions.size() : g.spheres.size();
        if (vertices_or_spheres == had) return g;
    }
    const char* const what = kind == GeometryKind::mesh ? "a mesh of " : "spheres, ";
    throw std::invalid_argument("geometry " + std::to_string(geometry) + " cannot be moved: it is not " + what +
                                std::to_string(vertices_or_spheres));
}

void Scene::move_mesh(uint32_t geometry, std::span<const Vec3> positions, std::span<const Vec3> corner_normals,
                      std::span<const Vec2> uvs, std::span<const int32_t> slots) {
    Geometry& g = movable(geometry, GeometryKind::mesh, positions.size());
    g = make_mesh(positions, g.triangles, corner_normals, uvs, slots);
    moved_.geometries[geometry] = 1;
}

void Scene::move_spheres(uint32_t geometry, std::span<const Vec3> centers, std::span<const float> radii,
                         std::span<const int32_t> slots) {
    movable(geometry, GeometryKind::spheres, centers.size()) = make_spheres(centers, radii, slots);
    moved_.geometries[geometry] = 1;
}

void Scene::move_instance(uint32_t instance, const Affine& object_to_world) {
    require_open(!geometry_open_);
    check_transform(object_to_world);
    if (instance >= instances_.size()) {
        throw std::invalid_argument("instance " + std::to_string(instance) + " cannot be moved: there are " +
                                    std::to_string(instances_.size()));
    }
    place(instances_[instance], object_to_world);
    moved_.instances[instance] = 1;
}

void Scene::move_surfaces(ThreadPool& pool) {
    const bool geometries = any(moved_.geometries), instances = any(moved_.instances);
    if (!geometries && !instances) return;
    for (size_t g = 0; g < geometries_.size(); ++g) {
        if (moved_.geometries[g]) geometry_views_[g] = geometries_[g].view(in_place);
    }
    update_bvh(bvh_, geometry_views_, instances_, moved_, pool);
    revisions_[ScenePart::bvh] = next_revision();
    if (geometries) revisions_[ScenePart::geometry] = next_revision();
    if (instances) revisions_[ScenePart::instances] = next_revision();
}

// Whether something that moved shines.
bool Scene::moves_emitters() const {
    for (size_t i = 0; i < instances_.size(); ++i) {
        const bool moved = moved_.instances[i] || moved_.geometries[instances_[i].geometry];
        if (moved && emits(instances_[i])) return true;
    }
    return false;
}

}  // namespace vlp
