// What is learnt of a scene's lights: portals where light from infinity comes in, and the lamps whose light the picture shows.
#include "renderer/light_guide.h"

#include <cstring>

#include "gpu_cases.h"
#include "renderer/pilot.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_size = 64;

PassSettings asked() { return balanced(k_size * k_size / 8); }

LightGuide learnt(const Scene& scene, PassSettings pass = asked(), unsigned threads = 1) {
    ThreadPool pool(threads);
    return learn_light_guide(scene.view(), pass, pool);
}

void add_floor(Scene& scene, float side) {
    add_surface(scene, quad({-side, -side, 0}, {side, -side, 0}, {side, side, 0}, {-side, side, 0}), k_white);
}

// A room of 4 x 4 x 3 m with a hole of 1 x 1 m in the wall at x = 2, seen from within.
void add_room(Scene& scene) {
    add_surface(scene, quad({-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}), k_white);
    add_surface(scene, quad({-2, -2, 3}, {2, -2, 3}, {2, 2, 3}, {-2, 2, 3}), k_white);
    add_surface(scene, quad({-2, 2, 0}, {2, 2, 0}, {2, 2, 3}, {-2, 2, 3}), k_white);
    add_surface(scene, quad({-2, -2, 0}, {2, -2, 0}, {2, -2, 3}, {-2, -2, 3}), k_white);
    add_surface(scene, quad({-2, -2, 0}, {-2, 2, 0}, {-2, 2, 3}, {-2, -2, 3}), k_white);
    add_surface(scene, quad({2, -2, 0}, {2, 2, 0}, {2, 2, 1}, {2, -2, 1}), k_white);
    add_surface(scene, quad({2, -2, 2}, {2, 2, 2}, {2, 2, 3}, {2, -2, 3}), k_white);
    add_surface(scene, quad({2, -2, 1}, {2, -0.5f, 1}, {2, -0.5f, 2}, {2, -2, 2}), k_white);
    add_surface(scene, quad({2, 0.5f, 1}, {2, 2, 1}, {2, 2, 2}, {2, 0.5f, 2}), k_white);
}

std::unique_ptr<Scene> room_in_a_wide_land(const std::function<void(Scene&)>& add_lights) {
    return seen(
        [&](Scene& scene) {
            add_room(scene);
            add_surface(scene, quad({-40, -40, -1}, {40, -40, -1}, {40, 40, -1}, {-40, 40, -1}), k_red);
            add_lights(scene);
        },
        looking({-1.5f, -1.5f, 1.5f}, {-0.5f, 2, 0.5f}, 0.5f), k_size);
}

// The part of `n` rays through the middle of the window, from the side that light comes from, that lie in a portal.
double share_through(const Portals& portals, uint32_t n) {
    uint32_t met = 0;
    for (uint32_t i = 0; i < n; ++i) {
        const Vec3 d = normalize(Vec3{-1, unit_float(hash(1, i)) - 0.5f, -unit_float(hash(2, i))});
        bool through = false;
        for (uint32_t p = 0; p < portals.count; ++p) {
            through |= length_squared(cross(Vec3{2, 0, 1.5f} - portals.center[p], d)) <= square(portals.radius[p]);
        }
        met += through;
    }
    return static_cast<double>(met) / n;
}

TEST(LightGuide, FindsTheWindowThatTheSkyIsSeenThrough) {
    const LightGuide guide = learnt(*room_in_a_wide_land([](Scene& scene) { scene.set_world({1, 1, 1}); }));
    ASSERT_GT(guide.portals.count, 0u);
    float shares = 0;
    for (uint32_t i = 0; i < guide.portals.count; ++i) {
        EXPECT_LT(guide.portals.radius[i], 20) << "the land is 56 m in radius";
        shares += guide.portals.share[i];
    }
    EXPECT_NEAR(shares, 1, 1e-5);
    EXPECT_GT(share_through(guide.portals, 1000), 0.9);
    EXPECT_EQ(guide.favoured.count, 0u) << "of one light";
}

