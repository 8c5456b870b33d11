// Every strategy alone, without weights, finds the same light of each path length.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "path_recorder.h"
#include "tails.h"
#include "transport_scenes.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_most = 7;  // vertices of the longest path looked at, plus one

// Sums over the film of what each strategy finds alone, by the number of path vertices and of light vertices.
struct Tally {
    double light[k_most][k_most] = {};

    void visit(const EyeWalk&) {}
    void add(const SplatRecorder::Found& found) {
        Contribution c = found.splat.found;
        c.value *= found.on_film;
        add(c);
    }
    void add(const Contribution& c) {
        const uint32_t n = c.s + c.t;
        if (n < k_most) light[n][c.s] += static_cast<double>(average(c.value));
    }
};

struct StrategyScene {
    std::string name;
    std::function<void(Scene&)> fill;
    std::function<bool(uint32_t n, uint32_t s)> possible;  // by the delta distributions in all paths of n vertices

    friend void PrintTo(const StrategyScene& scene, std::ostream* out) { *out << scene.name; }
};

bool all_possible(uint32_t, uint32_t) { return true; }
bool never_hit(uint32_t, uint32_t s) { return s > 0; }

// Surfaces far enough apart that no connection is short: 1 / distance^2 has no variance otherwise.
void add_plates(Scene& scene, CameraKind camera = CameraKind::perspective) {
    scene.set_camera(looking(camera, {0.3f, -3.4f, 1.5f}, {0, 0.2f, 0.7f}, 0.4f, 2.5f));
    const Mesh ball = make_ball(5, 6);
    const Mesh floor = quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
    add_surface(scene, floor, k_white, {}, tilted_normals(floor, {0.5f, 0.4f, 0}));
    add_surface(scene, quad({-1, 1.3f, 0.4f}, {1, 1.3f, 0.4f}, {1, 1.3f, 2}, {-1, 1.3f, 2}), k_glossy);
    add_surface(scene, quad({-1.4f, 1, 0.3f}, {-1.4f, -1, 0.3f}, {-1.4f, -1, 1.5f}, {-1.4f, 1, 1.5f}), k_layered);
    add_surface(scene, ball, k_red, placed_at({-0.35f, 0, 0.7f}, {0.35f, 0.35f, 0.3f}), round_normals(ball));
    add_surface(scene, ball, k_glossy, placed_at({0.6f, 0.1f, 0.8f}, {0.35f, -0.3f, 0.4f}),
                leaning_normals(ball, 0.4f));
}

// The camera looks through one rough interface at a floor, from the outside of the glass.
void add_pool(Scene& scene) {
    scene.set_camera(looking({0.2f, -2, 2.4f}, {0, 0.2f, 0.5f}, 0.4f));
    add_surface(scene, quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}), k_white);
    add_surface(scene, quad({-1, -1, 0.6f}, {1, -1, 0.6f}, {1, 1, 0.6f}, {-1, 1, 0.6f}), k_rough_glass);
    add_surface(scene, quad({-1, 1.3f, 0.9f}, {1, 1.3f, 0.9f}, {1, 1.3f, 2}, {-1, 1.3f, 2}), k_red);
}

// A shining ball in a larger one that only refracts: every path leaves the light through one specular vertex, as long as
// it does not come back to it, which takes 7 vertices. The camera does not see the balls.
void add_lens(Scene& scene) {
    scene.set_camera(looking({0, -0.2f, 0.75f}, {0, 0.2f, 0}, 1.0f));
    std::vector<LobeInput> lobes{lobe(LobeKind::refraction, 1)};
    const uint32_t refraction = scene.add_material(lobes, {});
    const uint32_t light = scene.add_material({}, {6, 5, 4});
    add_sphere(scene, {0, 0, 1.4f}, 0.5f, static_cast<int32_t>(refraction));
    add_sphere(scene, {0, 0, 1.4f}, 0.3f, static_cast<int32_t>(light));
    add_surface(scene, quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}), k_white);
    add_surface(scene, quad({-1, 1.3f, 0.4f}, {1, 1.3f, 0.4f}, {1, 1.3f, 2}, {-1, 1.3f, 2}), k_glossy);
    add_surface(scene, quad({-1.4f, 1, 0.3f}, {-1.4f, -1, 0.3f}, {-1.4f, -1, 1.5f}, {-1.4f, 1, 1.5f}), k_layered);
}

