// Choosing among virtual light points: what a promise is worth, that none is missed, and that it decides how often each is kept.
#include "integrator/vlp_candidates.h"

#include "integrator/path_tracing.h"
#include "integrator/vlp_groups.h"
#include "path_recorder.h"
#include "random_numbers.h"
#include "transport_scenes.h"

#include <gtest/gtest.h>

#include <numeric>

namespace vlp::test {
namespace {

struct WalkCopies {
    std::vector<EyeWalk> walks;
    void add(const Contribution&) {}
    void visit(const EyeWalk& eye) { walks.push_back(eye); }
};

PassSettings many_candidates() {
    PassSettings pass;
    pass.light_path_length = 8, pass.eye_path_length = 8, pass.light_paths = 200;
    pass.splats = true;
    return pass;
}

// Each connectible eye vertex of a few pixels with each VLP: visit(receiver, promise, connection as if nothing stood between).
template <typename Visit>
void for_each_pair(const SceneView& scene, const PassSettings& pass, const Visit& visit) {
    const TracedLight light(scene, pass, 0);
    for (uint32_t pixel = 0; pixel < scene.camera.width * scene.camera.height; ++pixel) {
        WalkCopies copies;
        trace_eye_path(scene, pass, {}, {0, 0}, pixel % scene.camera.width, pixel / scene.camera.width, copies);
        for (const EyeWalk& eye : copies.walks) {
            if (!scene.materials[eye.surface.material].has_finite) continue;
            const Receiver receiver = make_receiver(scene, pass, eye);
            const Bsdf bsdf = make_bsdf(scene, eye.surface);
            const auto all = static_cast<uint32_t>(light.stored.size());
            for (uint32_t i = 0; i < all; i += k_candidates_at_once) {
                const uint32_t count = min_of(all - i, k_candidates_at_once);
                float promises[k_candidates_at_once];
                promise(receiver, &light.stored[i], count, promises);
                for (uint32_t k = 0; k < count; ++k) {
                    const VlpChoice choice{light.stored[i + k].slot, 1};
                    visit(eye, promises[k], join_unshadowed(scene, pass, light.cache, eye, bsdf, choice).found);
                }
            }
        }
    }
}

TEST(VlpCandidates, ALambertianSurfaceKeepsWhatItPromises) {
    Scene scene;
    add_materials(scene);
    add_surface(scene, quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}), k_white);
    add_surface(scene, quad({-1, 1, 0}, {1, 1, 0}, {1, 1, 2}, {-1, 1, 2}), k_red);
    add_surface(scene, quad({1, 1, 0}, {1, -1, 0}, {1, -1, 2}, {1, 1, 2}), k_red);
    every_light()[6].add(scene);
    scene.set_camera(looking({0, -3.2f, 1.1f}, {0, 0, 0.8f}, 0.45f));
    scene.set_film(12, 12, {0, 0, 12, 12}, false);
    scene.build(1);
    for (const uint32_t times : {1u, 4u}) {
        PassSettings pass = with_kappa(scene.view(), many_candidates());
        pass.first_times = times;
        size_t pairs[2]{};
        for_each_pair(scene.view(), pass, [&](const EyeWalk&, float promised, const Contribution& found) {
            // Longer paths have fewer strategies than are promised.
            if (found.s < 3 || found.s + found.t > pass.eye_path_length + 1) return;
            const Rgb weighted = found.value * found.weight;
            const float light =
                (weighted.r + weighted.g + weighted.b) * static_cast<float>(pass.light_paths) * k_pi * k_pi;
            EXPECT_NEAR(promised, light, 0.02f * light + 1e-6f) << "t " << found.t << ", F " << times;
            ++pairs[found.t == 2];
        });
        EXPECT_GT(pairs[0], 1000u);
        EXPECT_GT(pairs[1], 1000u);
    }
}

