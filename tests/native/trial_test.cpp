// What settings are worth in a scene: predictions beside what comes of them, and what is chosen.
#include "renderer/trial.h"

#include "gpu_cases.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_size = 128;

void add_floor(Scene& scene) { add_surface(scene, quad({-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}), k_white); }

void add_area_lamp(Scene& scene, const Affine& placement) {
    scene.add_lamp(make_area(placement, {20, 20, 20}, 1, 1, false, k_pi).value(), 0);
}

// A ball on a floor under a sky: hardly any light that has met a surface meets another.
std::unique_ptr<Scene> outdoors(uint32_t size = k_size) {
    return seen(
        [](Scene& scene) {
            add_floor(scene);
            add_sphere(scene, {0, 0, 0.5f}, 0.5f, k_red);
            scene.set_world({1, 0.9f, 0.8f});
        },
        looking({0, -5, 3}, {0, 0, 0.3f}, 0.5f), size);
}

// A lamp that shines at the ceiling alone, hidden from below.
std::unique_ptr<Scene> indirect() {
    return seen(
        [](Scene& scene) {
            add_floor(scene);
            add_surface(scene, quad({-2, 2, 0}, {2, 2, 0}, {2, 2, 3}, {-2, 2, 3}), k_white);
            add_surface(scene, quad({-2, -2, 0}, {-2, 2, 0}, {-2, 2, 3}, {-2, -2, 3}), k_white);
            add_surface(scene, quad({-2, -2, 3}, {2, -2, 3}, {2, 2, 3}, {-2, 2, 3}), k_white);
            add_surface(scene, quad({-0.5f, -0.5f, 2.4f}, {0.5f, -0.5f, 2.4f}, {0.5f, 0.5f, 2.4f}, {-0.5f, 0.5f, 2.4f}),
                        k_white);
            add_area_lamp(scene, placed_at({0, 0, 2.5f}, {0.5f, 0.5f, -1}));
        },
        looking({0, -5, 1.5f}, {0, 0, 1}, 0.4f), k_size);
}

// A small lamp over a glass ball.
std::unique_ptr<Scene> caustic() {
    return seen(
        [](Scene& scene) {
            add_floor(scene);
            std::vector<LobeInput> lobes{lobe(LobeKind::dielectric, 1)};
            add_sphere(scene, {0, 0, 0.7f}, 0.5f, static_cast<int32_t>(scene.add_material(lobes, {})));
            add_area_lamp(scene, placed_at({0.6f, 0, 4}, {0.1f, 0.1f, 1}));
        },
        looking({0, -4, 3}, {0, 0, 0.3f}, 0.5f), k_size);
}

PassSettings adaptive() {
    PassSettings pass = balanced(k_size * k_size / 8);
    pass.vlp_candidates = 8;
    pass.adaptive = true;
    return pass;
}

PassSettings uniform() {
    PassSettings pass = adaptive();
    pass.adaptive = false;
    return pass;
}

Trial tried(const Scene& scene, PassSettings pass, unsigned threads = 1) {
    ThreadPool pool(threads);
    return try_out(scene.view(), for_scene(scene.view(), pass), pool);
}

TEST(Trial, SaysTheSameOnAnyThreads) {
    const auto scene = caustic();
    const Trial one = tried(*scene, uniform(), 1), three = tried(*scene, uniform(), 3);
    for (const auto& [a, b] : {std::pair{one.connected[0], three.connected[0]},
                               {one.connected[3], three.connected[3]},
                               {one.unconnected, three.unconnected},
                               {one.unlit, three.unlit}}) {
        EXPECT_EQ(a.eye_variance, b.eye_variance);
        EXPECT_EQ(a.splat_variance, b.splat_variance);
        EXPECT_EQ(a.eye_cost, b.eye_cost);
        EXPECT_EQ(a.light_cost, b.light_cost);
    }
}

