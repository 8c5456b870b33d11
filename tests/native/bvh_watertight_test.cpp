// Rays from inside a closed mesh always hit it, above all those aimed at its edges and vertices.
#include <gtest/gtest.h>

#include "tests/native/bvh_oracle.h"

namespace vlp::test {
namespace {

// Aims at vertices, at points on edges and at random; every ray must hit.
void expect_no_leak(const Mesh& mesh, const RayScene& scene, Vec3 center, float inner, int rays, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    const BothForms view(scene);
    const Affine& placement = scene.instances[0].object_to_world;
    int leaks = 0;
    for (int i = 0; i < rays; ++i) {
        const Triangle& triangle = mesh.triangles[random() % mesh.triangles.size()];
        const size_t corner = random() % 3;
        const Vec3 a = transform_point(placement, mesh.positions[triangle.v[corner]]);
        const Vec3 b = transform_point(placement, mesh.positions[triangle.v[(corner + 1) % 3]]);
        const Vec3 origin = i % 5 == 0 ? center : center + random_direction(random) * (inner * uniform(random));
        const float s = uniform(random);
        const Vec3 target = i % 3 == 0 ? a : i % 3 == 1 ? a * (1 - s) + b * s : (a + b) * 0.5f;
        const Ray ray{origin, normalize(target - origin)};
        if (!closest_hit(view, ray, {}).found() || !any_hit(view, ray, {}, {})) ++leaks;
    }
    EXPECT_EQ(leaks, 0) << "seed " << seed << " of " << rays << " rays";
}

Affine scale_and_move(float scale, Vec3 shift) {
    return {{{scale, 0, 0, shift.x}, {0, scale, 0, shift.y}, {0, 0, scale, shift.z}}};
}

TEST(BvhWatertight, Cube) {
    const Mesh mesh = make_cube();
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    expect_no_leak(mesh, scene, {0, 0, 0}, 0.9f, 200000, 1);
}

TEST(BvhWatertight, Balls) {
    for (const uint32_t rings : {4u, 30u, 150u}) {
        const Mesh mesh = make_ball(rings, 2 * rings, 0.1f);
        RayScene scene;
        scene.place(scene.add(mesh));
        scene.build();
        expect_no_leak(mesh, scene, {0, 0, 0}, 0.5f, 200000, rings);
    }
}

TEST(BvhWatertight, ScalesAndDistances) {
    for (const float scale : {1e-15f, 1e-5f, 1e5f, 1e15f}) {
        for (const float shift : {0.0f, 1.0f, 100.0f}) {
            const Mesh mesh = make_ball(20, 40, 0.2f);
            const Vec3 center{shift * scale, -shift * scale, 0.5f * shift * scale};
            RayScene scene;
            scene.place(scene.add(mesh), scale_and_move(scale, center));
            scene.build();
            SCOPED_TRACE(testing::Message() << scale << " " << shift);
            expect_no_leak(mesh, scene, center, 0.5f * scale, 20000, 7);
        }
    }
}

TEST(BvhWatertight, ThinSlices) {  // slivers that meet at the poles
    const Mesh mesh = make_ball(6, 3000);
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    expect_no_leak(mesh, scene, {0, 0, 0}, 0.5f, 200000, 8);
}

TEST(BvhWatertight, CutSlices) {  // slivers at all angles, whose boxes are cut before the tree is built
    Mesh mesh = make_ball(6, 3000);
    std::mt19937 random(3);
    Affine turn = random_affine(random, 1, 1);
    for (auto& row : turn.m) row[3] = 0;
    mesh.map(turn);
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    ASSERT_GT(scene.bvh.triangle_blocks.size() * k_block_width, mesh.triangles.size() * 3 / 2) << "parts of triangles";
    expect_no_leak(mesh, scene, {0, 0, 0}, 0.2f, 200000, 8);
}

TEST(BvhWatertight, Instances) {
    const Mesh mesh = make_ball(40, 80, 0.1f);
    std::mt19937 random(9);
    for (int i = 0; i < 5; ++i) {
        RayScene scene;
        const uint32_t ball = scene.add(mesh);
        const Affine placement = random_affine(random, 1, 3);
        scene.place(ball, placement), scene.place(ball, scale_and_move(1, {1000, 0, 0}));
        scene.build();
        ASSERT_NE(scene.bvh.instance_roots[0], k_none) << "keeps a tree of its own";
        expect_no_leak(mesh, scene, placement.column(3), 0, 20000, 9);
    }
}

}  // namespace
}  // namespace vlp::test
