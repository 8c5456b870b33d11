// Compressed nodes contain the boxes of wide ones at every scale, are searched front to back, and need no more stack than
// they may. That both forms find the same is told by the tests of the wide tree, which search both.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "bvh/node_box.h"
#include "bvh/update.h"
#include "tests/native/both_forms.h"

namespace vlp::test {
namespace {

// A plane of the grid, exactly: the grid's numbers are floats.
long double plane(const ChildGrid& grid, uint32_t axis, uint32_t byte) {
    return static_cast<long double>(grid.origin[axis]) +
           byte * std::ldexp(1.0L, static_cast<int>(byte_of(grid.exponents, axis)) - 127);
}

bool is_there(const CompressedNode& node, uint32_t i) { return (byte_of(node.grid.exponents, 3) >> i & 1) != 0; }

// Every child has a place, and its box there is larger by the margin and not by much more than a step of the grid.
void expect_contains(const BvhNode& node) {
    const CompressedNode out = compress(node);
    std::multiset<uint32_t> children, expected;
    const Box whole = node_box(node);
    for (uint32_t i = 0; i < k_node_width; ++i) {
        if (node.child[i] != k_none) expected.insert(node.child[i]);
        EXPECT_EQ(is_there(out, i), out.child[i] != k_none);
        if (!is_there(out, i)) continue;
        children.insert(out.child[i]);
        uint32_t from = 0;
        while (node.child[from] != out.child[i]) ++from;
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const long double low = node.bounds[axis][from], high = node.bounds[axis + 3][from];
            const long double size = std::max(std::fabs((&whole.low.x)[axis]), std::fabs((&whole.high.x)[axis]));
            const long double extent =
                static_cast<long double>((&whole.high.x)[axis]) - static_cast<long double>((&whole.low.x)[axis]);
            const long double found_low = plane(out.grid, axis, byte_of(out.grid.low[axis][i / 4], i % 4));
            const long double found_high = plane(out.grid, axis, byte_of(out.grid.high[axis][i / 4], i % 4));
            const long double margin = 0.999L * size * 0x1p-21L;
            ASSERT_LE(found_low, low - margin) << "axis " << axis << " of child " << i;
            ASSERT_GE(found_high, high + margin) << "axis " << axis << " of child " << i;
            const long double most = 2.1L * (extent / 255 + 4 * size * 0x1p-21L) + 0x1p-125L;
            ASSERT_GE(found_low, low - most);
            ASSERT_LE(found_high, high + most);
        }
    }
    EXPECT_EQ(children, expected);
}

BvhNode empty_node() {
    BvhNode node;
    for (uint32_t i = 0; i < k_node_width; ++i) {
        set_child_box(node, i, {});
        node.child[i] = k_none;
    }
    return node;
}

TEST(BvhCompressed, BoxesContainThoseOfWideNodesAtEveryScale) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (int n = 0; n < 200000; ++n) {
        // Each axis on a scale of its own, from the smallest numbers to 2^100, at times far away or flat.
        Vec3 center, size;
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const float scale = std::ldexp(1.0f, static_cast<int>(random() % 250) - 149);
            (&size.x)[axis] = random() % 8 == 0 ? 0.0f : scale;
            const float away = std::min(std::ldexp(scale, static_cast<int>(random() % 30)), 0x1p120f);
            (&center.x)[axis] = random() % 3 == 0 ? 0.0f : away * uniform(random);
        }
        BvhNode node = empty_node();
        const uint32_t count = 1 + random() % k_node_width;
        for (uint32_t i = 0; i < count; ++i) {
            Box box;
            box.include(center + size * Vec3{uniform(random), uniform(random), uniform(random)});
            if (random() % 4 != 0) box.include(center + size * Vec3{uniform(random), uniform(random), uniform(random)});
            set_child_box(node, i, widened(box));
            node.child[i] = make_child(ChildKind::triangles, i);
        }
        expect_contains(node);
        if (HasFatalFailure()) FAIL() << "node " << n;
    }
}

TEST(BvhCompressed, GridsOfTheLargestNumbersHaveNumbers) {
    const float most = std::numeric_limits<float>::max();
    for (const float from : {-most, -1e30f, 0.0f, 1e38f}) {
        BvhNode node = empty_node();
        set_child_box(node, 0, widened({{from, from, from}, {most, most, most}}));
        set_child_box(node, 1, widened({{from, from, from}, {from, from, from}}));
        node.child[0] = node.child[1] = make_child(ChildKind::triangles, 0);
        const CompressedNode out = compress(node);
        for (uint32_t axis = 0; axis < 3; ++axis) {
            EXPECT_TRUE(std::isfinite(out.grid.origin[axis]));
            EXPECT_LE(out.grid.origin[axis], from);
            EXPECT_GE(plane(out.grid, axis, 255), static_cast<long double>(most));
        }
    }
}

