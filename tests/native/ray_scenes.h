// Meshes, spheres and their placements for tests of the tree: owns what a SceneView points to.
#pragma once

#include <deque>
#include <random>
#include <vector>

#include "bvh/build.h"
#include "bvh/traverse.h"

namespace vlp::test {

struct Mesh {
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;

    void add(Vec3 a, Vec3 b, Vec3 c) {
        const auto first = static_cast<uint32_t>(positions.size());
        positions.insert(positions.end(), {a, b, c});
        triangles.push_back({{first, first + 1, first + 2}});
    }
    void map(const Affine& affine) {
        for (Vec3& p : positions) p = transform_point(affine, p);
    }
};

// A closed ball of shared vertices: rings of quads cut in two, and a fan at each pole. `bump` in [0, 1) moves vertices.
inline Mesh make_ball(uint32_t rings, uint32_t segments, float bump = 0, uint32_t seed = 1) {
    Mesh mesh;
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> radius(1 - bump, 1.0f);
    const auto point = [&](float theta, float phi) {
        const float r = radius(random);
        return Vec3{r * std::sin(theta) * std::cos(phi), r * std::sin(theta) * std::sin(phi), r * std::cos(theta)};
    };
    mesh.positions.push_back(point(0, 0));
    for (uint32_t i = 1; i < rings; ++i) {
        for (uint32_t j = 0; j < segments; ++j) {
            mesh.positions.push_back(point(k_pi * static_cast<float>(i) / static_cast<float>(rings),
                                           k_two_pi * static_cast<float>(j) / static_cast<float>(segments)));
        }
    }
    mesh.positions.push_back(point(k_pi, 0));
    const auto last = static_cast<uint32_t>(mesh.positions.size() - 1);
    const auto vertex = [&](uint32_t i, uint32_t j) { return 1 + (i - 1) * segments + j % segments; };
    for (uint32_t j = 0; j < segments; ++j) {
        mesh.triangles.push_back({{0, vertex(1, j), vertex(1, j + 1)}});
        for (uint32_t i = 1; i + 1 < rings; ++i) {
            mesh.triangles.push_back({{vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)}});
            mesh.triangles.push_back({{vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)}});
        }
        mesh.triangles.push_back({{last, vertex(rings - 1, j + 1), vertex(rings - 1, j)}});
    }
    return mesh;
}

// The cube [-1, 1]³, twelve triangles, counter-clockwise from outside.
inline Mesh make_cube() {
    Mesh mesh;
    for (uint32_t i = 0; i < 8; ++i) {
        mesh.positions.push_back({i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f});
    }
    mesh.triangles = {{{0, 2, 3}}, {{0, 3, 1}}, {{4, 5, 7}}, {{4, 7, 6}}, {{0, 1, 5}}, {{0, 5, 4}},
                      {{2, 6, 7}}, {{2, 7, 3}}, {{0, 4, 6}}, {{0, 6, 2}}, {{1, 3, 7}}, {{1, 7, 5}}};
    return mesh;
}

class RayScene {
public:
    uint32_t add(Mesh mesh) {
        const Mesh& kept = meshes_.emplace_back(std::move(mesh));
        GeometryView view;
        view.kind = GeometryKind::mesh;
        view.primitive_count = static_cast<uint32_t>(kept.triangles.size());
        view.positions = kept.positions.data(), view.triangles = kept.triangles.data();
        geometries.push_back(view);
        return static_cast<uint32_t>(geometries.size() - 1);
    }
    uint32_t add(std::vector<Sphere> spheres) {
        const std::vector<Sphere>& kept = spheres_.emplace_back(std::move(spheres));
        GeometryView view;
        view.kind = GeometryKind::spheres;
        view.primitive_count = static_cast<uint32_t>(kept.size());
        view.spheres = kept.data();
        geometries.push_back(view);
        return static_cast<uint32_t>(geometries.size() - 1);
    }
    uint32_t place(uint32_t geometry, const Affine& object_to_world = {}) {
        InstanceView view;
        view.object_to_world = object_to_world;
        view.world_to_object = inverse(object_to_world);
        view.geometry = geometry;
        view.mirrored = determinant(object_to_world) < 0;
        instances.push_back(view);
        return static_cast<uint32_t>(instances.size() - 1);
    }
    void build(unsigned threads = 1) {
        ThreadPool pool(threads);
        bvh = build_bvh(geometries, instances, pool);
    }
    // Moves the vertices of a mesh.
    template <typename Map>
    void deform(uint32_t geometry, const Map& map) {
        for (Mesh& mesh : meshes_) {
            if (mesh.positions.data() != geometries[geometry].positions) continue;
            for (Vec3& p : mesh.positions) p = map(p);
        }
    }
    std::vector<Sphere>& spheres_of(uint32_t geometry) {
        for (std::vector<Sphere>& spheres : spheres_) {
            if (spheres.data() == geometries[geometry].spheres) return spheres;
        }
        return spheres_.front();
    }
    void move(uint32_t instance, const Affine& object_to_world) { vlp::place(instances[instance], object_to_world); }
    SceneView view() const {
        SceneView scene;
        scene.geometries = geometries.data(), scene.instances = instances.data();
        scene.geometry_count = static_cast<uint32_t>(geometries.size());
        scene.instance_count = static_cast<uint32_t>(instances.size());
        scene.material_of_slot = &material_;
        scene.bvh = bvh.view();
        return scene;
    }

    std::vector<GeometryView> geometries;
    std::vector<InstanceView> instances;
    Bvh bvh;

private:
    std::deque<Mesh> meshes_;
    std::deque<std::vector<Sphere>> spheres_;
    uint32_t material_ = 0;
};

inline Vec3 random_direction(std::mt19937& random) {
    std::uniform_real_distribution<float> uniform(0, 1);
    const float z = 1 - 2 * uniform(random), phi = k_two_pi * uniform(random), r = safe_sqrt(1 - z * z);
    return normalize({r * std::cos(phi), r * std::sin(phi), z});
}

inline Vec3 random_point(std::mt19937& random, float size) {
    std::uniform_real_distribution<float> uniform(-size, size);
    const float x = uniform(random), y = uniform(random);
    return {x, y, uniform(random)};
}

inline Affine random_affine(std::mt19937& random, float size, float shift) {
    for (;;) {
        Affine a;
        for (auto& row : a.m) {
            const Vec3 r = random_point(random, size);
            row[0] = r.x, row[1] = r.y, row[2] = r.z;
            row[3] = random_point(random, shift).x;
        }
        if (std::fabs(determinant(a)) > 0.05f * size * size * size) return a;
    }
}

}  // namespace vlp::test
