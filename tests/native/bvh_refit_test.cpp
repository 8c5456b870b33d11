// A hierarchy whose primitives have moved finds what one built anew finds, and covers them as well.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>

#include "bvh/refs.h"
#include "bvh/update.h"
#include "tests/native/bvh_oracle.h"

namespace vlp::test {
namespace {

constexpr double k_never = std::numeric_limits<double>::infinity(), k_always = -1;

Moved everything(const RayScene& scene) {
    return {std::vector<uint8_t>(scene.geometries.size(), 1), std::vector<uint8_t>(scene.instances.size(), 1)};
}

Moved nothing(const RayScene& scene) {
    return {std::vector<uint8_t>(scene.geometries.size()), std::vector<uint8_t>(scene.instances.size())};
}

void update(RayScene& scene, const Moved& moved, double max_growth = k_never, unsigned threads = 1) {
    ThreadPool pool(threads);
    update_bvh(scene.bvh, scene.geometries, scene.instances, moved, pool, max_growth);
}

Bvh build_anew(const RayScene& scene) {
    ThreadPool pool(1);
    return build_bvh(scene.geometries, scene.instances, pool);
}

template <typename T, typename Allocator>
bool same_bits(const std::vector<T, Allocator>& a, const std::vector<T, Allocator>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

// But for the padding behind children.
bool same_bits(const RawVector<BvhNode>& a, const RawVector<BvhNode>& b) {
    return std::ranges::equal(a, b, [](const BvhNode& x, const BvhNode& y) {
        return std::memcmp(x.bounds, y.bounds, sizeof x.bounds) == 0 &&
               std::memcmp(x.child, y.child, sizeof x.child) == 0;
    });
}

// Bits, for blocks have NaN in empty lanes.
void expect_same(const Bvh& a, const Bvh& b) {
    EXPECT_TRUE(same_bits(a.nodes, b.nodes));
    EXPECT_TRUE(same_bits(a.triangle_blocks, b.triangle_blocks));
    EXPECT_TRUE(same_bits(a.sphere_blocks, b.sphere_blocks));
    EXPECT_EQ(a.instance_roots, b.instance_roots);
    EXPECT_EQ(a.flattened, b.flattened);
    EXPECT_EQ(a.root, b.root);
    EXPECT_EQ(a.low, b.low);
    EXPECT_EQ(a.high, b.high);
    EXPECT_TRUE(same_bits(a.trees, b.trees));
}

bool contains(const BvhNode& node, uint32_t i, Vec3 p) {
    const auto& b = node.bounds;
    return p.x >= b[0][i] && p.y >= b[1][i] && p.z >= b[2][i] && p.x <= b[3][i] && p.y <= b[4][i] && p.z <= b[5][i];
}

// Whether a walk through boxes that hold the point comes to the triangle, as the leaf has it now.
bool reaches(const Bvh& bvh, uint32_t root, Vec3 p, uint32_t instance, uint32_t primitive) {
    const BvhNode& node = bvh.nodes[root];
    for (uint32_t i = 0; i < k_node_width; ++i) {
        const uint32_t child = node.child[i];
        if (child == k_none || !contains(node, i, p)) continue;
        if (child_kind(child) == ChildKind::node) {
            if (reaches(bvh, child_index(child), p, instance, primitive)) return true;
            continue;
        }
        if (child_kind(child) != ChildKind::triangles) continue;
        for (uint32_t b = child_index(child); b < child_index(child) + child_blocks(child); ++b) {
            const TriangleBlock& block = bvh.triangle_blocks[b];
            for (uint32_t lane = 0; lane < k_block_width; ++lane) {
                if (block.instance[lane] == instance && block.primitive[lane] == primitive) return true;
            }
        }
    }
    return false;
}

// Every triangle is covered by the leaves that have it: corners, edges and points within.
void expect_cover(const RayScene& scene, int samples, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int n = 0; n < samples; ++n) {
        const auto i = static_cast<uint32_t>(random() % scene.instances.size());
        const InstanceView& instance = scene.instances[i];
        const GeometryView& geometry = scene.geometries[instance.geometry];
        if (geometry.kind != GeometryKind::mesh) continue;
        const auto primitive = static_cast<uint32_t>(random() % geometry.primitive_count);
        const bool flat = scene.bvh.flattened[i];
        const Corners c = corners_of(geometry, flat ? &instance : nullptr, primitive);
        const float r = std::sqrt(uniform(random)), t = n % 2 == 0 ? uniform(random) : 0.0f;
        const Vec3 within = c.v[0] * (1 - r) + c.v[1] * (r * (1 - t)) + c.v[2] * (r * t);
        const Box box = box_of(c);
        const uint32_t root = flat ? 0 : scene.bvh.instance_roots[i], owner = flat ? i : k_none;
        for (const Vec3 p : {c.v[0], c.v[1], c.v[2], within}) {
            if (min_of(p, box.low) != box.low || max_of(p, box.high) != box.high) continue;  // rounded out
            ASSERT_TRUE(reaches(scene.bvh, root, p, owner, primitive)) << "instance " << i << ", " << primitive;
        }
    }
}

void expect_boxes_are_numbers(const Bvh& bvh) {
    for (const BvhNode& node : bvh.nodes) {
        for (uint32_t i = 0; i < k_node_width; ++i) {
            if (node.child[i] == k_none) continue;
            for (uint32_t axis = 0; axis < 3; ++axis) {
                ASSERT_TRUE(is_finite(node.bounds[axis][i]) && is_finite(node.bounds[axis + 3][i]));
                ASSERT_LE(node.bounds[axis][i], node.bounds[axis + 3][i]);
            }
        }
    }
}

// Half of the rays are aimed at vertices, where a gap would show.
Ray random_ray(const RayScene& scene, std::mt19937& random, float size) {
    Ray ray{random_point(random, size), random_direction(random)};
    const InstanceView& instance = scene.instances[random() % scene.instances.size()];
    const GeometryView& geometry = scene.geometries[instance.geometry];
    if (random() % 2 == 0 || geometry.kind != GeometryKind::mesh) return ray;
    const Triangle& triangle = geometry.triangles[random() % geometry.primitive_count];
    const Vec3 target = transform_point(instance.object_to_world, geometry.positions[triangle.v[random() % 3]]);
    if (length(target - ray.origin) > 0) ray.direction = target - ray.origin;
    return ray;
}

// Rays that lie in the plane of such a triangle may meet it beside its box, which trees hide from each other.
bool has_no_area(const RayScene& scene, const Hit& hit) {
    if (!hit.found()) return false;
    const InstanceView& instance = scene.instances[hit.instance];
    const GeometryView& geometry = scene.geometries[instance.geometry];
    if (geometry.kind != GeometryKind::mesh) return false;
    const Corners c = corners_of(geometry, &instance, hit.primitive);
    const Vec3 a = c.v[1] - c.v[0], b = c.v[2] - c.v[0];
    return length(cross(a, b)) <= 1e-5f * (length_squared(a) + length_squared(b));
}

// The same distances to the last bit, and the same primitives but where two are equally far.
void expect_same_hits(const RayScene& scene, float size, int rays, uint32_t seed) {
    std::mt19937 random(seed);
    RayScene anew = scene;
    anew.bvh = build_anew(scene);
    const SceneView view = scene.view(), expected = anew.view();
    int found = 0;
    for (int i = 0; i < rays; ++i) {
        const Ray ray = random_ray(scene, random, size);
        const Hit hit = closest_hit(view, ray, {}), other = closest_hit(expected, ray, {});
        if (has_no_area(scene, hit) || has_no_area(scene, other)) continue;
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", ray " << i);
        ASSERT_EQ(hit.t, other.t);
        if (hit.instance != other.instance || hit.primitive != other.primitive) {
            ASSERT_EQ(closest_hit(expected, ray, {other.instance, other.primitive}).t, other.t) << "a tie";
        } else {
            ASSERT_EQ(hit.u, other.u);
            ASSERT_EQ(hit.v, other.v);
        }
        ASSERT_EQ(any_hit(view, ray, {}, {}), other.found());
        found += hit.found();
    }
    EXPECT_GT(found, rays / 50) << "the rays must test something";
}

Affine scaled(float x, float y, float z, Vec3 shift = {}) {
    return {{{x, 0, 0, shift.x}, {0, y, 0, shift.y}, {0, 0, z, shift.z}}};
}

Affine turned(float angle, Vec3 shift = {}) {
    const float c = std::cos(angle), s = std::sin(angle);
    return {{{c, -s, 0, shift.x}, {s, c, 0, shift.y}, {0, 0, 1, shift.z}}};
}

// Long thin boards at all angles, which builds cut.
Mesh make_boards(int count, uint32_t seed) {
    std::mt19937 random(seed);
    Mesh mesh;
    for (int i = 0; i < count; ++i) {
        const Vec3 middle = random_point(random, 1), along = random_direction(random) * 0.5f;
        const Vec3 across = normalize(cross(along, random_direction(random))) * 0.01f;
        mesh.add(middle - along, middle + along, middle + across);
    }
    return mesh;
}

// Indices of what `crowd` has.
enum Geometries : uint32_t { k_ball, k_shared, k_small, k_boards, k_spheres, k_many_spheres };

// Flattened and instanced meshes, mirrored ones, boards, and spheres of both kinds.
RayScene crowd() {
    std::mt19937 random(3);
    RayScene scene;
    scene.add(make_ball(40, 60, 0.1f));
    scene.add(make_ball(24, 48, 0.2f));
    scene.add(make_cube());
    scene.add(make_boards(300, 4));
    std::vector<Sphere> spheres, many;
    for (int i = 0; i < 50; ++i) spheres.push_back({random_point(random, 1.5f), 0.1f});
    for (int i = 0; i < 3000; ++i) many.push_back({random_point(random, 1), 0.02f});
    scene.add(spheres), scene.add(many);
    scene.place(k_ball, turned(0.3f));
    scene.place(k_shared, scaled(-0.4f, 0.4f, 0.4f, {1, 1, 0}));  // mirrored
    for (int i = 0; i < 4; ++i) scene.place(k_shared, random_affine(random, 0.5f, 1.5f));
    scene.place(k_small, scaled(-0.2f, 0.3f, 0.2f, {-1, 0, 1}));
    for (int i = 0; i < 4; ++i) scene.place(k_small, random_affine(random, 0.3f, 1.5f));
    scene.place(k_boards, turned(1));
    scene.place(k_spheres);
    for (int i = 0; i < 2; ++i) scene.place(k_many_spheres, scaled(0.5f, 0.6f, 0.7f, random_point(random, 1)));
    return scene;
}

struct Deformation {
    const char* name;
    std::function<Vec3(Vec3)> map;
};

const std::vector<Deformation>& deformations() {
    static const std::vector<Deformation> all{
        {"shift", [](Vec3 p) { return p + Vec3{0.1f, -0.2f, 0.05f}; }},
        {"twist", [](Vec3 p) { return transform_point(turned(2 * p.z), p); }},
        {"mirror", [](Vec3 p) { return Vec3{-p.x, p.y, p.z}; }},
        {"grow", [](Vec3 p) { return p * 3; }},
        {"far away", [](Vec3 p) { return p + Vec3{1000, 0, 0}; }},
        {"flatten", [](Vec3 p) { return Vec3{p.x, p.y, 0.25f}; }},
        {"line", [](Vec3 p) { return Vec3{p.x, 0.5f, 0.25f}; }},
        {"fold", [](Vec3 p) { return p.x > 0 ? p : Vec3{0, p.y, p.z}; }},
        {"scramble",
         [](Vec3 p) { return Vec3{std::sin(40 * p.x + p.y), std::sin(50 * p.y + p.z), std::sin(60 * p.z)}; }},
    };
    return all;
}

class BvhRefitAfter : public testing::TestWithParam<Deformation> {};

TEST_P(BvhRefitAfter, FindsWhatANewTreeFinds) {
    RayScene scene = crowd();
    scene.build();
    for (const uint32_t g : {k_ball, k_shared, k_small, k_boards}) scene.deform(g, GetParam().map);
    for (const uint32_t g : {k_spheres, k_many_spheres}) {
        for (Sphere& s : scene.spheres_of(g)) s = {GetParam().map(s.center), s.radius * 1.5f};
    }
    update(scene, everything(scene));
    expect_boxes_are_numbers(scene.bvh);
    expect_cover(scene, 20000, 51);
    expect_same_hits(scene, 2, 3000, 52);
    // And from there to somewhere else.
    for (const uint32_t g : {k_ball, k_shared, k_small, k_boards}) {
        scene.deform(g, [](Vec3 p) { return transform_point(turned(0.5f, {0.1f, 0, 0}), p); });
    }
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        Affine moved = scene.instances[i].object_to_world;
        moved.m[i % 3][3] += 0.2f;
        scene.move(i, moved);
    }
    update(scene, everything(scene));
    expect_cover(scene, 20000, 53);
    expect_same_hits(scene, 2, 3000, 54);
}

