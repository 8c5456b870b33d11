// Scenes for tests of the light transport: rooms full of materials, and every light to put into them.
#pragma once

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "light/light_build.h"
#include "ray_scenes.h"
#include "scene/scene.h"

namespace vlp::test {

// The materials that the rooms use, in this order.
enum Surface : int32_t {
    k_white,
    k_red,
    k_glossy,
    k_layered,  // diffuse under a reflection
    k_satin_mirror,  // diffuse and specular
    k_mirror,
    k_glass,
    k_rough_glass,
    k_veil,  // half transparent
    k_emitter,
};

inline LobeInput lobe(LobeKind kind, float weight, float roughness = 0, Fresnel fresnel = Fresnel::none) {
    LobeInput l;
    l.kind = kind;
    l.weight = rgb(weight);
    l.roughness = roughness;
    l.fresnel = fresnel;
    return l;
}

inline void add_materials(Scene& scene) {
    const auto add = [&](std::initializer_list<LobeInput> lobes, Rgb emission = {}) {
        const std::vector<LobeInput> all(lobes);
        scene.add_material(all, emission);
    };
    LobeInput red = lobe(LobeKind::diffuse, 1), base = lobe(LobeKind::diffuse, 0.7f);
    red.weight = {0.7f, 0.3f, 0.2f};
    base.layered_under = 0;
    add({lobe(LobeKind::diffuse, 0.75f)});
    add({red});
    add({lobe(LobeKind::reflection, 0.8f, 0.5f)});
    add({lobe(LobeKind::reflection, 1, 0.5f, Fresnel::dielectric), base});
    add({lobe(LobeKind::diffuse, 0.5f), lobe(LobeKind::reflection, 0.4f)});
    add({lobe(LobeKind::reflection, 0.9f)});
    add({lobe(LobeKind::dielectric, 1, 0, Fresnel::dielectric)});
    add({lobe(LobeKind::dielectric, 1, 0.5f, Fresnel::dielectric)});
    add({lobe(LobeKind::transparent, 0.5f), lobe(LobeKind::diffuse, 0.4f)});
    add({lobe(LobeKind::diffuse, 0.5f)}, {6, 5, 4});
}

// `normals`: 3 a triangle, or none for a flat mesh.
inline void add_surface(Scene& scene, const Mesh& mesh, int32_t material, const Affine& transform = {},
                        const std::vector<Vec3>& normals = {}) {
    const uint32_t geometry = scene.add_mesh(mesh.positions, mesh.triangles, normals, {}, {});
    scene.add_instance(geometry, transform, std::vector<int32_t>{material}, k_visible_to_camera);
}

inline void add_sphere(Scene& scene, Vec3 center, float radius, int32_t material, const Affine& transform = {}) {
    const uint32_t geometry = scene.add_spheres(std::vector<Vec3>{center}, std::vector<float>{radius}, {});
    scene.add_instance(geometry, transform, std::vector<int32_t>{material}, k_visible_to_camera);
}

// Seen counter-clockwise from where its normal points.
inline Mesh quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
    Mesh mesh;
    mesh.add(a, b, c);
    mesh.add(a, c, d);
    return mesh;
}

// The normals of a ball that pretends to be round.
inline std::vector<Vec3> round_normals(const Mesh& mesh) {
    std::vector<Vec3> normals;
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t v : t.v) normals.push_back(normalize(mesh.positions[v]));
    }
    return normals;
}

// Normals that lean to one side all over the mesh.
inline std::vector<Vec3> tilted_normals(const Mesh& mesh, Vec3 aside) {
    std::vector<Vec3> normals;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.positions[t.v[0]], b = mesh.positions[t.v[1]], c = mesh.positions[t.v[2]];
        normals.insert(normals.end(), 3, normalize(normalize(cross(b - a, c - a)) + aside));
    }
    return normals;
}