TEST(VlpCandidates, WhereThereIsLightItIsPromised) {
    for (const NamedLight& light : every_light()) {
        const auto scene = crowded_room(light.add, 12);
        const PassSettings pass = with_kappa(scene->view(), many_candidates());
        if (!(pass.kappa > 0)) continue;
        size_t with_light = 0;
        for_each_pair(scene->view(), pass, [&](const EyeWalk& eye, float promised, const Contribution& found) {
            EXPECT_TRUE(promised >= 0 && is_finite(promised));
            const float brought = average(found.value * found.weight);
            if (!(brought > 1e-9f)) return;
            ++with_light;
            EXPECT_GT(promised, 0) << light.name << ", material " << eye.surface.material;
        });
        EXPECT_GT(with_light, 1000u) << light.name;
    }
}

// A hand of them all.
struct Crowd {
    std::vector<VlpCandidate> list;
    LightVertexCache cache;
    Receiver receiver{{0, 0, 0}, {0, 0, 1}, 1.0f / 64, {1, 0.5f, 0.25f}, 0.3f, 0.7f};

    explicit Crowd(uint32_t count) {
        Random random{count};
        for (uint32_t i = 0; i < count; ++i) {
            const Vec3 at{random.next() - 0.5f, random.next() - 0.5f, random.next() - 0.2f};
            const Vec3 normal{random.next() - 0.5f, random.next() - 0.5f, random.next() - 0.5f};
            list.push_back({at, encode(normal), detail::pack_halves(random.next(), random.next()),
                            detail::pack_halves(random.next(), 1.0f / 64), random.next(), 1000 + i});
        }
        cache = {nullptr, list.data(), 1};
    }
    std::vector<float> promises() const {
        std::vector<float> all;
        for (uint32_t i = 0; i < list.size(); ++i) {
            float alone[k_candidates_at_once], others[k_candidates_at_once];
            promise(receiver, &list[i], 1, alone);
            const uint32_t first = i / k_candidates_at_once * k_candidates_at_once;
            promise(receiver, &list[first], min_of(static_cast<uint32_t>(list.size()) - first, k_candidates_at_once),
                    others);
            EXPECT_EQ(alone[0], others[i - first]) << "in any company";
            all.push_back(alone[0]);
        }
        return all;
    }
};

// Written out once more, in double.
TEST(VlpCandidates, LanesComputeTheFormula) {
    const Crowd crowd(200);
    const std::vector<float> promises = crowd.promises();
    for (uint32_t i = 0; i < crowd.list.size(); ++i) {
        const VlpCandidate& c = crowd.list[i];
        const Vec3 n = decode(c.normal);
        const double squared = double(length_squared(c.position));
        double at_eye = double(c.position.z) / std::sqrt(squared);
        double at_vlp = -double(dot(n, c.position)) / std::sqrt(squared);
        if (at_eye < 0) at_eye *= -1.0 / 64;
        if (at_vlp < 0) at_vlp *= -1.0 / 64;
        const double geometry = at_eye * at_vlp / squared;
        const double light = double(detail::first_half(c.red_and_green)) +
                             0.5 * double(detail::second_half(c.red_and_green)) +
                             0.25 * double(detail::first_half(c.blue_and_behind));
        const double expected = light * geometry / (1 + (0.3 + 0.7 * double(c.others)) * geometry);
        EXPECT_NEAR(promises[i], expected, 2e-4 * expected + 1e-9);
    }
}

// With as many candidates as VLPs, all of them: each is kept as often as its promise says, over evenly spread u_keep.
TEST(VlpCandidates, EachIsKeptByItsPromise) {
    for (const uint32_t count : {2u, 7u, 8u, 11u, 16u, 29u}) {
        const Crowd crowd(count);
        const std::vector<float> promises = crowd.promises();
        const double sum = std::accumulate(promises.begin(), promises.end(), 0.0);
        PassSettings pass;
        pass.vlp_candidates = count;
        constexpr uint32_t k_draws = 200000;
        std::vector<uint32_t> kept(count);
        for (uint32_t i = 0; i < k_draws; ++i) {
            const auto u_keep = static_cast<uint32_t>((i + 0.5) / k_draws * 0x1p32);
            const VlpChoice choice = choose_virtual_light_point(pass, crowd.cache, crowd.receiver, {1u << 31, u_keep});
            const uint32_t at = choice.slot - 1000;
            ASSERT_LT(at, count);
            ++kept[at];
            EXPECT_NEAR(choice.stands_for, sum / double(promises[at]), 1e-4 * sum / double(promises[at]));
        }
        for (uint32_t i = 0; i < count; ++i) {
            EXPECT_NEAR(kept[i] / double(k_draws), double(promises[i]) / sum, 2e-4) << i << " of " << count;
        }
    }
}