INSTANTIATE_TEST_SUITE_P(All, BvhRefitAfter, testing::ValuesIn(deformations()), [](const auto& chosen) {
    std::string name = chosen.param.name;
    std::erase(name, ' ');
    return name;
});

TEST(BvhRefit, OfWhatStaysChangesNoBit) {
    RayScene scene = crowd();
    scene.instances.erase(scene.instances.begin() + 6, scene.instances.begin() + 12);  // what is cut: parts may grow
    scene.build();
    const Bvh before = scene.bvh;
    update(scene, nothing(scene));
    expect_same(scene.bvh, before);
    update(scene, everything(scene));
    expect_same(scene.bvh, before);
}

TEST(BvhRefit, BoundsAreThoseOfANewTree) {
    RayScene scene = crowd();
    scene.build();
    scene.deform(k_ball, deformations()[1].map);
    scene.deform(k_boards, deformations()[1].map);
    scene.move(1, turned(1, {3, 0, 0}));
    update(scene, everything(scene));
    const Bvh anew = build_anew(scene);
    EXPECT_EQ(scene.bvh.low, anew.low);
    EXPECT_EQ(scene.bvh.high, anew.high);
}

TEST(BvhRefit, OnlyWhatMovedNeedsToBeNamed) {
    RayScene scene = crowd();
    scene.build();
    scene.deform(k_shared, deformations()[1].map);
    scene.deform(k_boards, deformations()[1].map);
    scene.move(0, turned(2, {0.5f, 0, 0}));
    Moved moved = nothing(scene);
    moved.geometries[k_shared] = moved.geometries[k_boards] = moved.instances[0] = 1;
    update(scene, moved);
    expect_cover(scene, 20000, 55);
    expect_same_hits(scene, 2, 5000, 56);
}