std::vector<StrategyScene> strategy_scenes() {
    const Vec3 above{0.1f, -0.2f, 2.2f};
    const auto lit = [](auto fill, std::optional<Light> light) {
        return [fill, light](Scene& scene) { fill(scene), scene.add_lamp(light.value(), 0); };
    };
    const auto plates = [](CameraKind camera = CameraKind::perspective) {
        return [camera](Scene& scene) { add_plates(scene, camera); };
    };
    const Rgb power{40, 36, 30};
    const Affine large = placed_at(above, {2, 1.2f, 1});
    return {
        {"area", lit(plates(), make_area(large, power, 1, 1, false, k_pi)), all_possible},
        {"narrow_ellipse", lit(plates(), make_area(large, power, 1, 1, true, 2.0f)), all_possible},
        {"point", lit(plates(), make_point(above, power, 0)), never_hit},
        {"point_sphere", lit(plates(), make_point(above, power, 0.5f)), all_possible},
        {"spot_sphere", lit(plates(), make_spot(placed_at(above), power, 1.6f, 0.5f, 0.4f)), all_possible},
        {"sun", lit(plates(), make_sun(aslant(above), power, 0)), never_hit},
        {"sun_disc", lit(plates(), make_sun(aslant(above), power, 1.2f)), all_possible},
        {"world", [](Scene& scene) { add_plates(scene), scene.set_world({1, 0.9f, 0.8f}); }, all_possible},
        {"mesh",
         [=](Scene& scene) {
             add_plates(scene);
             add_surface(scene, make_ball(4, 5), k_emitter, placed_at(above, {0.5f, 0.7f, -0.3f}));
         },
         all_possible},
        {"sphere", [=](Scene& scene) { add_plates(scene), add_sphere(scene, above, 0.5f, k_emitter); }, all_possible},
        {"veil",
         [=](Scene& scene) {
             add_plates(scene);
             add_surface(scene, quad({-1.2f, -1, 0.2f}, {1, 0.9f, 0.2f}, {1, 0.9f, 1.9f}, {-1.2f, -1, 1.9f}), k_veil);
             scene.add_lamp(make_area(large, power, 1, 1, false, k_pi).value(), 0);
         },
         all_possible},
        {"orthographic", lit(plates(CameraKind::orthographic), make_area(large, power, 1, 1, false, k_pi)),
         all_possible},
        {"thin_lens", lit(plates(CameraKind::thin_lens), make_area(large, power, 1, 1, false, k_pi)), all_possible},
        {"orthographic_lens", lit(plates(CameraKind::orthographic_lens), make_point(above, power, 0.5f)), all_possible},
        {"rough_glass", lit(add_pool, make_area(large, power, 1, 1, false, k_pi)), all_possible},
        {"lens", add_lens, [](uint32_t n, uint32_t s) { return n <= 6 && s != 1 && s != 2; }},
    };
}

class StrategiesTest : public ::testing::TestWithParam<StrategyScene> {};

constexpr uint32_t k_batches = 128, k_iterations = 20, k_pixels = 12;
constexpr double k_false_alarm = 1e-3;  // of each scene

