// The list of virtual light points: each once, in the order of groups, and groups of those that lie and face alike.
#include "integrator/vlp_groups.h"

#include "random_numbers.h"
#include "renderer/pilot.h"
#include "transport_scenes.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

namespace vlp::test {
namespace {

constexpr VlpGrid k_unit_grid{{0, 0, 0}, {4, 4, 4}};

LightVertex vertex_at(Vec3 position, Vec3 normal, bool connectible = true) {
    LightVertex v{};
    v.position = position;
    v.geometric_normal = encode(normal);
    v.packed = connectible ? LightVertex::k_connectible : 0;
    return v;
}

TEST(VlpGroups, EachSideOfABoxIsAnother) {
    std::set<uint32_t> groups;
    for (const Vec3 n : {Vec3{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
        const uint32_t group = group_of(k_unit_grid, vertex_at({0.5f, 0.5f, 0.5f}, n));
        groups.insert(group);
        if (n.z < 0) continue;  // -z lies in the map's four corners, each a group
        Random random{7};
        for (int k = 0; k < 100; ++k) {
            const Vec3 off{random.next() - 0.5f, random.next() - 0.5f, random.next() - 0.5f};
            const Vec3 near = normalize(n + off * 0.02f);
            EXPECT_EQ(group_of(k_unit_grid, vertex_at({0.5f, 0.5f, 0.5f}, near)), group);
        }
    }
    EXPECT_EQ(groups.size(), 6u);
}

TEST(VlpGroups, CellsDivideTheGrid) {
    std::set<uint32_t> groups;
    for (int i = 0; i < 64; ++i) {
        const Vec3 corner = Vec3{float(i % 4), float(i / 4 % 4), float(i / 16)} * 0.25f;
        const uint32_t group = group_of(k_unit_grid, vertex_at(corner + Vec3{0.01f, 0.01f, 0.01f}, {0, 0, 1}));
        groups.insert(group);
        EXPECT_EQ(group_of(k_unit_grid, vertex_at(corner + Vec3{0.24f, 0.24f, 0.24f}, {0, 0, 1})), group);
    }
    EXPECT_EQ(groups.size(), 64u);
    EXPECT_EQ(*groups.rbegin() - *groups.begin(), 63u);
}

TEST(VlpGroups, WhatLiesOutsideIsInTheNearestCell) {
    const auto group = [](Vec3 at, const VlpGrid& grid) { return group_of(grid, vertex_at(at, {1, 0, 0})); };
    EXPECT_EQ(group({-5, 0.1f, 0.1f}, k_unit_grid), group({0.1f, 0.1f, 0.1f}, k_unit_grid));
    EXPECT_EQ(group({1e30f, 0.1f, 0.1f}, k_unit_grid), group({0.9f, 0.1f, 0.1f}, k_unit_grid));
    EXPECT_EQ(group({1e30f, -1e30f, 3}, {}), group({0, 0, 0}, {})) << "the default grid has one cell";
    Random random{3};
    for (int i = 0; i < 10000; ++i) {
        const Vec3 n{random.next() - 0.5f, random.next() - 0.5f, random.next() - 0.5f};
        const Vec3 at = Vec3{random.next(), random.next(), random.next()} * 3.0f - Vec3{1, 1, 1};
        EXPECT_LT(group_of(k_unit_grid, vertex_at(at, n)), k_vlp_groups);
    }
}

TEST(VlpGroups, RunsListEachOnceInOrder) {
    Random random{5};
    Scene scene;
    add_materials(scene);
    scene.set_camera({});
    scene.set_film(1, 1, {0, 0, 1, 1}, false);
    scene.build(1);
    PassSettings pass;
    pass.vlp_grid = k_unit_grid;
    std::vector<LightVertex> slots;
    std::vector<uint32_t> expected;
    for (uint32_t i = 0; i < 5000; ++i) {
        const Vec3 at{random.next(), random.next(), random.next()};
        const Vec3 n{random.next() - 0.5f, random.next() - 0.5f, random.next() - 0.5f};
        slots.push_back(vertex_at(at, n, random.next() < 0.7f));
        if (slots.back().connectible()) expected.push_back(i);
    }
    const auto group = [&](uint32_t slot) { return group_of(k_unit_grid, slots[slot]); };
    std::stable_sort(expected.begin(), expected.end(), [&](uint32_t a, uint32_t b) { return group(a) < group(b); });
    for (const std::vector<uint32_t>& ends : {std::vector<uint32_t>{5000}, {1, 1, 4000, 5000}}) {
        const auto runs = static_cast<uint32_t>(ends.size());
        std::vector<uint32_t> table(size_t{k_vlp_groups} * runs + 1);
        std::vector<uint32_t> counted(table.size());
        const auto begin = [&](uint32_t run) { return run == 0 ? 0 : ends[run - 1]; };
        for (uint32_t i = 0; i < runs; ++i) {
            count_groups(k_unit_grid, slots.data(), begin(i), ends[i], &table[i], runs);
        }
        std::exclusive_scan(table.begin(), table.end(), table.begin(), 0u);
        EXPECT_EQ(table.back(), expected.size());
        for (const uint32_t m : {1u, 8u}) {
            const Hands hands(m, table.back());
            std::vector<VlpCandidate> stored(hands.places());
            counted = table;
            for (uint32_t i = 0; i < runs; ++i) {
                list_groups(scene.view(), pass, slots.data(), begin(i), ends[i], &counted[i], runs, hands,
                            stored.data());
            }
            std::vector<uint32_t> slots_stored;
            for (uint32_t i = 0; i < table.back(); ++i) slots_stored.push_back(stored[hands.place(i)].slot);
            EXPECT_EQ(slots_stored, expected);
        }
    }
}

// Hand h has numbers h, H + h, 2 H + h ...; blanks, which reflect nothing, are where there is no such number.
TEST(VlpGroups, HandsHaveOneOfEachStratum) {
    for (const uint32_t v : {0u, 1u, 7u, 8u, 9u, 1000u}) {
        for (const uint32_t m : {1u, 7u, 8u, 2000u}) {
            const Hands hands(m, v);
            EXPECT_EQ(hands.size, m);
            EXPECT_EQ(hands.count, (v + m - 1) / m);
            EXPECT_LT(hands.places(), v + m);
            VlpCandidate unlisted{};
            unlisted.red_and_green = 1;
            std::vector<VlpCandidate> stored(hands.places(), unlisted);
            for (uint32_t number = 0; number < v; ++number) stored[hands.place(number)].slot = 1 + number;
            list_blanks(hands, v, stored.data());
            for (uint32_t place = 0; place < stored.size(); ++place) {
                const uint32_t number = place % m * hands.count + place / m;
                EXPECT_EQ(stored[place].slot, number < v ? 1 + number : 0);
                EXPECT_EQ(stored[place].red_and_green, number < v ? 1u : 0u);
            }
        }
    }
}

// A lamp above a square, on which its light is spread nearly evenly: the cells cover it and little else.
TEST(Pilot, TheGridIsWhereTheLightFalls) {
    Scene scene;
    add_materials(scene);
    // Its plane is tilted by so little that its points' z differ in their last bits.
    add_surface(scene, quad({9, -1, -2}, {11, -1, -2.000001f}, {11, 1, -2.000001f}, {9, 1, -2}), k_white);
    scene.set_world({1, 1, 1});
    scene.set_camera({});
    scene.set_film(4, 4, {0, 0, 4, 4}, false);
    scene.build(1);
    PassSettings pass;
    pass.light_paths = 100, pass.light_path_length = 1;
    ThreadPool pool(2);
    const Pilot pilot = trace_pilot(scene.view(), pass, pool);
    EXPECT_GT(pilot.vlps_per_path, 0.1f);
    EXPECT_LE(pilot.vlps_per_path, 1);
    EXPECT_NEAR(pilot.grid.low.x, 9, 0.1);
    EXPECT_NEAR(pilot.grid.low.y, -1, 0.1);
    EXPECT_NEAR(pilot.grid.cells_per_metre.x, 2, 0.1);
    EXPECT_NEAR(pilot.grid.cells_per_metre.y, 2, 0.1);
    EXPECT_EQ(pilot.grid.cells_per_metre.z, 0) << "rounding chooses no cell";
    const PassSettings for_it = for_scene(scene.view(), pass);
    EXPECT_EQ(for_it.vlp_grid.low.x, pilot.grid.low.x);
    EXPECT_FLOAT_EQ(for_it.kappa, 1 / pilot.vlps_per_path);
}

}  // namespace
}  // namespace vlp::test