TEST(BvhRefit, IsTheSameForAnyThreadCount) {
    RayScene scene = crowd();
    scene.place(scene.add(make_ball(150, 200, 0.1f)), turned(0.2f));
    scene.build();
    const RayScene built = scene;
    scene.deform(k_ball, deformations()[1].map);
    scene.deform(k_boards, deformations()[1].map);
    RayScene other = scene;
    update(scene, everything(scene));
    for (const unsigned threads : {2u, 4u}) {
        other.bvh = built.bvh;
        update(other, everything(scene), k_never, threads);
        expect_same(other.bvh, scene.bvh);
        EXPECT_EQ(other.bvh.built_costs, scene.bvh.built_costs);
    }
}

// Small steps, as while something is dragged: what the parts of boards cover together never gets less.
TEST(BvhRefit, PartsCoverTheirTrianglesAfterManySteps) {
    RayScene scene;
    scene.place(scene.add(make_boards(2000, 7)));
    scene.build();
    ASSERT_GT(scene.bvh.triangle_blocks.size() * k_block_width, 2 * scene.geometries[0].primitive_count);
    for (int step = 0; step < 20; ++step) {
        scene.deform(0, [&](Vec3 p) { return transform_point(turned(0.1f * p.z + 0.05f, {0.01f, 0, 0}), p); });
        update(scene, everything(scene));
    }
    expect_cover(scene, 50000, 57);
    expect_same_hits(scene, 1.5f, 5000, 58);
}

