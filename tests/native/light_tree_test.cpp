// Choosing lights by a tree: what it draws and how often, that none is missed that shines, and that the near ones are preferred.
#include "light/light_tree_build.h"

#include <gtest/gtest.h>

#include <numbers>

#include "light/light.h"
#include "light/light_build.h"
#include "random_numbers.h"

namespace vlp::test {
namespace {

Affine placed(Random& random, Vec3 at) {
    const Vec3 z = random.direction(), x = normalize(cross(z, random.direction())), y = cross(z, x);
    const Vec3 columns[4] = {x, y, z, at};
    Affine a;
    for (int j = 0; j < 4; ++j) a.m[0][j] = columns[j].x, a.m[1][j] = columns[j].y, a.m[2][j] = columns[j].z;
    return a;
}

// One of any kind that is near.
Light some_light(Random& random, uint32_t kind) {
    const Vec3 at{10 * random.next(), 10 * random.next(), 10 * random.next()};
    const Rgb power = rgb(std::exp(5 * random.next()));
    const float size = 0.01f + random.next();
    switch (kind % 7) {
        case 0:
            return make_point(at, power, 0).value();
        case 1:
            return make_point(at, power, size).value();
        case 2:
            return make_spot(placed(random, at), power, 0.3f + 2 * random.next(), random.next(), 0).value();
        case 3: {
            Affine stretched = placed(random, at);
            for (int i = 0; i < 3; ++i) stretched.m[i][0] *= 5;
            return make_spot(stretched, power, 1.0f, 0.5f, size).value();
        }
        case 4:
            return make_area(placed(random, at), power, size, 1, random.next() < 0.5f,
                             random.next() < 0.5f ? std::numbers::pi_v<float> : 0.5f)
                .value();
        case 5:
            return make_triangle(at, at + random.direction() * size, at + random.direction(), power, 0, 0).value();
        default:
            return make_sphere(at, size, power, 0, 0).value();
    }
}

std::vector<Light> crowd(uint32_t count, Random& random) {
    std::vector<Light> lights;
    for (uint32_t i = 0; i < count; ++i) lights.push_back(some_light(random, i));
    return lights;
}

// A tree and what looks at it.
struct Tree {
    std::vector<Light> lights;
    LightTree tree;
    SceneView scene;