// Normals that lean up to `lean` radians away from the surface's own, another way at each corner.
inline std::vector<Vec3> leaning_normals(const Mesh& mesh, float lean) {
    std::vector<Vec3> normals;
    std::mt19937 random(7);
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.positions[t.v[0]], b = mesh.positions[t.v[1]], c = mesh.positions[t.v[2]];
        const Vec3 n = normalize(cross(b - a, c - a));
        for (int i = 0; i < 3; ++i) {
            const Vec3 w = random_direction(random);
            normals.push_back(normalize(n + normalize(w - n * dot(w, n)) * std::tan(lean)));
        }
    }
    return normals;
}

inline Affine placed_at(Vec3 position, Vec3 scale = {1, 1, 1}) {
    Affine a;
    a.m[0][0] = scale.x, a.m[1][1] = scale.y, a.m[2][2] = scale.z;
    a.m[0][3] = position.x, a.m[1][3] = position.y, a.m[2][3] = position.z;
    return a;
}

// Tilted about x, so that its -z looks down and aside.
inline Affine aslant(Vec3 position) {
    Affine a = placed_at(position);
    const float c = std::cos(0.4f), s = std::sin(0.4f);
    a.m[1][1] = c, a.m[1][2] = -s, a.m[2][1] = s, a.m[2][2] = c;
    return a;
}

// From `eye` toward `target`, z up.
inline Camera looking(Vec3 eye, Vec3 target, float half_size) {
    const Vec3 back = normalize(eye - target), right = normalize(cross(Vec3{0, 0, 1}, back)), up = cross(back, right);
    const Vec3 columns[4] = {right, up, back, eye};
    Camera camera;
    for (int j = 0; j < 4; ++j) {
        camera.camera_to_world.m[0][j] = columns[j].x;
        camera.camera_to_world.m[1][j] = columns[j].y;
        camera.camera_to_world.m[2][j] = columns[j].z;
    }
    camera.half_size = {half_size, half_size};
    return camera;
}

// The cameras that look alike: a pinhole, parallel rays, and both with a lens.
enum class CameraKind { perspective, orthographic, thin_lens, orthographic_lens };

// `width` (metres) of what orthographic cameras show; those with a lens focus on `target`.
inline Camera looking(CameraKind kind, Vec3 eye, Vec3 target, float half_size, float width) {
    const bool parallel = kind == CameraKind::orthographic || kind == CameraKind::orthographic_lens;
    Camera camera = looking(eye, target, parallel ? 0.5f * width : half_size);
    if (parallel) camera.projection = Projection::orthographic;
    if (kind == CameraKind::thin_lens || kind == CameraKind::orthographic_lens) camera.aperture_radius = 0.2f;
    camera.focus_distance = length(target - eye);
    return camera;
}

struct NamedLight {
    std::string name;
    std::function<void(Scene&)> add;

    friend void PrintTo(const NamedLight& light, std::ostream* out) { *out << light.name; }  // of GoogleTest
};

// Each for a room of 2 x 2 x 2 metres on the origin, open above.
inline std::vector<NamedLight> every_light() {
    const Vec3 above{0.2f, -0.1f, 1.7f};
    const Rgb power{40, 36, 30};
    const auto lamp = [](std::optional<Light> light) {
        return [light](Scene& scene) { scene.add_lamp(light.value(), 0); };
    };
    const Affine tilted = aslant(above);
    const Affine above_transform = placed_at(above), oval = placed_at(above, {1, 0.4f, 1});
    std::vector<NamedLight> lights = {
        {"point", lamp(make_point(above, power, 0))},
        {"point_sphere", lamp(make_point(above, power, 0.2f))},
        {"spot", lamp(make_spot(tilted, power, 1.6f, 0.5f, 0))},
        {"spot_sphere", lamp(make_spot(tilted, power, 1.6f, 0.5f, 0.15f))},
        {"sun", lamp(make_sun(tilted, power * 0.1f, 0))},
        {"sun_disc", lamp(make_sun(tilted, power * 0.1f, 0.3f))},
        {"rectangle", lamp(make_area(tilted, power, 0.6f, 0.4f, false, k_pi))},
        {"ellipse", lamp(make_area(oval, power, 0.9f, 0.9f, true, k_pi))},
        {"spread", lamp(make_area(above_transform, power, 0.5f, 0.5f, false, 1.2f))},
        {"mesh",
         [=](Scene& scene) { add_surface(scene, make_ball(4, 6), k_emitter, placed_at(above, {0.2f, 0.2f, 0.1f})); }},
        {"sphere", [=](Scene& scene) { add_sphere(scene, above, 0.2f, k_emitter); }},
        {"ellipsoid", [=](Scene& scene) { add_sphere(scene, {}, 1, k_emitter, placed_at(above, {0.3f, 0.2f, 0.1f})); }},
        {"world", [](Scene& scene) { scene.set_world({1, 1.2f, 1.5f}); }},
    };
    lights.push_back({"all", [lights](Scene& scene) {
                          for (const NamedLight& light : lights) light.add(scene);
                      }});
    return lights;
}