// From paths with connections: what a trial of settings without them finds by itself.
TEST(Trial, PredictsARenderWithoutConnections) {
    for (const auto& scene : {outdoors(), indirect()}) {
        PassSettings without = uniform();
        without.vlp_connections = 0;
        const Prospect predicted = tried(*scene, uniform()).unconnected,
                       found = tried(*scene, without).connected.front();
        const double variance = predicted.eye_variance + predicted.splat_variance;
        const double expected = found.eye_variance + found.splat_variance;
        EXPECT_GT(variance, 0.5 * expected);
        EXPECT_LT(variance, 2.5 * expected) << "splats would share what it takes for the eye's";
        EXPECT_NEAR(predicted.eye_cost, found.eye_cost, 0.2 * found.eye_cost);
        EXPECT_NEAR(predicted.light_cost, found.light_cost, 1e-6);
    }
    const Trial trial = tried(*indirect(), uniform());
    EXPECT_GT(trial.unconnected.eye_variance, 2 * trial.connected.front().eye_variance);
    EXPECT_LT(trial.unconnected.eye_cost, 0.8 * trial.connected.front().eye_cost);
}

// The moments of the pixels over some iterations.
std::vector<PixelMoments> measured(const Scene& scene, const PassSettings& pass, uint32_t iterations = 16) {
    const auto cpu = make_cpu_backend(scene, pass, 1);
    std::vector<PixelMoments> moments(scene.window().pixel_count());
    for (uint32_t i = 0; i < iterations; ++i) {
        Film film(scene.window(), pass.splats, pass.guides);
        EXPECT_TRUE(cpu->run_iteration(i, film, false));
        std::vector<float> rgba(moments.size() * 4);
        film.read(rgba);
        for (size_t p = 0; p < moments.size(); ++p) {
            moments[p].add({{rgba[4 * p], rgba[4 * p + 1], rgba[4 * p + 2], 1}}, 1);
        }
    }
    return moments;
}

TEST(Trial, TellsTheVarianceOfSamples) {
    const auto scene = indirect();
    const Trial trial = tried(*scene, uniform());
    ASSERT_EQ(trial.connected.size(), 4u);
    std::vector<double> told, found;
    for (uint32_t option = 0; option < 4; ++option) {
        PassSettings pass = for_scene(scene->view(), uniform());
        pass.first_times = 1u << option;
        double deviation = 0;
        for (const PixelMoments& m : measured(*scene, pass)) {
            deviation += std::sqrt(static_cast<double>(m.relative_variance())) / (k_size * k_size);
        }
        const Prospect& here = trial.connected[option];
        told.push_back(std::sqrt(here.eye_variance + here.splat_variance));
        found.push_back(deviation);
        EXPECT_NEAR(told[option], deviation, 0.3 * deviation) << "F " << pass.first_times;
        EXPECT_NEAR(told[option] / told[0], found[option] / found[0], 0.1) << "F " << pass.first_times;
    }
    EXPECT_LT(found[3], 0.8 * found[0]);
}

// Also of a render without light paths, of which only eye paths with them are tried.
TEST(Trial, PredictsARenderWithoutLightPaths) {
    for (const auto& scene : {outdoors(), indirect()}) {
        const Prospect told = tried(*scene, uniform()).unlit;
        EXPECT_EQ(told.splat_variance, 0);
        EXPECT_EQ(told.light_cost, 0);
        PassSettings without = uniform();
        without.vlp_connections = 0, without.splats = false;
        double deviation = 0;
        // As many as its rare bright paths take: 16 meet so few of them that 0.6 of the deviation is seen.
        for (const PixelMoments& m : measured(*scene, for_scene(scene->view(), without), 128)) {
            deviation += std::sqrt(static_cast<double>(m.relative_variance())) / (k_size * k_size);
        }
        EXPECT_NEAR(std::sqrt(told.eye_variance), deviation, 0.3 * deviation);
        const Prospect found = tried(*scene, without).connected.front();
        EXPECT_NEAR(told.eye_cost, found.eye_cost, 0.2 * found.eye_cost);
    }
    const Trial trial = tried(*caustic(), uniform());
    EXPECT_GT(trial.unlit.eye_variance, 2 * trial.unconnected.eye_variance);
}