    explicit Tree(std::vector<Light> all) : lights(std::move(all)) {
        ThreadPool pool(2);
        tree = build_light_tree(lights, pool);
        scene.lights = lights.data();
        scene.light_count = static_cast<uint32_t>(lights.size());
        scene.radius = 20;
        scene.light_tree = {tree.nodes.empty() ? nullptr : tree.nodes.data(),
                            tree.places.data(),
                            tree.infinite_lights.data(),
                            {tree.infinite_below.data(), static_cast<uint32_t>(tree.infinite_below.size())},
                            tree.infinite_irradiance};
    }
    float chance(Vec3 position, Vec3 normal, uint32_t light) const {
        return pdf(scene.light_tree, position, normal, light);
    }
};

std::vector<Light> with_infinite(std::vector<Light> lights) {
    lights.insert(lights.begin(), make_environment({0.1f, 0.2f, 0.3f}));
    lights.push_back(make_sun({}, rgb(2), 0.01f).value());
    lights.push_back(make_sun({}, rgb(1), 0).value());
    return lights;
}

TEST(LightTree, DrawsAsOftenAsItSays) {
    Random random{7};
    for (const uint32_t count : {0u, 1u, 2u, 3u, 20u, 200u}) {
        for (const bool infinite : {false, true}) {
            if (count == 0 && !infinite) continue;
            const std::vector<Light> near_ones = crowd(count, random);
            const Tree tree(infinite ? with_infinite(near_ones) : near_ones);
            for (int receiver = 0; receiver < 5; ++receiver) {
                const Vec3 position{14 * random.next() - 2, 14 * random.next() - 2, 14 * random.next() - 2};
                const Vec3 normal = random.direction();
                constexpr uint32_t k_draws = 1u << 18;
                std::vector<uint32_t> drawn(tree.lights.size());
                for (uint32_t i = 0; i < k_draws; ++i) {
                    const DiscreteSample s =
                        sample(tree.scene.light_tree, position, normal, i * (0xffffffffu / k_draws + 1));
                    ASSERT_LT(s.index, drawn.size());
                    ++drawn[s.index];
                    if (i % 256 == 0) {
                        const float told = tree.chance(position, normal, s.index);
                        ASSERT_NEAR(s.pdf, told, 1e-4f * told);
                    }
                }
                double sum = 0;
                for (uint32_t i = 0; i < drawn.size(); ++i) {
                    const auto chance = static_cast<double>(tree.chance(position, normal, i));
                    sum += chance;
                    // Even numbers miss at most one at each end of a light's intervals.
                    EXPECT_NEAR(drawn[i] / double{k_draws}, chance, 2.0 / k_draws + 1e-6)
                        << i << " of " << drawn.size();
                }
                EXPECT_NEAR(sum, 1, 1e-4);
            }
        }
    }
}

TEST(LightTree, MissesNoneThatShines) {
    Random random{11};
    const Tree tree(with_infinite(crowd(70, random)));
    size_t shone = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3 position{14 * random.next() - 2, 14 * random.next() - 2, 14 * random.next() - 2};
        const Vec3 normal = random.direction();
        const uint32_t light = random.bits() % tree.scene.light_count;
        const NextEvent e = sample_next_event(tree.scene, tree.lights[light], position, random.next_2d());
        if (!e.valid() || is_black(e.radiance) || abs_dot(e.direction, normal) == 0) continue;
        ++shone;
        ASSERT_GT(tree.chance(position, normal, light), 0) << "kind " << static_cast<int>(tree.lights[light].kind);
    }
    EXPECT_GT(shone, 5000u);
}

// The bounds of two hold what those of each hold.
TEST(LightTree, NoNodePromisesLessThanItsLights) {
    Random random{13};
    for (int i = 0; i < 20000; ++i) {
        const Light a = some_light(random, random.bits()), b = some_light(random, random.bits());
        const LightTreeNode both = merge(bounds_of(a), bounds_of(b));
        for (const Light& light : {a, b}) {
            const LightTreeNode alone = bounds_of(light);
            EXPECT_LE(length(alone.center - both.center) + alone.radius, both.radius * 1.0001f + 1e-6f);
            EXPECT_GE(both.intensity, alone.intensity);
            EXPECT_LE(both.cos_shine, alone.cos_shine);
            if (alone.cos_normals < 1) {
                EXPECT_EQ(both.cos_normals, -1);
            } else {
                const float cosine = dot(both.axis, alone.axis);
                EXPECT_GE(both.two_sided ? std::fabs(cosine) : cosine, both.cos_normals - 1e-4f);
            }
            // Far away a node is what its lights are together.
            const Vec3 far = random.direction() * 1e4f, normal = random.direction();
            EXPECT_GE(importance(both, far, normal), 0.99f * importance(alone, far, normal));
        }
    }
}

TEST(LightTree, PrefersWhatBringsMore) {
    const auto lamp = [](Vec3 at) { return make_point(at, rgb(10), 0).value(); };
    const Tree tree({lamp({0, 0, 1}), lamp({10, 0, 1}), lamp({0, 10, 1}), lamp({10, 10, 1})});
    EXPECT_GT(tree.chance({0, 0, 0}, {0, 0, 1}, 0), 0.8f);
    EXPECT_GT(tree.chance({10, 10, 0}, {0, 0, 1}, 3), 0.8f);
    // One that shines the other way is never asked; nor is its half.
    Affine up;  // along -z, so down; turned over, up
    up.m[1][1] = up.m[2][2] = -1;
    const Tree turned(
        {make_area({}, rgb(1000), 1, 1, false, k_pi).value(), make_area(up, rgb(1), 1, 1, false, k_pi).value()});
    EXPECT_EQ(turned.chance({0, 0, 5}, {0, 0, 1}, 0), 0);
    EXPECT_EQ(turned.chance({0, 0, 5}, {0, 0, 1}, 1), 1);
    // Near a lamp a sky is asked more seldom than far from it.
    const Tree under_sky({make_environment(rgb(0.1f)), lamp({0, 0, 1})});
    EXPECT_LT(under_sky.chance({0, 0, 0}, {0, 0, 1}, 0), 0.35f);
    EXPECT_GT(under_sky.chance({20, 0, 0}, {0, 0, 1}, 0), 0.8f);
}

// Lights in one place, without extent, too bright or black.
TEST(LightTree, TakesAnyLights) {
    Random random{17};
    std::vector<Light> lights(200, make_point({1, 2, 3}, rgb(0), 0).value());
    lights.push_back(make_point({1, 2, 3}, rgb(1e30f), 0).value());
    lights.push_back(make_point({1e15f, 0, 0}, rgb(1e30f), 1e10f).value());
    const Tree tree(lights);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 position = i % 2 ? Vec3{1, 2, 3} : random.direction() * std::exp(40 * random.next());
        const DiscreteSample s = sample(tree.scene.light_tree, position, random.direction(), random.bits());
        EXPECT_LT(s.index, lights.size());
        EXPECT_TRUE(s.pdf > 0 && s.pdf <= 1);
    }
}

// A lit plane under many lamps: next event by the tree has far less noise than by power.
TEST(LightTree, LeavesLessNoiseThanPower) {
    Random random{19};
    std::vector<Light> lamps;
    for (int i = 0; i < 300; ++i) {
        const Vec3 at{20 * random.next(), 20 * random.next(), 1};
        lamps.push_back(make_point(at, rgb(std::exp(2 * random.next())), 0.05f).value());
    }
    const Tree tree(lamps);
    std::vector<double> powers;
    for (const Light& light : tree.lights) powers.push_back(static_cast<double>(power(light, 20)));
    const std::vector<uint32_t> below = make_distribution(powers);
    double noise[2]{};
    for (int receiver = 0; receiver < 100; ++receiver) {
        const Vec3 position{20 * random.next(), 20 * random.next(), 0};
        const Vec3 normal{0, 0, 1};
        double means[2]{};
        for (int by_tree = 0; by_tree < 2; ++by_tree) {
            double sum = 0, squares = 0;
            constexpr int k_draws = 2000;
            for (int i = 0; i < k_draws; ++i) {
                const DiscreteSample s = by_tree ? sample(tree.scene.light_tree, position, normal, random.bits())
                                                 : sample(Distribution{below.data(), 300}, random.bits());
                const NextEvent e = sample_next_event(tree.scene, tree.lights[s.index], position, random.next_2d());
                if (!e.valid()) continue;
                const auto x =
                    static_cast<double>(e.radiance.g * max_of(e.direction.z, 0.0f) / (e.pdf_solid_angle * s.pdf));
                sum += x, squares += x * x;
            }
            means[by_tree] = sum / k_draws;
            noise[by_tree] += squares / k_draws - means[by_tree] * means[by_tree];
        }
    }
    std::printf("  variance by power %.3g, by the tree %.3g\n", noise[0], noise[1]);
    EXPECT_LT(noise[1], 0.3 * noise[0]);
}

}  // namespace
}  // namespace vlp::test
