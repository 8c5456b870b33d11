// The scene that owns its data: filled datablock by datablock, built once, then read by the passes as a SceneView.
#pragma once

#include <span>
#include <vector>

#include "bvh/update.h"
#include "core/parallel.h"
#include "film/film.h"
#include "light/lamp_tree_build.h"
#include "light/light_build.h"
#include "light/light_tree_build.h"
#include "scene/geometry_build.h"
#include "scene/material_build.h"
#include "scene/scene_parts.h"
#include "scene/scene_view.h"

namespace vlp {

class Scene {
public:
    // Those that add something throw std::invalid_argument naming the value at fault, and std::logic_error after `build`,
    // but for what `reopen` has opened again.

    // Index of the new geometry. `corner_normals` (3 a triangle), `uvs` (3 a triangle) and `slots` may be empty.
    uint32_t add_mesh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                      std::span<const Vec3> corner_normals, std::span<const Vec2> uvs, std::span<const int32_t> slots);
    uint32_t add_spheres(std::span<const Vec3> centers, std::span<const float> radii, std::span<const int32_t> slots);
    // Index of the new material.
    uint32_t add_material(std::span<const LobeInput> lobes, Rgb emission);
    // The geometry and the materials must have been added before.
    void add_instance(uint32_t geometry, const Affine& object_to_world, std::span<const int32_t> materials,
                      uint32_t visibility);
    void add_lamp(Light light, uint32_t visibility);
    void set_world(Rgb radiance);
    // Instead of a constant: an equirectangular picture, `height` rows of `width` texels, row 0 at the pole below, and the
    // rotation from the world to it.
    void set_world_image(std::span<const Rgb> texels, uint32_t width, uint32_t height, const Vec3 (&to_image)[3]);
    void set_camera(const Camera& camera);  // all but the resolution, which set_film sets
    void set_film(uint32_t width, uint32_t height, Window window, bool transparent);

    // Builds the tree and the table of lights. Afterwards nothing may be added.
    void build(unsigned threads);
    // What `reopen` takes out. The camera and the film can be set again in any case; geometry and instances stay.
    struct Opened {
        bool materials = false, lamps = false, world = false;
    };
    // After `build`: takes parts out, to be added anew before the next `build`, which makes only what depends on them. No
    // view of the scene may be used until then, nor by a renderer's helper (Renderer::rest). There must be a material for each that instances have.
    void reopen(Opened parts);
    // After `reopen`, for what stays: other shapes of as many vertices or spheres, and other places. The tree follows, or is
    // built anew where that pays. Throw as those that add something, and std::invalid_argument for what is not there.
    void move_mesh(uint32_t geometry, std::span<const Vec3> positions, std::span<const Vec3> corner_normals,
                   std::span<const Vec2> uvs, std::span<const int32_t> slots);
    void move_spheres(uint32_t geometry, std::span<const Vec3> centers, std::span<const float> radii,
                      std::span<const int32_t> slots);
    void move_instance(uint32_t instance, const Affine& object_to_world);

    const SceneView& view() const { return view_; }
    // The same with every array where `place(part, data, bytes)` says that a copy of it stands: how a GPU gets the scene. For
    // compressed nodes, which are not kept, `data` is null: they are what compress() makes of nodes().
    using Place = vlp::Place;
    SceneView view_placed(const Place& place, NodeForm form) const;
    std::span<const BvhNode> nodes() const { return bvh_.nodes; }
    // Changes with what is in the part, and is another for each scene.
    uint64_t revision(ScenePart part) const { return revisions_[part]; }
    const Window& window() const { return window_; }
    bool transparent_film() const { return transparent_film_; }
    bool built() const { return built_; }

    // What the arrays of each part take where each begins at a multiple of `alignment`.
    ByPart<size_t> bytes(NodeForm form = NodeForm::wide, size_t alignment = 1) const;

    struct Info {
        uint64_t triangles = 0, spheres = 0, instances = 0, lamps = 0, emitters = 0;
        double build_seconds = 0;  // of the last build
    };
    const Info& info() const { return info_; }

private:
    void require_open(bool part) const;
    Geometry& movable(uint32_t geometry, GeometryKind kind, size_t vertices_or_spheres);
    void build_surfaces(ThreadPool& pool);
    void move_surfaces(ThreadPool& pool);
    bool moves_emitters() const;
    void build_lights(ThreadPool& pool);  // the lamps are there; adds what else shines
    void check_material_indices() const;
    bool bound();
    bool emits(const InstanceView& instance) const;
    void collect_emitters();
    void make_light_tables(ThreadPool& pool);
    void add_emitters_of(uint32_t instance);

    std::vector<Geometry> geometries_;
    std::vector<InstanceView> instances_;
    std::vector<Material> materials_;
    std::vector<Lobe> lobes_;
    std::vector<uint32_t> material_of_slot_, light_of_primitive_, light_choice_, infinite_lights_;
    std::vector<Light> lights_;
    LampTree lamps_;
    LightTree light_tree_;
    std::vector<GeometryView> geometry_views_;
    Rgb world_;
    std::vector<Rgb> world_texels_;
    EnvironmentTables world_tables_;
    EnvironmentView world_view_;  // without arrays
    Vec3 center_;
    float radius_ = 1;
    Camera camera_;
    Window window_;
    bool transparent_film_ = false, built_ = false;
    bool geometry_open_ = true;
    Opened open_{true, true, true};
    Moved moved_;  // since the last build
    std::vector<Rgb> built_emissions_;  // of the instances' materials, as the table of lights has them
    ByPart<uint64_t> revisions_;
    Bvh bvh_;
    SceneView view_;
    Info info_;
};

}  // namespace vlp