TEST(LightGuide, FindsTheWindowThatASunShinesThrough) {
    const LightGuide guide = learnt(*room_in_a_wide_land([](Scene& scene) {
        Affine sun;  // shines along (-1, 0, -1), its own -z
        const Frame f = make_frame(normalize(Vec3{1, 0, 1}));
        const Vec3 columns[3] = {f.tangent, f.bitangent, f.normal};
        for (int j = 0; j < 3; ++j) sun.m[0][j] = columns[j].x, sun.m[1][j] = columns[j].y, sun.m[2][j] = columns[j].z;
        scene.add_lamp(make_sun(sun, {5, 5, 5}, 0).value(), 0);
    }));
    ASSERT_GT(guide.portals.count, 0u);
    const Vec3 d = normalize(Vec3{-1, 0, -1});
    bool through = false;
    for (uint32_t i = 0; i < guide.portals.count; ++i) {
        through |=
            length_squared(cross(Vec3{2, 0, 1.5f} - guide.portals.center[i], d)) <= square(guide.portals.radius[i]);
    }
    EXPECT_TRUE(through);
}

// In a furnace all directions matter alike.
TEST(LightGuide, HasNoPortalsWhereLightComesFromEverywhere) {
    const auto scene = seen(
        [](Scene& s) {
            add_sphere(s, {0, 0, 0}, 1, k_white);
            s.set_world({1, 1, 1});
        },
        looking({0, -3, 0}, {0, 0, 0}, 0.2f), k_size);
    EXPECT_EQ(learnt(*scene).portals.count, 0u);
}

// Nine lamps in cells of their own, of which the picture shows one.
TEST(LightGuide, FavoursTheLampThatIsSeen) {
    const auto scene = seen(
        [](Scene& s) {
            add_floor(s, 30);
            for (int i = 0; i < 9; ++i) {
                const float x = 5.0f * static_cast<float>(i) - 20;
                add_surface(s, quad({x + 2.5f, -30, 0}, {x + 2.5f, 30, 0}, {x + 2.5f, 30, 9}, {x + 2.5f, -30, 9}),
                            k_white);
                s.add_lamp(make_point({x, 0, 2}, {50, 50, 50}, 0.1f).value(), 0);
            }
        },
        looking({1, -3, 1.5f}, {0, 2, 0}, 0.3f), k_size);
    const LightGuide guide = learnt(*scene);
    ASSERT_GT(guide.favoured.count, 0u);
    EXPECT_EQ(guide.favoured.light[0], 4u);
    const SceneView view = guided(scene->view(), [&] {
        PassSettings pass;
        pass.light_guide = guide;
        return pass;
    }());
    EXPECT_GT(pdf_choose_source(view, 4), 0.45f);
    for (uint32_t i = 0; i < 9; ++i) EXPECT_GE(pdf_choose_source(view, i), 0.5f * pdf_choose_source(scene->view(), i));
}

TEST(LightGuide, IsTheSameForAnyThreadCount) {
    const auto scene = room_in_a_wide_land([](Scene& s) { s.set_world({1, 1, 1}); });
    const LightGuide one = learnt(*scene), two = learnt(*scene, asked(), 2);
    EXPECT_EQ(std::memcmp(&one, &two, sizeof one), 0);
}

TEST(LightGuide, IsNotForThePapersMode) {
    const auto scene = room_in_a_wide_land([](Scene& s) { s.set_world({1, 1, 1}); });
    PassSettings pass = asked();
    pass.weighting = Weighting::uniform;
    EXPECT_EQ(for_scene(scene->view(), pass).light_guide.portals.count, 0u);
    EXPECT_GT(for_scene(scene->view(), asked()).light_guide.portals.count, 0u);
}

TEST(LightGuide, OfNothing) {
    const auto dark = seen([](Scene& s) { add_floor(s, 1); }, looking({0, -5, 3}, {0, 0, 0.3f}, 0.5f), k_size);
    EXPECT_EQ(learnt(*dark).portals.count + learnt(*dark).favoured.count, 0u);
    const auto empty = seen([](Scene& s) { s.set_world({1, 1, 1}); }, looking({0, -5, 3}, {0, 0, 0.3f}, 0.5f), k_size);
    EXPECT_EQ(learnt(*empty).portals.count, 0u);
}

}  // namespace
}  // namespace vlp::test