// A render may have fewer of the connections that are tried at z_1: what is found besides must be the same.
TEST(Trial, ExpectsTheSameLightOfAnyNumberOfConnections) {
    const auto scene = indirect();
    const Trial trial = tried(*scene, uniform());
    for (size_t option = 1; option < trial.connected.size(); ++option) {
        EXPECT_GT(trial.connected[option].eye_cost, trial.connected[option - 1].eye_cost);
        EXPECT_LT(trial.connected[option].splat_variance, trial.connected[option - 1].splat_variance)
            << "splats share more of the light";
        EXPECT_EQ(trial.connected[option].light_cost, trial.connected[0].light_cost);
    }
    PassSettings without = uniform();
    without.vlp_connections = 0;
    EXPECT_EQ(tried(*scene, without).connected.size(), 1u);
}

// Of a floor under the sun, whose light nothing else finds here. It is even, so its mean is better known than those of pixels.
TEST(Trial, TellsTheVarianceOfSplats) {
    const auto scene = seen(
        [](Scene& s) {
            add_floor(s);
            s.add_lamp(make_sun(aslant({0.3f, 0.2f, 3}), {3, 3, 3}, 0.1f).value(), 0);
        },
        looking({0, -3, 3}, {0, 0, 0}, 0.25f), 64);
    PassSettings pass = uniform();
    pass.vlp_connections = pass.light_samples = 0, pass.hits = false;
    // Wide filters gain from the stratification of light paths, of which a trial does not know: 3 has 0.6 of what it tells.
    for (const float width : {0.7f, 1.0f, 1.5f}) {
        pass.filter_width = width;
        double mean = 0, mean_square = 0;
        for (const PixelMoments& m : measured(*scene, for_scene(scene->view(), pass))) {
            mean += static_cast<double>(m.first) / (16 * 64 * 64);
            mean_square += static_cast<double>(m.second) / (16 * 64 * 64);
        }
        const double variance = (mean_square - mean * mean) / ((mean + 0.1) * (mean + 0.1));
        const Prospect told = tried(*scene, pass).connected.front();
        EXPECT_NEAR(told.splat_variance, variance, 0.2 * variance) << width;
        EXPECT_EQ(told.eye_variance, 0);
    }
}

TEST(Trial, TheBestRoundsCostLeast) {
    for (const double splats : {0.0, 0.01, 0.3, 5.0}) {
        const Prospect prospect{1, splats, 6, 0.5};
        const uint32_t best = prospect.best_rounds(8);
        for (uint32_t rounds = 1; rounds <= 8; ++rounds)
            EXPECT_LE(prospect.inverse_efficiency(best), prospect.inverse_efficiency(rounds));
    }
    EXPECT_EQ((Prospect{1, 0, 6, 0.5}.best_rounds(8)), 1u);
    EXPECT_EQ((Prospect{1, 5, 6, 0.5}.best_rounds(8)), 8u);
    EXPECT_EQ((Prospect{1, 5, 6, 0.5}.best_rounds(3)), 3u);
}