// What `fill` adds to a scene with the materials above, seen by a camera of size x size pixels.
inline std::unique_ptr<Scene> seen(const std::function<void(Scene&)>& fill, const Camera& camera, uint32_t size) {
    auto scene = std::make_unique<Scene>();
    add_materials(*scene);
    fill(*scene);
    scene->set_camera(camera);
    scene->set_film(size, size, {0, 0, size, size}, false);
    scene->build(1);
    return scene;
}

// A room with every kind of surface, lit by `add_lights`.
inline std::unique_ptr<Scene> crowded_room(const std::function<void(Scene&)>& add_lights, uint32_t pixels,
                                           CameraKind camera = CameraKind::perspective) {
    auto scene = std::make_unique<Scene>();
    add_materials(*scene);
    const Mesh floor = quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
    add_surface(*scene, floor, k_white);
    add_surface(*scene, quad({-1, 1, 0}, {1, 1, 0}, {1, 1, 2}, {-1, 1, 2}), k_glossy);
    add_surface(*scene, quad({-1, -1, 0}, {-1, 1, 0}, {-1, 1, 2}, {-1, -1, 2}), k_layered);
    add_surface(*scene, quad({1, 1, 0}, {1, -1, 0}, {1, -1, 2}, {1, 1, 2}), k_red);
    add_surface(*scene, quad({-0.9f, 0.6f, 0.9f}, {0, 0.9f, 0.9f}, {0, 0.9f, 1.7f}, {-0.9f, 0.6f, 1.7f}),
                k_satin_mirror);
    add_surface(*scene, quad({0.6f, -0.6f, 0.6f}, {0.9f, -0.5f, 0.6f}, {0.9f, -0.5f, 1.2f}, {0.6f, -0.6f, 1.2f}),
                k_veil);
    const Mesh ball = make_ball(6, 8);
    add_surface(*scene, ball, k_white, placed_at({-0.6f, -0.2f, 0.3f}, {0.25f, 0.25f, -0.3f}), round_normals(ball));
    add_surface(*scene, ball, k_mirror, placed_at({0.6f, 0.6f, 0.3f}, {0.3f, 0.3f, 0.3f}), round_normals(ball));
    add_surface(*scene, ball, k_rough_glass, placed_at({0, 0.3f, 0.25f}, {0.25f, 0.25f, 0.25f}), round_normals(ball));
    add_surface(*scene, ball, k_layered, placed_at({0.7f, -0.1f, 0.2f}, {0.2f, 0.2f, 0.2f}),
                leaning_normals(ball, 0.5f));
    add_sphere(*scene, {0.1f, -0.4f, 0.25f}, 0.25f, k_glass);
    // One interface alone: what a closed body does to solid angles on the way in, it undoes on the way out.
    add_surface(*scene, quad({-0.8f, -0.9f, 1.2f}, {0, -0.9f, 1.2f}, {0, 0.4f, 1.3f}, {-0.8f, 0.4f, 1.3f}), k_glass);
    add_lights(*scene);
    scene->set_camera(looking(camera, {0, -3.2f, 1.1f}, {0, 0, 0.8f}, 0.45f, 2.2f));
    scene->set_film(pixels, pixels, {0, 0, pixels, pixels}, false);
    scene->build(1);
    return scene;
}

}  // namespace vlp::test