// The node of an octree: eight cubes at its corners, in any order.
TEST(BvhCompressed, ChildrenComeFrontToBack) {
    std::mt19937 random(2);
    for (int n = 0; n < 200; ++n) {
        std::array<uint32_t, k_node_width> corner{0, 1, 2, 3, 4, 5, 6, 7};
        std::shuffle(corner.begin(), corner.end(), random);
        const uint32_t count = 1 + random() % k_node_width;
        BvhNode node = empty_node();
        for (uint32_t i = 0; i < count; ++i) {
            const Vec3 low{corner[i] & 1 ? 1.0f : -2.0f, corner[i] & 2 ? 1.0f : -2.0f, corner[i] & 4 ? 1.0f : -2.0f};
            set_child_box(node, i, {low, low + Vec3{1, 1, 1}});
            node.child[i] = make_child(ChildKind::triangles, corner[i]);
        }
        const CompressedNode out = compress(node);
        for (int k = 0; k < 50; ++k) {
            const Vec3 target = random_point(random, 0.5f), origin = target - random_direction(random) * 20.0f;
            const detail::GridRay ray = detail::make_grid_ray(origin, target - origin);
            float before = 0;
            uint32_t met = 0;
            for (uint32_t mask = detail::meet_grid(ray, out.grid, k_infinity); mask != 0; mask &= mask - 1) {
                const uint32_t child = out.child[lowest_bit(mask) ^ ray.octant];
                ASSERT_NE(child, k_none);
                ASSERT_EQ(child_kind(child), ChildKind::triangles);
                // Where a ray may meet two of the cubes, one lies nearer along every axis in which they differ.
                float entry[k_node_width];
                const auto at = static_cast<uint32_t>(std::ranges::find(corner, child_index(child)) - corner.begin());
                meet_children(ray.ray, node, k_infinity, entry);
                if (count == k_node_width) {
                    EXPECT_GE(entry[at], before - 1e-3f);
                }
                before = entry[at];
                ++met;
            }
            float entry[k_node_width];
            EXPECT_GE(met, static_cast<uint32_t>(std::popcount(meet_children(ray.ray, node, k_infinity, entry))));
        }
    }
}

// Rays that meet a wide box meet the compressed one, at every scale and from any distance.
TEST(BvhCompressed, RaysMissNoBox) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-1, 1);
    uint64_t met = 0, more = 0;
    for (int n = 0; n < 20000; ++n) {
        const float scale = std::ldexp(1.0f, static_cast<int>(random() % 80) - 40);
        const Vec3 center = random_point(random, 1) * std::ldexp(scale, static_cast<int>(random() % 20));
        const float size = std::ldexp(scale, -static_cast<int>(random() % 20));
        BvhNode node = empty_node();
        for (uint32_t i = 0; i < k_node_width; ++i) {
            Box box;
            box.include(center + random_point(random, size));
            box.include(center + random_point(random, size));
            if (random() % 3 == 0) box.high = box.low;  // as a vertex
            set_child_box(node, i, widened(box));
            node.child[i] = make_child(ChildKind::triangles, i);
        }
        const CompressedNode out = compress(node);
        for (int k = 0; k < 20; ++k) {
            const uint32_t aim = random() % k_node_width;
            const Box box = child_box(node, aim);
            const Vec3 target = random() % 2 ? box.low : (box.low + box.high) * 0.5f;
            Vec3 direction = random_direction(random);
            if (random() % 4 == 0) (&direction.x)[random() % 3] = random() % 2 ? 0.0f : -0.0f;
            const float distance = std::ldexp(scale, static_cast<int>(random() % 30) - 10);
            const Vec3 origin = target - direction * distance;
            direction = direction * std::ldexp(1.0f, static_cast<int>(random() % 20) - 10);
            if (!is_valid(Ray{origin, direction})) continue;
            float entry[k_node_width];
            const uint32_t wide = meet_children(make_traversal_ray(origin, direction), node, k_infinity, entry);
            const detail::GridRay ray = detail::make_grid_ray(origin, direction);
            uint32_t found = 0;
            for (uint32_t mask = detail::meet_grid(ray, out.grid, k_infinity); mask != 0; mask &= mask - 1) {
                found |= 1u << child_index(out.child[lowest_bit(mask) ^ ray.octant]);
            }
            ASSERT_EQ(wide & ~found, 0u) << "node " << n << ", ray " << k;
            met += static_cast<uint64_t>(std::popcount(wide)), more += static_cast<uint64_t>(std::popcount(found));
        }
    }
    EXPECT_GT(met, 200000u);
    EXPECT_LT(more, met * 3 / 2);
}

