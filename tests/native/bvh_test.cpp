// The tree finds what testing every primitive in double precision finds.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/native/bvh_oracle.h"

namespace vlp::test {
namespace {

// Rays from around and inside, half of them aimed at vertices' neighbourhoods, some along axes.
Ray random_ray(std::mt19937& random, float size) {
    Ray ray{random_point(random, size), random_direction(random)};
    switch (random() % 4) {
        case 0:
            ray.direction = {random() % 2 ? 1.0f : -1.0f, 0, 0};
            break;
        case 1:
            ray.direction = normalize(random_point(random, 0.3f * size) - ray.origin);
            break;
        default:
            break;
    }
    if (random() % 8 == 0) {
        const float d = ray.direction.x;
        ray.direction = random() % 2 ? Vec3{0, d < 0 ? -1.0f : 1.0f, 0} : Vec3{0, -0.0f, 1};
    }
    return ray;
}

// Compares with the oracle. A hit may differ only where the oracle says that rounding decides: `slack` is the fraction of
// a primitive's size within which its border, or two primitives' order, may be mistaken.
void expect_agreement(const RayScene& scene, float size, int rays, uint32_t seed, double slack = 2e-5) {
    std::mt19937 random(seed);
    const BothForms view(scene);
    int found = 0;
    for (int i = 0; i < rays; ++i) {
        const Ray ray = random_ray(random, size);
        const Hit hit = closest_hit(view, ray, {});
        const double rounding = slack * static_cast<double>(size);
        const ExactHit grown = exact_closest(scene, ray, slack), shrunk = exact_closest(scene, ray, -slack);
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", ray " << i);
        if (shrunk.found()) {
            ASSERT_TRUE(hit.found());
            EXPECT_LE(hit.t, shrunk.t + rounding);
        }
        if (hit.found()) {
            ASSERT_TRUE(grown.found());
            EXPECT_GE(hit.t, grown.t - rounding);
            // The primitive that is named is really there.
            double distance = k_infinity;
            for_each_exact_hit(scene, ray, slack, [&](const ExactHit& exact) {
                if (exact.instance != hit.instance || exact.primitive != hit.primitive) return;
                distance = std::min(distance, std::fabs(exact.t - static_cast<double>(hit.t)));
            });
            EXPECT_LE(distance, rounding);
            ++found;
        }
        EXPECT_EQ(any_hit(view, ray, {}, {}), hit.found());
        if (hit.found()) {
            Ray shorter = ray;
            shorter.t_max = hit.t * 0.9999f;  // of two surfaces in one plane either may be found
            EXPECT_FALSE(any_hit(view, shorter, {}, {}));
            shorter.t_max = hit.t * 1.0001f + 1e-30f;
            EXPECT_TRUE(any_hit(view, shorter, {}, {}));
        }
    }
    EXPECT_GT(found, rays / 20) << "the rays must test something";
}

Mesh soup(std::mt19937& random, int count, float size, float edge) {
    Mesh mesh;
    for (int i = 0; i < count; ++i) {
        const Vec3 p = random_point(random, size);
        mesh.add(p, p + random_point(random, edge), p + random_point(random, edge));
    }
    return mesh;
}

TEST(Bvh, EmptyScenes) {
    RayScene scene;
    scene.build();
    EXPECT_FALSE(closest_hit(BothForms(scene), {{0, 0, 0}, {0, 0, 1}}, {}).found());
    EXPECT_FALSE(any_hit(BothForms(scene), {{0, 0, 0}, {0, 0, 1}}, {}, {}));
    scene.place(scene.add(Mesh{}));
    const uint32_t twice = scene.add(Mesh{});
    scene.place(twice), scene.place(twice);
    scene.build();
    EXPECT_FALSE(closest_hit(BothForms(scene), {{0, 0, 0}, {0, 0, 1}}, {}).found());
    EXPECT_EQ(scene.bvh.bytes(), scene.instances.size() * sizeof(uint32_t));
}

TEST(Bvh, OneTriangle) {
    RayScene scene;
    Mesh mesh;
    mesh.add({0, 0, 2}, {4, 0, 2}, {0, 4, 2});
    scene.place(scene.add(mesh));
    scene.build();
    const Hit hit = closest_hit(BothForms(scene), {{1, 2, 0}, {0, 0, 1}}, {});
    ASSERT_TRUE(hit.found());
    EXPECT_FLOAT_EQ(hit.t, 2);
    EXPECT_FLOAT_EQ(hit.u, 0.25f);
    EXPECT_FLOAT_EQ(hit.v, 0.5f);
    EXPECT_EQ(hit.primitive, 0u);
    EXPECT_EQ(hit.instance, 0u);
    EXPECT_TRUE(closest_hit(BothForms(scene), {{1, 2, 4}, {0, 0, -1}}, {}).found()) << "from behind";
    EXPECT_FALSE(closest_hit(BothForms(scene), {{1, 2, 0}, {0, 0, -1}}, {}).found()) << "away";
    EXPECT_FALSE(closest_hit(BothForms(scene), {{1, 2, 0}, {0, 0, 1}, 2}, {}).found()) << "t_max is not reached";
    EXPECT_FALSE(closest_hit(BothForms(scene), {{1, 2, 2}, {0, 0, 1}}, {}).found()) << "t = 0 is no hit";
    EXPECT_FALSE(closest_hit(BothForms(scene), {{1, 2, 0}, {0, 0, 1}}, {0, 0}).found()) << "skipped";
    EXPECT_FALSE(any_hit(BothForms(scene), {{1, 2, 0}, {0, 0, 1}}, {0, 0}, {})) << "skipped";
    EXPECT_FALSE(any_hit(BothForms(scene), {{1, 2, 0}, {0, 0, 1}}, {}, {0, 0})) << "skipped";
    EXPECT_TRUE(any_hit(BothForms(scene), {{1, 2, 0}, {0, 0, 1}}, {0, 1}, {1, 0}));
}

TEST(Bvh, TriangleSoup) {
    std::mt19937 random(11);
    RayScene scene;
    scene.place(scene.add(soup(random, 700, 1, 0.3f)));
    scene.build();
    expect_agreement(scene, 1.5f, 3000, 21);
}

TEST(Bvh, Slivers) {
    std::mt19937 random(12);
    Mesh mesh;
    for (int i = 0; i < 500; ++i) {
        const Vec3 p = random_point(random, 1), along = random_point(random, 1);
        mesh.add(p, p + along, p + along * 0.5f + random_point(random, 1e-3f));
        mesh.add(p, p + along, p + along);        // no area
        mesh.add(p, p, p);                        // a point
    }
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.add(soup(random, 100, 1, 0.2f));
    scene.place(1);
    scene.build();
    expect_agreement(scene, 1.2f, 1500, 22, 2e-3);
}

TEST(Bvh, Scales) {
    for (const float size : {1e-12f, 1e-6f, 1e3f, 1e6f, 1e12f}) {
        std::mt19937 random(13);
        RayScene scene;
        scene.place(scene.add(soup(random, 300, size, 0.4f * size)));
        scene.build();
        SCOPED_TRACE(size);
        expect_agreement(scene, 1.5f * size, 800, 23);
    }
}

TEST(Bvh, ExponentialSizes) {
    std::mt19937 random(14);
    Mesh mesh;
    for (int i = 0; i < 400; ++i) {
        const float size = std::ldexp(1.0f, -(i % 60));
        mesh.add({size, -size, -size}, {size, 3 * size, -size}, {size, -size, 3 * size});
    }
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    expect_agreement(scene, 0.7f, 1500, 24, 1e-4);
}

TEST(Bvh, EqualCentroids) {
    Mesh mesh;
    for (int i = 1; i <= 300; ++i) {
        const float s = 0.01f * static_cast<float>(i);
        mesh.add({-s, -s, 0}, {s, -s, 0}, {0, s, 0});
        mesh.add({-1, -1, 0.5f}, {1, -1, 0.5f}, {0, 1, 0.5f});
    }
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    expect_agreement(scene, 2, 1000, 25);
}

TEST(Bvh, RaysInThePlaneOfTriangles) {
    Mesh mesh;
    for (int x = 0; x < 8; ++x) {
        for (int y = 0; y < 8; ++y) {
            const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
            mesh.add({fx, fy, 0}, {fx + 1, fy, 0}, {fx, fy + 1, 0});
            mesh.add({fx + 1, fy, 0}, {fx + 1, fy + 1, 0}, {fx, fy + 1, 0});
        }
    }
    mesh.add({9, -10, -10}, {9, 30, -10}, {9, -10, 30});  // a wall behind
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    for (int i = 0; i <= 64; ++i) {
        const float y = static_cast<float>(i) * 0.125f;
        const Hit hit = closest_hit(BothForms(scene), {{-1, y, 0}, {1, 0, 0}}, {});
        ASSERT_TRUE(hit.found());
        EXPECT_GE(hit.t, 1.0f);
        EXPECT_LE(hit.t, 10.0f);
    }
}

TEST(Bvh, InvalidRays) {
    RayScene scene;
    scene.place(scene.add(make_ball(20, 30)));
    scene.place(scene.add(std::vector<Sphere>{{{0, 0, 0}, 2}}));
    const uint32_t cube = scene.add(make_ball(60, 60));
    scene.place(cube), scene.place(cube), scene.place(cube);
    scene.build();
    const float nan = std::nanf(""), inf = k_infinity;
    for (const float bad : {nan, inf, -inf}) {
        for (int axis = 0; axis < 3; ++axis) {
            Ray ray{{0, 0, 0}, {0, 0, 1}};
            (&ray.origin.x)[axis] = bad;
            EXPECT_FALSE(closest_hit(BothForms(scene), ray, {}).found());
            EXPECT_FALSE(any_hit(BothForms(scene), ray, {}, {}));
            ray = {{0, 0, 0}, {0, 0, 1}};
            (&ray.direction.x)[axis] = bad;
            EXPECT_FALSE(closest_hit(BothForms(scene), ray, {}).found());
            EXPECT_FALSE(any_hit(BothForms(scene), ray, {}, {}));
        }
    }
    EXPECT_FALSE(closest_hit(BothForms(scene), {{0, 0, 0}, {0, 0, 0}}, {}).found());
    EXPECT_FALSE(any_hit(BothForms(scene), {{0, 0, 0}, {0, -0.0f, 0}}, {}, {}));
    for (const float t_max : {0.0f, -1.0f, nan, -inf}) {
        EXPECT_FALSE(closest_hit(BothForms(scene), {{0, 0, 0}, {0, 0, 1}, t_max}, {}).found());
        EXPECT_FALSE(any_hit(BothForms(scene), {{0, 0, 0}, {0, 0, 1}, t_max}, {}, {}));
    }
    EXPECT_TRUE(closest_hit(BothForms(scene), {{0, 0, 0}, {0, 0, 1}}, {}).found());
}

TEST(Bvh, Instances) {
    for (uint32_t seed = 31; seed < 35; ++seed) {
        std::mt19937 random(seed);
        RayScene scene;
        const uint32_t large = scene.add(make_ball(24, 48, 0.2f, seed));  // 2208 triangles: keeps a tree of its own
        const uint32_t small = scene.add(make_cube());                    // moved into the world's tree
        for (int i = 0; i < 5; ++i) scene.place(large, random_affine(random, 0.6f, 1.5f));
        for (int i = 0; i < 7; ++i) scene.place(small, random_affine(random, 0.3f, 1.5f));
        scene.place(scene.add(soup(random, 50, 1, 0.5f)), random_affine(random, 1, 0.5f));  // placed once
        scene.build();
        int own = 0;
        for (const uint32_t root : scene.bvh.instance_roots) own += root != k_none;
        EXPECT_EQ(own, 5);
        expect_agreement(scene, 2.5f, 250, seed, 1e-4);
    }
}

TEST(Bvh, BoundsHoldEverything) {
    std::mt19937 random(15);
    RayScene scene;
    const uint32_t ball = scene.add(make_ball(40, 60));
    for (int i = 0; i < 4; ++i) scene.place(ball, random_affine(random, 1, 5));
    scene.place(scene.add(std::vector<Sphere>{{{7, 0, 0}, 2}}));
    scene.build();
    EXPECT_GE(scene.bvh.high.x, 9);
    for (const InstanceView& instance : scene.instances) {
        const GeometryView& geometry = scene.geometries[instance.geometry];
        for (uint32_t i = 0; geometry.kind == GeometryKind::mesh && i < geometry.primitive_count; ++i) {
            const Vec3 p = transform_point(instance.object_to_world, geometry.positions[geometry.triangles[i].v[0]]);
            EXPECT_EQ(min_of(p, scene.bvh.low), scene.bvh.low);
            EXPECT_EQ(max_of(p, scene.bvh.high), scene.bvh.high);
        }
    }
}

bool same_bits(const void* a, const void* b, size_t bytes) { return bytes == 0 || std::memcmp(a, b, bytes) == 0; }

TEST(Bvh, BuildIsTheSameForAnyThreadCount) {
    std::mt19937 random(16);
    RayScene scene;
    scene.place(scene.add(soup(random, 90000, 10, 0.2f)));  // enough for every parallel step
    const uint32_t ball = scene.add(make_ball(100, 100, 0.1f));
    for (int i = 0; i < 3; ++i) scene.place(ball, random_affine(random, 1, 5));
    std::vector<Sphere> spheres;
    for (int i = 0; i < 1000; ++i) spheres.push_back({random_point(random, 10), 0.1f});
    scene.place(scene.add(spheres));
    scene.build(1);
    const Bvh one = scene.bvh;
    for (const unsigned threads : {2u, 4u}) {
        scene.build(threads);
        const Bvh& other = scene.bvh;
        ASSERT_EQ(one.nodes.size(), other.nodes.size());
        ASSERT_EQ(one.triangle_blocks.size(), other.triangle_blocks.size());
        ASSERT_EQ(one.sphere_blocks.size(), other.sphere_blocks.size());
        for (size_t i = 0; i < one.nodes.size(); ++i) {
            ASSERT_TRUE(same_bits(one.nodes[i].bounds, other.nodes[i].bounds, sizeof one.nodes[i].bounds));
            ASSERT_TRUE(same_bits(one.nodes[i].child, other.nodes[i].child, sizeof one.nodes[i].child));
        }
        EXPECT_TRUE(same_bits(one.triangle_blocks.data(), other.triangle_blocks.data(),
                              one.triangle_blocks.size() * sizeof(TriangleBlock)));
        EXPECT_TRUE(same_bits(one.sphere_blocks.data(), other.sphere_blocks.data(),
                              one.sphere_blocks.size() * sizeof(SphereBlock)));
        EXPECT_EQ(one.instance_roots, other.instance_roots);
    }
}

}  // namespace
}  // namespace vlp::test