TEST(BvhRefit, PartsStayParts) {
    RayScene scene;
    scene.place(scene.add(make_boards(2000, 7)));
    scene.build();
    scene.deform(0, [](Vec3 p) { return transform_point(turned(0.1f * p.z), p); });
    update(scene, everything(scene), 1.1);
    EXPECT_TRUE(scene.bvh.built_costs[0].has_value()) << "costs hardly more than before";
}

TEST(BvhRefit, BuildsAnewWhatTheRuleSays) {
    RayScene scene = crowd();
    scene.build();
    for (const uint32_t g : {k_ball, k_shared, k_boards}) scene.deform(g, deformations().back().map);
    scene.move(1, turned(1, {3, 0, 0}));
    update(scene, everything(scene), k_always);
    expect_same(scene.bvh, build_anew(scene));
    // A part of them alone, whose sizes change as boards are cut otherwise.
    scene.deform(k_shared, [](Vec3 p) { return p.x > 0.2f ? p * 5 : p; });
    Moved moved = nothing(scene);
    moved.geometries[k_shared] = 1;
    update(scene, moved, k_always);
    expect_same(scene.bvh, build_anew(scene));
}

TEST(BvhRefit, RuleKeepsGoodTreesAndReplacesBadOnes) {
    Mesh loose;  // triangles that share no vertex
    const Mesh ball = make_ball(60, 80, 0.1f);
    for (const Triangle& t : ball.triangles) {
        loose.add(ball.positions[t.v[0]], ball.positions[t.v[1]], ball.positions[t.v[2]]);
    }
    RayScene scene;
    scene.place(scene.add(loose));
    scene.build();
    const Moved moved = everything(scene);
    const auto keeps = [&](const std::function<Vec3(Vec3)>& map) {
        scene.deform(0, map);
        update(scene, moved, k_max_growth);
        return scene.bvh.built_costs[0].has_value();
    };
    EXPECT_TRUE(keeps([](Vec3 p) { return transform_point(turned(0.2f * p.z, {5, 0, 0}), p); }));
    EXPECT_TRUE(keeps([](Vec3 p) { return p * 100; })) << "sizes do not matter";
    EXPECT_TRUE(keeps([](Vec3 p) { return p * 1e-4f; }));
    std::mt19937 random(8);
    uint32_t corner = 0;
    Vec3 shift;
    EXPECT_FALSE(keeps([&](Vec3 p) { return p + (shift = corner++ % 3 == 0 ? random_point(random, 0.01f) : shift); }));
    expect_same(scene.bvh, build_anew(scene));
    EXPECT_TRUE(keeps([](Vec3 p) { return p + Vec3{0.1f, 0, 0}; }));
    EXPECT_TRUE(keeps([](Vec3) { return Vec3{1, 2, 3}; })) << "all in a point";
}