// Times that are no numbers, or too large to be exact, hide nothing and show no absent child.
TEST(BvhCompressed, RaysThroughHugeNodesMissNothing) {
    for (const float size : {1e15f, 1e19f, 1e20f, 3.6e20f, 1e21f, 1e30f, 1e37f}) {
        BvhNode node = empty_node();
        set_child_box(node, 0, {{-size, -size, -size}, {size, -0.4f * size, size}});
        set_child_box(node, 5, {{-size, 0.9f * size, -size}, {size, size, size}});
        node.child[0] = make_child(ChildKind::triangles, 0), node.child[5] = make_child(ChildKind::triangles, 5);
        const CompressedNode out = compress(node);
        for (const Vec3 direction : {Vec3{1, 0, 0}, Vec3{-1, -0.0f, 0}, Vec3{-0.0f, 0, 1}, Vec3{1e-9f, -1e-9f, 1}}) {
            const detail::GridRay ray = detail::make_grid_ray({0, -0.5f * size, 0}, direction);
            bool found = false;
            for (uint32_t mask = detail::meet_grid(ray, out.grid, k_infinity); mask != 0; mask &= mask - 1) {
                const uint32_t child = out.child[lowest_bit(mask) ^ ray.octant];
                ASSERT_NE(child, k_none) << "no child";
                found |= child_index(child) == 0;
            }
            EXPECT_TRUE(found) << size;
        }
    }
}

uint32_t depth_of(const Bvh& bvh, uint32_t root) {
    uint32_t depth = 0;
    for (const uint32_t child : bvh.nodes[root].child) {
        if (child != k_none && child_kind(child) == ChildKind::node) depth = std::max(depth, depth_of(bvh, child));
    }
    return depth + 1;
}

void expect_depth_within_bound(const Bvh& bvh) {
    for (size_t t = 0; t + 1 < bvh.trees.size(); ++t) {
        if (bvh.is_empty(t)) continue;
        EXPECT_LE(depth_of(bvh, bvh.trees[t].node), k_max_depth);
    }
}

// Boxes without area cost nothing, wherever they are cut: places that grow exponentially make a chain of them.
TEST(BvhCompressed, TreesOfPointsOnALineAreNoDeeperThanTheStackAllows) {
    Mesh mesh;
    for (int i = 0; i < 250; ++i) {
        const Vec3 p{std::ldexp(1.0f, 126 - i), 0, 0};
        mesh.add(p, p, p);
    }
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    expect_depth_within_bound(scene.bvh);
    EXPECT_FALSE(any_hit(BothForms(scene), {{0, 1, 0}, {0, -1, 0}}, {}, {}));
}

// Sizes that grow exponentially, one within the other.
TEST(BvhCompressed, TreesAreNoDeeperThanTheStackAllows) {
    std::mt19937 random(4);
    for (const float ratio : {0.25f, 0.5f, 0.8f, 0.95f}) {
        for (const int count : {100, 3000}) {
            Mesh mesh;
            float size = 1e18f;
            for (int i = 0; i < count; ++i) {
                const Vec3 p = random_point(random, 0.1f * size);
                mesh.add(p + Vec3{size, -size, -size}, p + Vec3{size, 3 * size, -size},
                         p + Vec3{size, -size, 3 * size});
                size *= ratio;
                if (size < 1e-18f) size = 1e18f;
            }
            RayScene scene;
            const uint32_t kept = scene.add(mesh);
            for (int i = 0; i < 50; ++i) scene.place(kept);  // too many to be flattened, for the larger count
            scene.build();
            expect_depth_within_bound(scene.bvh);
            const BothForms forms(scene);
            for (int i = 0; i < 300; ++i) {
                const float scale = std::ldexp(1.0f, static_cast<int>(random() % 100) - 50);
                closest_hit(forms, {random_point(random, scale), random_direction(random)}, {});
                any_hit(forms, {random_point(random, scale), random_direction(random)}, {}, {});
            }
        }
    }
}

TEST(BvhCompressed, FollowsUpdates) {
    std::mt19937 random(5);
    RayScene scene;
    const uint32_t ball = scene.add(make_ball(40, 60, 0.1f)), shared = scene.add(make_ball(24, 48, 0.2f, 2));
    scene.place(ball);
    for (int i = 0; i < 5; ++i) scene.place(shared, random_affine(random, 0.5f, 1.5f));
    scene.build();
    ThreadPool pool(2);
    for (int step = 0; step < 4; ++step) {
        scene.deform(ball, [](Vec3 p) { return Vec3{p.x + 0.3f * p.z, 1.1f * p.y, p.z}; });
        scene.move(2, random_affine(random, 0.5f, 1.5f));
        Moved moved{std::vector<uint8_t>(scene.geometries.size()), std::vector<uint8_t>(scene.instances.size())};
        moved.geometries[ball] = moved.instances[2] = 1;
        update_bvh(scene.bvh, scene.geometries, scene.instances, moved, pool);
        const BothForms forms(scene);
        int found = 0;
        for (int i = 0; i < 2000; ++i) {
            found += closest_hit(forms, {random_point(random, 2), random_direction(random)}, {}).found();
        }
        EXPECT_GT(found, 300);
    }
}

TEST(BvhCompressed, IsTheSameForAnyThreadCount) {
    RayScene scene;
    scene.place(scene.add(make_ball(150, 200, 0.1f)));
    scene.build();
    ThreadPool one(1), three(3);
    const std::vector<CompressedNode> a = compress(scene.bvh.nodes, one), b = compress(scene.bvh.nodes, three);
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(CompressedNode)), 0);
}

}  // namespace
}  // namespace vlp::test
