// Bumpy balls, a box around them, and the tetrahedral Sierpinski arrangement.
#include "bench/ray_scenes.h"

#include <cstdio>

#include "bvh/traverse.h"
#include "core/frame.h"
#include "core/sampler.h"
#include "geometry/surface.h"

namespace vlp::bench {

namespace {

void add_mesh(BenchScene& scene, std::vector<Vec3> positions, std::vector<Triangle> triangles) {
    GeometryView geometry;
    geometry.kind = GeometryKind::mesh;
    geometry.primitive_count = static_cast<uint32_t>(triangles.size());
    geometry.positions = scene.positions.emplace_back(std::move(positions)).data();
    geometry.triangles = scene.triangles.emplace_back(std::move(triangles)).data();
    InstanceView instance;
    instance.geometry = static_cast<uint32_t>(scene.geometries.size());
    scene.geometries.push_back(geometry);
    scene.instances.push_back(instance);
}

// Waves on a sphere: `rings` by 2 `rings` quads.
void add_ball(BenchScene& scene, Vec3 center, float radius, uint32_t rings, float waves) {
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    const uint32_t segments = 2 * rings;
    for (uint32_t i = 0; i <= rings; ++i) {
        for (uint32_t j = 0; j <= segments; ++j) {
            const float theta = k_pi * static_cast<float>(i) / static_cast<float>(rings);
            const float phi = k_two_pi * static_cast<float>(j) / static_cast<float>(segments);
            const Vec3 n{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
            const float bump = std::sin(waves * n.x) * std::sin(waves * n.y) * std::sin(waves * n.z);
            positions.push_back(center + n * (radius * (1 + 0.15f * bump)));
        }
    }
    for (uint32_t i = 0; i < rings; ++i) {
        for (uint32_t j = 0; j < segments; ++j) {
            const uint32_t a = i * (segments + 1) + j, b = a + segments + 1;
            if (i > 0) triangles.push_back({{a, b, a + 1}});
            if (i + 1 < rings) triangles.push_back({{b, b + 1, a + 1}});
        }
    }
    add_mesh(scene, std::move(positions), std::move(triangles));
}

// Five walls of the box [-1, 1]³, open towards -y, each of `steps`² quads.
void add_room(BenchScene& scene, uint32_t steps) {
    const Vec3 corner[5] = {{-1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {-1, -1, -1}, {1, -1, -1}};
    const Vec3 along[5] = {{2, 0, 0}, {2, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 2, 0}};
    const Vec3 up[5] = {{0, 2, 0}, {0, 2, 0}, {0, 0, 2}, {0, 0, 2}, {0, 0, 2}};
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    for (int wall = 0; wall < 5; ++wall) {
        const auto first = static_cast<uint32_t>(positions.size());
        for (uint32_t i = 0; i <= steps; ++i) {
            for (uint32_t j = 0; j <= steps; ++j) {
                const float s = 1 / static_cast<float>(steps);
                positions.push_back(corner[wall] + along[wall] * (static_cast<float>(i) * s) +
                                    up[wall] * (static_cast<float>(j) * s));
            }
        }
        for (uint32_t i = 0; i < steps; ++i) {
            for (uint32_t j = 0; j < steps; ++j) {
                const uint32_t a = first + i * (steps + 1) + j, b = a + steps + 1;
                triangles.push_back({{a, b, a + 1}});
                triangles.push_back({{b, b + 1, a + 1}});
            }
        }
    }
    add_mesh(scene, std::move(positions), std::move(triangles));
}

void add_sierpinski(std::vector<Sphere>& spheres, Vec3 center, float radius, uint32_t level, uint32_t wanted) {
    const Vec3 corners[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    std::vector<Sphere> row{{center, radius}};
    for (uint32_t i = 0; i < level; ++i) {
        std::vector<Sphere> next;
        for (const Sphere& s : row) {
            if (spheres.size() < wanted) spheres.push_back(s);
            for (const Vec3 c : corners) next.push_back({s.center + c * (s.radius * 0.9f), s.radius * 0.5f});
        }
        row = next;
    }
}

BenchScene make_ball_in_room() {
    BenchScene scene;
    scene.name = "ball in a room";
    scene.eye = {0, -3.6f, 0}, scene.target = {0, 0, 0};
    add_ball(scene, {0, 0, -0.2f}, 0.7f, 125, 20);
    add_room(scene, 8);
    return scene;
}

BenchScene make_cluttered_room() {
    BenchScene scene;
    scene.name = "48 balls in a room";
    scene.eye = {0, -3.6f, 0}, scene.target = {0, 0, 0};
    for (uint32_t i = 0; i < 48; ++i) {
        const auto random = [&](uint32_t k) { return 2 * unit_float(hash(i, k)) - 1; };
        const float radius = 0.17f + 0.06f * random(3);
        add_ball(scene, Vec3{random(0), random(1), random(2)} * 0.75f, radius, 71, 15 + 5 * random(4));
    }
    add_room(scene, 40);
    return scene;
}

BenchScene make_sierpinski() {
    BenchScene scene;
    scene.name = "Sierpinski spheres";
    scene.eye = {0.9f, -3.4f, 0.8f}, scene.target = {0, 0, 0};
    add_sierpinski(scene.spheres, {0, 0, 0}, 0.5f, 6, 783);
    GeometryView geometry;
    geometry.kind = GeometryKind::spheres;
    geometry.primitive_count = static_cast<uint32_t>(scene.spheres.size());
    geometry.spheres = scene.spheres.data();
    scene.geometries.push_back(geometry);
    scene.instances.emplace_back();
    return scene;
}

BenchScene make_instances() {
    BenchScene scene;
    scene.name = "10,000 instances in a room";
    scene.eye = {0, -3.6f, 0}, scene.target = {0, 0, 0};
    add_ball(scene, {0, 0, 0}, 1, 23, 12);
    for (uint32_t i = 0; i < 10000; ++i) {
        const auto random = [&](uint32_t k) { return 2 * unit_float(hash(i, k)) - 1; };
        const Vec3 place = Vec3{random(0), random(1), random(2)} * 0.95f;
        const float turn = k_pi * random(3), size = 0.02f + 0.008f * random(4);
        const float c = size * std::cos(turn), s = size * std::sin(turn);
        const Affine map{{{c, -s, 0, place.x}, {s, c, 0, place.y}, {0, 0, size, place.z}}};
        InstanceView& instance = i == 0 ? scene.instances.front() : scene.instances.emplace_back();
        instance.object_to_world = map;
        instance.world_to_object = inverse(map);
    }
    add_room(scene, 8);
    return scene;
}

BenchScene make_boards() {
    BenchScene scene;
    scene.name = "boards at all angles";
    scene.eye = {0, -3.6f, 0}, scene.target = {0, 0, 0};
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    for (uint32_t i = 0; i < 6000; ++i) {
        const auto random = [&](uint32_t k) { return 2 * unit_float(hash(i, k)) - 1; };
        const Vec3 middle = Vec3{random(0), random(1), random(2)} * 0.9f;
        const Frame frame = make_frame(normalize(Vec3{random(3), random(4), random(5)} + Vec3{1e-3f, 0, 0}));
        const Vec3 along = frame.normal * 0.35f, across = frame.tangent * 0.006f;
        const auto first = static_cast<uint32_t>(positions.size());
        for (const Vec3 corner : {-along - across, along - across, along + across, across - along})
            positions.push_back(middle + corner);
        triangles.push_back({{first, first + 1, first + 2}});
        triangles.push_back({{first, first + 2, first + 3}});
    }
    add_mesh(scene, std::move(positions), std::move(triangles));
    add_room(scene, 8);
    return scene;
}

}  // namespace

size_t BenchScene::primitive_count() const {
    size_t count = 0;
    for (const GeometryView& geometry : geometries) count += geometry.primitive_count;
    return count;
}

void BenchScene::print_name() const {
    std::printf("%s, %zu primitives, %zu instances\n", name.c_str(), primitive_count(), instances.size());
}

SceneView BenchScene::view(const Bvh& bvh) const {
    SceneView scene;
    scene.geometries = geometries.data(), scene.instances = instances.data();
    scene.geometry_count = static_cast<uint32_t>(geometries.size());
    scene.instance_count = static_cast<uint32_t>(instances.size());
    scene.material_of_slot = material_of_slot.data();
    scene.bvh = bvh.view();
    return scene;
}

BenchScene make_scene(int which) {
    switch (which) {
        case 0:
            return make_ball_in_room();
        case 1:
            return make_cluttered_room();
        case 2:
            return make_sierpinski();
        case 3:
            return make_instances();
        default:
            return make_boards();
    }
}

std::vector<RaySet> make_rays(const BenchScene& scene, const Bvh& bvh) {
    constexpr uint32_t k_size = 1024, k_tile = 16;
    const SceneView view = scene.view(bvh);
    const Frame frame = make_frame(normalize(scene.target - scene.eye));
    const Vec3 right = normalize(cross(frame.normal, {0, 0, 1})), up = cross(right, frame.normal);
    std::vector<Ray> camera, bounce, shadow, connection;
    std::vector<SurfacePoint> points;
    for (uint32_t i = 0; i < k_size * k_size; ++i) {
        const uint32_t tile = i / (k_tile * k_tile), in_tile = i % (k_tile * k_tile), row = k_size / k_tile;
        const uint32_t x = tile % row * k_tile + in_tile % k_tile, y = tile / row * k_tile + in_tile / k_tile;
        const auto to_film = [](uint32_t pixel, uint32_t random) {
            return 0.36f * (2 * (static_cast<float>(pixel) + unit_float(random)) / k_size - 1);
        };
        Sampler sampler = make_sampler(i, 0);
        const Vec3 direction =
            frame.normal + right * to_film(x, sampler.next_bits()) + up * to_film(y, sampler.next_bits());
        const Ray ray{scene.eye, normalize(direction)};
        camera.push_back(ray);
        const Hit hit = closest_hit(view, ray, {});
        if (!hit.found()) continue;
        SurfacePoint point = surface_at(view, ray, hit);
        point.geometric_normal = face_toward(point.geometric_normal, -ray.direction);
        points.push_back(point);
        const Frame surface = make_frame(point.geometric_normal);
        const Vec2 u = sampler.next_2d();
        const float r = std::sqrt(u.x), phi = k_two_pi * u.y;
        const Vec3 local{r * std::cos(phi), r * std::sin(phi), std::sqrt(1 - u.x)};
        // A fixed step off the surface, so that every tracer starts from the same point.
        bounce.push_back({point.position + point.geometric_normal * 1e-4f, normalize(surface.to_world(local))});
    }
    const auto count = static_cast<uint32_t>(points.size());
    const auto join = [](const SurfacePoint& a, Vec3 to, std::vector<Ray>& rays) {
        const Vec3 from = a.position + a.geometric_normal * 1e-4f;
        const float distance = length(to - from);
        const Vec3 direction = (to - from) / max_of(distance, 1e-9f);
        if (dot(direction, a.geometric_normal) > 0) rays.push_back({from, direction, distance * 0.9999f});
    };
    for (uint32_t i = 0; i < count; ++i) {
        const Vec3 on_lamp{0.25f * (2 * unit_float(hash(i, 100)) - 1), 0.25f * (2 * unit_float(hash(i, 101)) - 1),
                           0.99f};
        join(points[i], on_lamp, shadow);
        for (uint32_t attempt = 0; attempt < 8; ++attempt) {
            const SurfacePoint& b = points[hash(i, attempt) % count];
            const Vec3 to = b.position + b.geometric_normal * 1e-4f;
            const size_t before = connection.size();
            if (dot(points[i].position - to, b.geometric_normal) > 0) join(points[i], to, connection);
            if (connection.size() == before) continue;
            break;
        }
    }
    return {{"camera", false, std::move(camera)},
            {"bounce", false, std::move(bounce)},
            {"shadow", true, std::move(shadow)},
            {"connection", true, std::move(connection)}};
}

}  // namespace vlp::bench
