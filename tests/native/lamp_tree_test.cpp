// The tree over lamps finds the same lamps as a list of them: spheres and areas of all sizes, alone, in heaps and in rows.
#include "light/lamp_tree_build.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/warp.h"
#include "light_scenes.h"
#include "random_numbers.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_seed = 31;

Light lamp(uint32_t i, Random& random, uint32_t arrangement) {
    Vec3 p{10 * random.next() - 5, 10 * random.next() - 5, 10 * random.next() - 5};
    if (arrangement == 1) p = {1, 2, 3};  // a heap
    if (arrangement == 2) p = {static_cast<float>(i) * 0.1f, 0, 0};  // a row
    if (arrangement == 3) p = p * std::exp(-8 * random.next());
    const float size = arrangement == 3 ? std::exp(-6 * random.next()) : 0.1f;
    Affine placed = turned(p);
    return i % 2 ? make_point(p, rgb(1), size).value()
                 : make_area(placed, rgb(1), size, 2 * size, i % 4 == 0, k_pi).value();
}

TEST(LampTree, FindsWhatAListFinds) {
    ThreadPool pool(2);
    Random random{k_seed};
    for (uint32_t arrangement = 0; arrangement < 4; ++arrangement) {
        for (const uint32_t count : {0u, 1u, 4u, 5u, 37u, 10000u}) {
            std::vector<Light> lights;
            std::vector<uint32_t> shapes;
            for (uint32_t i = 0; i < count; ++i) lights.push_back(lamp(i, random, arrangement)), shapes.push_back(i);
            const LampTree tree = build_lamp_tree(lights, shapes, pool);
            ASSERT_EQ(tree.lights.size(), count);
            EXPECT_EQ(tree.nodes.empty(), count <= k_max_lamps_in_leaf);
            SceneView listed, treed;
            listed.lights = treed.lights = lights.data();
            listed.lamps = {shapes.data(), count};
            treed.lamps = {tree.lights.data(), count, tree.nodes.empty() ? nullptr : tree.nodes.data(), tree.root};
            size_t found = 0, near = 0;
            const int rays = count > 1000 ? 300 : 3000;
            for (int n = 0; n < rays; ++n) {
                Ray ray{{20 * random.next() - 10, 20 * random.next() - 10, 20 * random.next() - 10},
                        sample_sphere(random.next_2d())};
                if (n % 3 == 0 && count > 0) {
                    const uint32_t target =
                        min_of(static_cast<uint32_t>(random.next() * static_cast<float>(count)), count - 1);
                    ray.direction = normalize(lights[target].position - ray.origin);
                }
                if (n % 7 == 0) ray.direction = {0, 0, n % 2 ? 1.0f : -1.0f};
                if (n % 5 == 0) ray.t_max = 10 * random.next();
                std::vector<uint32_t> a, b;
                for_each_lamp_hit(listed, ray, [&](uint32_t light, float, Vec3, Vec3) { a.push_back(light); });
                for_each_lamp_hit(treed, ray, [&](uint32_t light, float, Vec3, Vec3) { b.push_back(light); });
                for_each_lamp_near(treed.lamps, ray, [&](uint32_t) { ++near; });
                std::sort(a.begin(), a.end());
                std::sort(b.begin(), b.end());
                ASSERT_EQ(a, b) << "arrangement " << arrangement << ", " << count << " lamps, ray " << n;
                found += a.size();
            }
            if (count >= 37) {
                EXPECT_GT(found, 100u);
            }
            if (count == 10000 && arrangement == 0) {
                EXPECT_LT(near, static_cast<size_t>(rays) * 300);
            }
        }
    }
}

}  // namespace
}  // namespace vlp::test
