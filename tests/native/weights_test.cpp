// The weights of both passes against densities multiplied out over whole paths.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "path_recorder.h"
#include "transport_scenes.h"

namespace vlp::test {
namespace {

struct Counts {
    uint32_t light, eye;  // L, K
    uint32_t paths, connections, samples;  // N, C, S
};
constexpr Counts k_counts[] = {{0, 4, 300, 1, 1}, {1, 1, 300, 1, 2}, {1, 5, 500, 2, 1},
                               {3, 4, 200, 3, 4}, {6, 2, 200, 1, 3}, {5, 5, 100, 2, 1}};

// Whether rounding leaves the path's densities be: edges are long beside the offsets of ray origins, and no surface is met
// at so flat an angle that the rounded directions and normals of a light vertex change its cosine much.
bool well_conditioned(const reference::Path& path) {
    for (uint32_t i = 1; i + 1 < path.size(); ++i) {
        const reference::PathVertex& v = path.x[i];
        const bool first_of_infinite = i == 1 && length_squared(path.to_infinity) > 0;
        if (!first_of_infinite && length(v.surface.position - path.x[i - 1].surface.position) < 0.05f) return false;
        for (const Vec3 w : {v.to_light, v.to_eye}) {
            if (abs_dot(w, v.surface.geometric_normal) < 0.05f || abs_dot(w, v.surface.shading_normal) < 0.05f)
                return false;
        }
    }
    return true;
}

// Relative errors of weights.
struct Errors {
    std::vector<double> good, rest;  // of well-conditioned paths and of others
    uint64_t by_strategy[3] = {0, 0, 0};  // hits, next event, virtual light points

    static double quantile(std::vector<double>& errors, double q) {
        std::sort(errors.begin(), errors.end());
        return errors.empty() ? 0 : errors[static_cast<size_t>(q * static_cast<double>(errors.size() - 1))];
    }
};

void compare_weights(const SceneView& scene, const PassSettings& pass, uint32_t iteration, Errors& errors) {
    record_paths(scene, pass, iteration, [&](const reference::Path& path, const Contribution& c) {
        ASSERT_TRUE(is_finite(c.value) && is_finite(c.weight));
        if (path.light == k_none || c.s + c.t == 2) {  // nothing else makes such a path
            ASSERT_EQ(c.weight, 1);
            return;
        }
        ASSERT_EQ(path.size(), c.s + c.t);
        ASSERT_LE(c.s, pass.light_path_length + 1);
        ASSERT_LE(c.t, pass.eye_path_length + 1);
        const std::vector<double> w = reference::weights(scene, pass, path);
        double sum = 0;
        for (const double x : w) sum += x;
        ASSERT_NEAR(sum, 1, 1e-6);
        const double error = std::fabs(c.weight / w[c.s] - 1);
        const bool good = well_conditioned(path);
        (good ? errors.good : errors.rest).push_back(error);
        ++errors.by_strategy[std::min(c.s, 2u)];
        // The power heuristic squares the densities, which doubles their relative errors.
        const double tolerance = pass.weighting == Weighting::power ? 2e-3 : 1e-3;
        ASSERT_TRUE(!good || error < tolerance)
            << "(s " << c.s << ", t " << c.t << ") has weight " << c.weight << " instead of " << w[c.s];
    });
}

class WeightsTest : public ::testing::TestWithParam<NamedLight> {};

TEST_P(WeightsTest, EqualTheReference) {
    constexpr uint32_t k_pixels = 20;
    const auto scene = crowded_room(GetParam().add, k_pixels);
    Errors errors;
    for (const Counts& counts : k_counts) {
        for (const Weighting weighting : {Weighting::uniform, Weighting::balance, Weighting::power}) {
            PassSettings pass;
            pass.light_path_length = counts.light;
            pass.eye_path_length = counts.eye;
            pass.light_paths = counts.paths;
            pass.vlp_connections = counts.connections;
            pass.light_samples = counts.samples;
            pass.weighting = weighting;
            pass.roulette = counts.light == 5;
            pass.seed = 11;
            pass = with_kappa(scene->view(), pass);
            SCOPED_TRACE("L " + std::to_string(counts.light) + ", K " + std::to_string(counts.eye) + ", weighting " +
                         std::to_string(static_cast<int>(weighting)));
            for (uint32_t iteration = 0; iteration < 2; ++iteration) {
                compare_weights(scene->view(), pass, iteration, errors);
                if (HasFatalFailure()) return;
            }
        }
    }
    const uint64_t* by = errors.by_strategy;
    const size_t good = errors.good.size(), all = good + errors.rest.size();
    std::printf(
        "  %zu weights: hits %zu, next event %zu, VLPs %zu; relative errors: median %.1e, 99.9 %% %.1e, largest %.1e "
        "of the %.0f %% well-conditioned; 99 %% %.1e of the rest\n",
        all, size_t{by[0]}, size_t{by[1]}, size_t{by[2]}, Errors::quantile(errors.good, 0.5),
        Errors::quantile(errors.good, 0.999), Errors::quantile(errors.good, 1),
        100.0 * static_cast<double>(good) / static_cast<double>(all + (all == 0)), Errors::quantile(errors.rest, 0.99));
    if (GetParam().name == "ellipsoid") return;  // found by hits alone
    EXPECT_GT(good, all / 2);
    EXPECT_GT(by[1], 5000u);
    EXPECT_GT(by[2], 2000u);
    EXPECT_LT(Errors::quantile(errors.rest, 0.99), 5e-3);
}

INSTANTIATE_TEST_SUITE_P(Lights, WeightsTest, ::testing::ValuesIn(every_light()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace vlp::test