TEST_P(StrategiesTest, FindTheSameLight) {
    Scene scene;
    add_materials(scene);
    GetParam().fill(scene);
    scene.set_film(k_pixels, k_pixels, {0, 0, k_pixels, k_pixels}, false);
    scene.build(1);
    PassSettings pass;
    pass.light_path_length = 3, pass.eye_path_length = 5;
    pass.light_paths = 1500, pass.vlp_connections = 6, pass.light_samples = 2, pass.splats = true;
    pass.first_times = 2;
    pass = with_kappa(scene.view(), pass);
    PassSettings light_pass = pass;
    light_pass.light_samples = 0;  // so that direct light is splat too

    std::vector<Tally> batches(k_batches);
    for (uint32_t b = 0; b < k_batches; ++b) {
        pass.seed = light_pass.seed = b;  // batches are independent, iterations of one seed are stratified
        for (uint32_t iteration = 0; iteration < k_iterations; ++iteration) {
            const TracedLight light(scene.view(), light_pass, iteration);
            for (const SplatRecorder::Found& found : light.splats) batches[b].add(found);
            for (uint32_t i = 0; i < k_pixels * k_pixels; ++i) {
                trace_eye_path(scene.view(), pass, light.cache, {0, iteration}, i % k_pixels, i / k_pixels, batches[b]);
            }
        }
    }

    struct Estimate {
        uint32_t n, s;
        double mean, variance;
    };
    struct Pair {
        Estimate best, other;
    };
    std::vector<Pair> pairs;
    for (uint32_t n = 3; n < k_most; ++n) {
        std::vector<Estimate> all;
        for (uint32_t s = 0; s + 1 <= n && s <= pass.light_path_length + 1; ++s) {
            if (n - s > pass.eye_path_length + 1 || !GetParam().possible(n, s)) continue;
            double sum = 0, squares = 0;
            for (const Tally& t : batches) sum += t.light[n][s], squares += t.light[n][s] * t.light[n][s];
            const double mean = sum / k_batches;
            all.push_back({n, s, mean, (squares / k_batches - mean * mean) / (k_batches - 1)});
        }
        if (all.size() < 2) continue;
        const auto best = *std::min_element(
            all.begin(), all.end(), [](const Estimate& a, const Estimate& b) { return a.variance < b.variance; });
        for (const Estimate& e : all) {
            if (e.s != best.s) pairs.push_back({best, e});
        }
    }
    const double threshold = sidak(k_false_alarm, pairs.size());
    double worst_noise = 0;
    for (const auto& [best, other] : pairs) {
        const double noise = std::sqrt(best.variance + other.variance), z = (other.mean - best.mean) / noise;
        const double p = normal_tails(z);
        worst_noise = std::max(worst_noise, noise / best.mean);
        EXPECT_GT(best.mean, 0);
        EXPECT_GT(p, threshold) << "paths of " << best.n << " vertices: (s " << other.s << ", t " << other.n - other.s
                                << ") finds " << other.mean / best.mean << " times what (s " << best.s << ", t "
                                << best.n - best.s << ") does, " << z << " standard deviations off (seeds 0 to "
                                << k_batches - 1 << ")";
    }
    std::printf("  %zu comparisons, noise of the worst %.1f %%\n", pairs.size(), 100 * worst_noise);
    EXPECT_GE(pairs.size(), 3u);
}

INSTANTIATE_TEST_SUITE_P(Lights, StrategiesTest, ::testing::ValuesIn(strategy_scenes()),
                         [](const auto& test) { return test.param.name; });

// A ball that shines and scatters receives nothing of its own light, on whichever side of it rounding puts its points.
TEST(Strategies, ConvexEmittersDoNotLightThemselves) {
    for (const Vec3 center : {Vec3{0, 0, 0}, Vec3{10.3f, -20.1f, 0.7f}}) {
        Scene scene;
        add_materials(scene);
        add_sphere(scene, center, 0.3f, k_emitter);
        scene.set_camera(looking(center + Vec3{0, -3, 0.1f}, center, 0.1f));
        scene.set_film(16, 16, {0, 0, 16, 16}, false);
        scene.build(1);
        PassSettings pass;
        pass.light_path_length = 2, pass.eye_path_length = 3, pass.light_paths = 1000, pass.light_samples = 8;
        pass = with_kappa(scene.view(), pass);
        uint32_t seen = 0, reflected = 0;
        record_paths(scene.view(), pass, 0,
                     [&](const reference::Path&, const Contribution& c) { ++(c.s + c.t == 2 ? seen : reflected); });
        EXPECT_GT(seen, 200u);
        EXPECT_EQ(reflected, 0u);
    }
}

}  // namespace
}  // namespace vlp::test