TEST(VlpCandidates, WhatPromisesNothingIsNotKept) {
    Crowd crowd(8);
    crowd.list[1].position = crowd.receiver.position;  // no direction to it
    crowd.list[2].red_and_green = detail::pack_halves(k_infinity, 1);
    crowd.list[3].others = std::nanf("");
    for (const uint32_t black : {0u, 4u, 6u, 7u}) crowd.list[black].others = k_infinity;
    PassSettings pass;
    pass.vlp_candidates = 8;
    const VlpChoice choice = choose_virtual_light_point(pass, crowd.cache, crowd.receiver, {0, 0xb0000000u});
    EXPECT_EQ(choice.slot, 1005u);
    EXPECT_EQ(choice.stands_for, 1);
    crowd.list[5].others = std::nanf("");
    EXPECT_EQ(choose_virtual_light_point(pass, crowd.cache, crowd.receiver, {0, 0xb0000000u}).stands_for, 0);
}

// In a scene of 10^12 m densities per area are so small that their squares, which the power heuristic takes, are no numbers.
TEST(VlpCandidates, PromisesOfHugeScenesAreKept) {
    Scene scene;
    add_materials(scene);
    scene.set_camera({});
    scene.set_film(1, 1, {0, 0, 1, 1}, false);
    scene.build(1);
    LightVertex vlp{};
    vlp.position = {0, 0, 1e12f};
    vlp.geometric_normal = vlp.shading_normal = vlp.to_previous = encode({0, 0, -1});
    vlp.throughput = rgb(1);
    vlp.pdf_area = 1e-24f, vlp.next_event_ratio = 1;
    vlp.packed = LightVertex::k_connectible | 1u << LightVertex::k_index_shift | uint32_t{k_white};
    VertexDensity vertices[2]{};
    vertices[1].pdf_area = 1e-24f;
    EyeWalk eye;
    eye.vertices = vertices, eye.t = 2;
    eye.surface.position = {}, eye.surface.geometric_normal = eye.surface.shading_normal = {0, 0, 1};
    eye.surface.material = k_white;
    eye.w_eye = {0, 0, 1};
    for (const Weighting weighting : {Weighting::uniform, Weighting::balance, Weighting::power}) {
        PassSettings pass = many_candidates();
        pass.weighting = weighting, pass.kappa = 1, pass.vlp_candidates = 2;
        const VlpCandidate list[2]{make_candidate(scene.view(), pass, &vlp, 0),
                                   make_candidate(scene.view(), pass, &vlp, 0)};
        const LightVertexCache cache{&vlp, list, 1};
        const VlpChoice choice =
            choose_virtual_light_point(pass, cache, make_receiver(scene.view(), pass, eye), {0, 0});
        EXPECT_NEAR(choice.stands_for, 2, 1e-5f) << static_cast<int>(weighting);
    }
}

TEST(VlpCandidates, HandsAreDealtEvenly) {
    const Crowd crowd(64);
    PassSettings pass;
    pass.vlp_candidates = 4;
    const LightVertexCache cache{nullptr, crowd.list.data(), 16};
    EXPECT_EQ(deal(pass, cache, 0), cache.stored);
    EXPECT_EQ(deal(pass, cache, 0x0fffffffu), cache.stored);
    EXPECT_EQ(deal(pass, cache, 0x10000000u), cache.stored + 4);
    EXPECT_EQ(deal(pass, cache, 0xffffffffu), cache.stored + 60);
}

