// Moving what a scene has: which of its parts become others, and what is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "tests/native/transport_scenes.h"

namespace vlp::test {
namespace {

// Indices of geometries and instances in `crowded_room`.
constexpr uint32_t k_floor = 0, k_white_ball = 6, k_glass_ball = 10, k_shining_mesh = 12, k_shining_ellipsoid = 14;

class SceneMoves : public testing::Test {
protected:
    std::set<ScenePart> changed_by(const std::function<void(Scene&)>& change) {
        std::array<uint64_t, k_scene_part_names.size()> before{};
        for (size_t i = 0; i < before.size(); ++i) before[i] = scene->revision(static_cast<ScenePart>(i));
        scene->reopen({});
        change(*scene);
        scene->build(1);
        std::set<ScenePart> changed;
        for (size_t i = 0; i < before.size(); ++i) {
            if (scene->revision(static_cast<ScenePart>(i)) != before[i]) changed.insert(static_cast<ScenePart>(i));
        }
        return changed;
    }
    Hit hit_from(Vec3 origin, Vec3 direction) const { return closest_hit(scene->view(), {origin, direction}, {}); }

    std::unique_ptr<Scene> scene = crowded_room(every_light().back().add, 8);
    using enum ScenePart;
};

TEST_F(SceneMoves, OfNothingChangeNothing) {
    EXPECT_EQ(changed_by([](Scene&) {}), std::set<ScenePart>{});
}

TEST_F(SceneMoves, OfAMeshChangeGeometryAndTree) {
    Mesh ball = make_ball(6, 8);
    ball.map(placed_at({0, 0, 0}, {1, 0.5f, 1}));
    const auto change = [&](Scene& s) { s.move_mesh(k_white_ball, ball.positions, round_normals(ball), {}, {}); };
    EXPECT_EQ(changed_by(change), (std::set<ScenePart>{geometry, bvh}));
    const Hit hit = hit_from({-0.6f, -0.2f, 1.1f}, {0, 0, -1});
    EXPECT_EQ(hit.instance, k_white_ball);
    EXPECT_FALSE(hit_from({-0.6f, -0.4f, 0.3f}, {-1, 0, 0}).instance == k_white_ball);
}

TEST_F(SceneMoves, OfAnInstanceChangeInstancesAndTree) {
    const auto change = [](Scene& s) { s.move_instance(k_white_ball, placed_at({0, 0, 1}, {0.1f, 0.1f, 0.1f})); };
    EXPECT_EQ(changed_by(change), (std::set<ScenePart>{instances, bvh}));
    EXPECT_EQ(hit_from({0, 0, 1.15f}, {0, 0, -1}).instance, k_white_ball);
    EXPECT_FALSE(scene->view().instances[k_white_ball].mirrored) << "as it was before";
}

TEST_F(SceneMoves, OfASphereReachItsMaterialSlots) {
    const std::vector<Vec3> centers{{0.1f, -0.4f, 0.5f}};
    const std::vector<float> radii{0.1f};
    const auto change = [&](Scene& s) { s.move_spheres(k_glass_ball, centers, radii, std::vector<int32_t>{3}); };
    EXPECT_EQ(changed_by(change), (std::set<ScenePart>{geometry, bvh}));
    EXPECT_EQ(scene->view().geometries[k_glass_ball].material_slots[0], 3);
    EXPECT_EQ(hit_from({0.1f, -0.4f, 0.8f}, {0, 0, -1}).instance, k_glass_ball);
}

TEST_F(SceneMoves, OfWhatShinesChangeLights) {
    const auto change = [](Scene& s) { s.move_instance(k_shining_mesh, placed_at({0, 0, 1}, {0.1f, 0.1f, 0.1f})); };
    EXPECT_EQ(changed_by(change), (std::set<ScenePart>{instances, bvh, lights}));
    const Mesh ball = make_ball(4, 6);
    const auto deform = [&](Scene& s) { s.move_mesh(k_shining_mesh, ball.positions, {}, {}, {}); };
    EXPECT_EQ(changed_by(deform), (std::set<ScenePart>{geometry, bvh, lights}));
}

TEST_F(SceneMoves, OfAnEllipsoidThatBecomesASphereMakeItALight) {
    const uint64_t before = scene->info().emitters;
    const auto change = [](Scene& s) {
        s.move_instance(k_shining_ellipsoid, placed_at({0, 0, 1}, {0.1f, 0.1f, 0.1f}));
    };
    EXPECT_EQ(changed_by(change), (std::set<ScenePart>{instances, bvh, lights}));
    EXPECT_EQ(scene->info().emitters, before + 1);
}

// Light from infinity comes through a disc as wide as the scene.
TEST_F(SceneMoves, BeyondTheBoundsChangeLightsFromInfinity) {
    const auto change = [](Scene& s) { s.move_instance(k_white_ball, placed_at({0, 0, 30})); };
    EXPECT_EQ(changed_by(change), (std::set<ScenePart>{instances, bvh, lights}));
    EXPECT_GT(scene->view().radius, 14);
    scene = crowded_room(every_light().front().add, 8);
    EXPECT_EQ(changed_by(change), (std::set<ScenePart>{instances, bvh}));
    EXPECT_GT(scene->view().radius, 14);
}

TEST_F(SceneMoves, AreRefusedForWhatIsNotThere) {
    const Mesh ball = make_ball(6, 8);
    const std::vector<Vec3> point(1);
    const std::vector<float> radius(1);
    EXPECT_THROW(scene->move_instance(k_floor, {}), std::logic_error);
    EXPECT_THROW(scene->move_mesh(k_white_ball, ball.positions, {}, {}, {}), std::logic_error);
    scene->reopen({});
    EXPECT_THROW(scene->move_mesh(k_floor, ball.positions, {}, {}, {}), std::invalid_argument);
    EXPECT_THROW(scene->move_mesh(k_glass_ball, point, {}, {}, {}), std::invalid_argument);
    EXPECT_THROW(scene->move_spheres(k_floor, point, radius, {}), std::invalid_argument);
    EXPECT_THROW(scene->move_mesh(99, ball.positions, {}, {}, {}), std::invalid_argument);
    EXPECT_THROW(scene->move_instance(99, {}), std::invalid_argument);
    EXPECT_THROW(scene->move_instance(k_floor, placed_at({}, {1, 0, 1})), std::invalid_argument);
    std::vector<Vec3> broken = ball.positions;
    broken[5].y = std::nanf("");
    EXPECT_THROW(scene->move_mesh(k_white_ball, broken, {}, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace vlp::test
