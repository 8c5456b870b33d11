// Cutting the boxes of long triangles: the parts cover the triangle, stay in its box, and are fewer than the budget.
#include "bvh/presplit.h"

#include <gtest/gtest.h>

#include "tests/native/bvh_oracle.h"

namespace vlp::test {
namespace {

// Long thin boards at all angles.
Mesh make_boards(uint32_t count, float scale = 1) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform(-1, 1);
    Mesh mesh;
    for (uint32_t i = 0; i < count; ++i) {
        const Vec3 middle = Vec3{uniform(random), uniform(random), uniform(random)} * scale;
        const Vec3 along = random_direction(random) * (0.4f * scale);
        const Vec3 across = normalize(cross(along, random_direction(random))) * (0.01f * scale);
        mesh.add(middle - along, middle + along, middle + across);
    }
    return mesh;
}

struct Split {
    RayScene scene;
    RawVector<Ref> before, after;
};

Split split(const Mesh& mesh, unsigned threads = 1) {
    Split result;
    result.scene.place(result.scene.add(mesh));
    ThreadPool pool(threads);
    result.before.resize(mesh.triangles.size());
    const RefRun run{&result.scene.geometries[0], &result.scene.instances[0], 0, 0};
    write_refs({&run, 1}, pool, result.before);
    result.after = result.before;
    presplit(result.after, {result.scene.geometries, result.scene.instances, nullptr}, pool);
    return result;
}

bool contains(const Box& box, Vec3 p) {
    return p.x >= box.low.x && p.y >= box.low.y && p.z >= box.low.z && p.x <= box.high.x && p.y <= box.high.y &&
           p.z <= box.high.z;
}

double area_of(const RawVector<Ref>& refs) {
    double area = 0;
    for (const Ref& ref : refs) area += static_cast<double>(ref.box().half_area());
    return area;
}

TEST(BvhPresplit, PartsCoverTheTriangleWithinItsBox) {
    for (const float scale : {1.0f, 1e-12f, 1e12f}) {
        const Mesh mesh = make_boards(3000, scale);
        const Split s = split(mesh);
        std::vector<std::vector<Box>> parts(mesh.triangles.size());
        for (const Ref& ref : s.after) {
            const Box whole = s.before[ref.primitive].box();
            EXPECT_TRUE(contains(whole, ref.low) && contains(whole, ref.high));
            parts[ref.primitive].push_back(ref.box());
        }
        std::mt19937 random(6);
        std::uniform_real_distribution<float> uniform(0, 1);
        for (uint32_t i = 0; i < 200000; ++i) {
            const auto triangle = static_cast<uint32_t>(random() % mesh.triangles.size());
            const Vec3* const v = &mesh.positions[size_t{3} * triangle];
            const float r = std::sqrt(uniform(random)), t = i % 2 == 0 ? uniform(random) : 0.0f;  // half on an edge
            const Vec3 p = v[0] * (1 - r) + v[1] * (r * (1 - t)) + v[2] * (r * t);
            if (!contains(s.before[triangle].box(), p)) continue;  // rounded out of the triangle
            bool covered = false;
            for (const Box& box : parts[triangle]) covered |= contains(box, p);
            ASSERT_TRUE(covered) << "triangle " << triangle << " of scale " << scale;
        }
    }
}

TEST(BvhPresplit, LongTrianglesGetTighterBoxes) {
    const Split s = split(make_boards(3000));
    EXPECT_GT(s.after.size(), 3 * s.before.size());
    EXPECT_LT(area_of(s.after), 0.3 * area_of(s.before));
}

TEST(BvhPresplit, StaysWithinTheBudget) {
    const Split s = split(make_boards(60000));
    EXPECT_GT(s.after.size(), s.before.size());
    EXPECT_LE(s.after.size(), s.before.size() + k_free_splits + s.before.size() / k_refs_per_split);
}

TEST(BvhPresplit, LeavesFineMeshesAndWallsAlone) {
    for (const Mesh& mesh : {make_ball(100, 200, 0.1f), make_cube()}) {
        const Split s = split(mesh);
        EXPECT_EQ(s.after.size(), s.before.size());
    }
}

TEST(BvhPresplit, DoesNotDependOnThreads) {
    const Mesh mesh = make_boards(40000);
    const Split one = split(mesh), three = split(mesh, 3);
    ASSERT_EQ(one.after.size(), three.after.size());
    for (size_t i = 0; i < one.after.size(); ++i) {
        EXPECT_EQ(one.after[i].primitive, three.after[i].primitive);
        EXPECT_EQ(one.after[i].low.x, three.after[i].low.x);
        EXPECT_EQ(one.after[i].high.z, three.after[i].high.z);
    }
}

TEST(BvhPresplit, HitsAreThoseWithoutATree) {
    const Mesh mesh = make_boards(3000);
    RayScene scene;
    scene.place(scene.add(mesh));
    scene.build();
    ASSERT_GT(scene.bvh.triangle_blocks.size() * k_block_width, 2 * mesh.triangles.size()) << "parts of triangles";
    const BothForms view(scene);
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(-1, 1);
    int found = 0;
    for (int i = 0; i < 4000; ++i) {
        const Ray ray{{uniform(random), uniform(random), uniform(random)}, random_direction(random)};
        const ExactHit exact = exact_closest(scene, ray), wide = exact_closest(scene, ray, 1e-2);
        if (exact.found() != wide.found() || exact.primitive != wide.primitive) continue;  // past a border
        if (exact.found() && exact.margin < 1e-3) continue;
        const Hit hit = closest_hit(view, ray, {});
        EXPECT_EQ(hit.primitive, exact.primitive) << "ray " << i;
        EXPECT_EQ(any_hit(view, ray, {}, {}), exact.found()) << "ray " << i;
        found += exact.found();
    }
    EXPECT_GT(found, 500);
}

}  // namespace
}  // namespace vlp::test