TEST(ForScene, ChoosesWhatPays) {
    const PassSettings open = for_scene(outdoors()->view(), adaptive());
    EXPECT_EQ(open.kappa, 0);
    EXPECT_EQ(open.eye_path_length, 16u + 12 + 1) << "paths of as many vertices as connections could make";
    EXPECT_FALSE(open.splats) << "nor do splats pay where nothing focuses light";
    EXPECT_TRUE(for_scene(caustic()->view(), adaptive()).splats);
    const PassSettings room = for_scene(indirect()->view(), adaptive());
    EXPECT_TRUE(room.splats);
    EXPECT_GT(room.kappa, 0);
    EXPECT_EQ(room.light_rounds, 1u);
    EXPECT_GT(room.first_times, 2u);
    EXPECT_EQ(room.eye_path_length, 16u);
    EXPECT_GT(for_scene(caustic()->view(), adaptive()).light_rounds, 2u);
    const PassSettings as_asked = for_scene(outdoors()->view(), uniform());
    EXPECT_GT(as_asked.kappa, 0);
    EXPECT_EQ(as_asked.light_rounds, 1u);
    EXPECT_EQ(as_asked.first_times, 1u);
}

// Without connections some of its light would be lost, however small the share.
TEST(ForScene, KeepsConnectionsThatNothingReplaces) {
    const auto open = outdoors();
    PassSettings pass = adaptive();
    pass.light_samples = 0;
    EXPECT_GT(for_scene(open->view(), pass).kappa, 0);
    pass = adaptive();
    pass.hits = false;
    EXPECT_GT(for_scene(open->view(), pass).kappa, 0);
    pass = adaptive();
    pass.roulette = false;
    EXPECT_GT(for_scene(open->view(), pass).kappa, 0);
    pass = adaptive();
    pass.light_path_length = 40, pass.eye_path_length = 30;
    EXPECT_GT(for_scene(open->view(), pass).kappa, 0);
    pass = adaptive();
    pass.weighting = Weighting::power;
    EXPECT_GT(for_scene(open->view(), pass).kappa, 0);
    const auto sharp = seen(
        [](Scene& scene) {
            add_floor(scene);
            scene.add_lamp(make_sun(aslant({1, 1, 3}), {3, 3, 3}, 0).value(), 0);
        },
        looking({0, -5, 3}, {0, 0, 0.3f}, 0.5f), k_size);
    EXPECT_GT(for_scene(sharp->view(), adaptive()).kappa, 0);
}

TEST(ForScene, TakesPicturesOfAnySize) {
    for (const uint32_t size : {1u, 2u, 7u, 33u}) {
        const auto scene = outdoors(size);
        PassSettings pass = adaptive();
        pass.light_paths = 1;
        EXPECT_GE(for_scene(scene->view(), pass).light_rounds, 1u);
    }
    const auto dark = seen([](Scene& scene) { add_floor(scene); }, looking({0, -5, 3}, {0, 0, 0.3f}, 0.5f), k_size);
    EXPECT_EQ(for_scene(dark->view(), adaptive()).light_rounds, 1u);
}

// R rounds of N light paths splat as R N light paths do, and leave VLPs as N do.
TEST(LightRounds, SplatAsSoManyPaths) {
    const auto scene = room(16);
    PassSettings pass = balanced(300);
    pass.vlp_connections = 0;
    const PassSettings many = for_scene(scene->view(), pass);
    pass.light_paths = 100, pass.light_rounds = 3;
    const PassSettings rounds = for_scene(scene->view(), pass);
    EXPECT_EQ(rounds.splat_paths(), many.splat_paths());
    expect_same_bits(cpu_sums(*scene, rounds, 3), cpu_sums(*scene, many, 3));
    pass.vlp_connections = 1;
    const PassSettings connected = for_scene(scene->view(), pass);
    pass.light_rounds = 1;
    const PassSettings once = for_scene(scene->view(), pass);
    EXPECT_EQ(connected.kappa, once.kappa);
    const auto vlps = [&](const PassSettings& with) {
        const auto cpu = make_cpu_backend(*scene, with, 2);
        Film film(scene->window(), with.splats, with.guides);
        EXPECT_TRUE(cpu->run_iteration(0, film, false));
        return cpu->counters.stored_vlps.load();
    };
    EXPECT_EQ(vlps(connected), vlps(once));
    EXPECT_GT(vlps(once), 0u);
}

}  // namespace
}  // namespace vlp::test