TEST(BvhRefit, FromAPointIsBuiltAnew) {
    const Mesh ball = make_ball(30, 40);
    RayScene scene;
    scene.place(scene.add(ball));
    scene.deform(0, [](Vec3) { return Vec3{1, 2, 3}; });
    scene.build();
    size_t i = 0;
    scene.deform(0, [&](Vec3) { return ball.positions[i++]; });
    update(scene, everything(scene), k_max_growth);
    expect_same(scene.bvh, build_anew(scene));
}

TEST(BvhRefit, InstancesThatScatterLeaveTheirTreesAlone) {
    std::mt19937 random(9);
    RayScene scene;
    const uint32_t ball = scene.add(make_ball(60, 80, 0.1f));
    for (int i = 0; i < 400; ++i) {
        const auto x = static_cast<float>(i % 20), y = static_cast<float>(i / 20);
        scene.place(ball, scaled(0.3f, 0.3f, 0.3f, {x, y, 0}));
    }
    scene.build();
    for (uint32_t i = 0; i < 400; ++i) scene.move(i, scaled(0.3f, 0.3f, 0.3f, random_point(random, 10)));
    Moved moved = nothing(scene);
    moved.instances.assign(400, 1);
    update(scene, moved, k_max_growth);
    EXPECT_FALSE(scene.bvh.built_costs[0].has_value());
    expect_same(scene.bvh, build_anew(scene));
    // While what they place shrinks, and so do its boxes.
    scene.deform(ball, [](Vec3 p) { return p * 30; });
    scene.build();
    scene.deform(ball, [](Vec3 p) { return p * 1e-4f; });
    for (uint32_t i = 0; i < 400; ++i) scene.move(i, scaled(0.3f, 0.3f, 0.3f, random_point(random, 10)));
    update(scene, everything(scene), k_max_growth);
    EXPECT_TRUE(scene.bvh.built_costs[1].has_value());
    EXPECT_FALSE(scene.bvh.built_costs[0].has_value());
}

TEST(BvhRefit, SpheresThatBecomeEllipsoidsStandApart) {
    RayScene scene;
    scene.place(scene.add(std::vector<Sphere>{{{0, 0, 0}, 1}, {{3, 0, 0}, 1}}));
    scene.place(scene.add(make_cube()), turned(0, {0, 5, 0}));
    scene.build();
    ASSERT_EQ(scene.bvh.instance_roots[0], k_none);
    scene.move(0, scaled(1, 2, 1));
    Moved moved = nothing(scene);
    moved.instances[0] = 1;
    update(scene, moved);
    expect_same(scene.bvh, build_anew(scene));
    EXPECT_NE(scene.bvh.instance_roots[0], k_none);
}

TEST(BvhRefit, EmptyScenes) {
    RayScene scene;
    scene.build();
    update(scene, everything(scene));
    scene.place(scene.add(Mesh{}));
    scene.build();
    update(scene, everything(scene));
    EXPECT_EQ(scene.bvh.root, k_none);
}

}  // namespace
}  // namespace vlp::test