// Those of a vertex have a part of the hands each, and all sequences are as even as that of one connection.
TEST(VlpCandidates, ConnectionsShareTheHandsOut) {
    EXPECT_EQ(draw_of_connection({123, 456}, 0, 1).x, 123u);
    EXPECT_EQ(draw_of_connection({123, 456}, 0, 1).y, 456u);
    constexpr uint32_t k_samples = 32;
    for (const uint32_t count : {2u, 3u, 8u, 1024u}) {
        std::vector<int> in_part(k_samples * count);
        std::vector<int> halves(count);
        for (uint32_t index = 0; index < k_samples; ++index) {
            for (uint32_t i = 0; i < count; ++i) {
                const SamplePair u = draw_of_connection(sample_pair(5, reverse_bits(index), 3), i, count);
                ++in_part[static_cast<size_t>(u.x * 0x1p-32 * k_samples * count)];
                halves[i] += u.y < 0x80000000u ? 1 : -1;
            }
        }
        // Where `count` does not divide 2^32 rounding may put a number on the wrong side of a bound.
        const auto filled = std::count(in_part.begin(), in_part.end(), 1);
        EXPECT_GE(static_cast<size_t>(filled), count == 3 ? in_part.size() - 4 : in_part.size()) << count;
        for (const int excess : halves) EXPECT_LE(std::abs(excess), 2) << count;
    }
    EXPECT_EQ(draw_of_connection({0xffffffffu, 0}, 2, 3).x, 0xffffffffu) << "the last hand can be drawn";
}

TEST(VlpCandidates, LanesLinePromisesUp) {
    Random random{3};
    for (int round = 0; round < 1000; ++round) {
        float promises[k_candidates_at_once], begins[k_candidates_at_once];
        for (float& p : promises) p = random.next() < 0.3f ? 0.0f : random.next();
        promises[round % k_candidates_at_once] = 0.5f;
        const float sum = line_up(promises, begins);
        float before = 0;
        for (uint32_t i = 0; i < k_candidates_at_once; ++i) {
            EXPECT_NEAR(begins[i], before, 1e-6f);
            before += promises[i];
        }
        EXPECT_NEAR(sum, before, 1e-6f);
        for (const float at : {0.0f, 0.3f * sum, 0.99f * sum, sum, 2 * sum}) {
            uint32_t expected = 0;
            for (uint32_t i = 0; i < k_candidates_at_once; ++i) {
                if (promises[i] > 0 && begins[i] <= at) expected = i;
            }
            EXPECT_EQ(last_begun(promises, begins, at), expected);
        }
    }
}

// Over all hands and evenly spread u_keep every VLP stands for one of itself on average, but for the last draw that it may miss.
TEST(VlpCandidates, EachBringsItselfInTheMean) {
    const Crowd crowd(29);
    const std::vector<float> promises = crowd.promises();
    PassSettings pass;
    pass.vlp_candidates = 8;
    const Hands hands(8, 29);
    std::vector<VlpCandidate> list(hands.places());
    for (uint32_t i = 0; i < 29; ++i) list[hands.place(i)] = crowd.list[i];
    list_blanks(hands, 29, list.data());
    const LightVertexCache cache{nullptr, list.data(), hands.count};
    std::vector<double> brought(29), one_draw(29);
    constexpr uint32_t k_draws = 100000;
    for (uint32_t hand = 0; hand < hands.count; ++hand) {
        const uint32_t u = hand * (0xffffffffu / hands.count + 1) + 1;
        for (uint32_t i = 0; i < k_draws; ++i) {
            const auto u_keep = static_cast<uint32_t>((i + 0.5) / k_draws * 0x1p32);
            const VlpChoice choice = choose_virtual_light_point(pass, cache, crowd.receiver, {u, u_keep});
            ASSERT_GE(choice.slot, 1000u) << "no blank is kept";
            const uint32_t at = choice.slot - 1000;
            one_draw[at] = double(choice.stands_for) / k_draws / hands.count;
            brought[at] += one_draw[at];
        }
    }
    for (uint32_t i = 0; i < 29; ++i)
        EXPECT_NEAR(brought[i], 1, one_draw[i] + 0.001) << i << " promises " << promises[i];
}

}  // namespace
}  // namespace vlp::test
