// Whether draws of any kind follow their density: Pearson's chi-squared over the cells of a unit square or hypercube.
#pragma once

#include <numeric>

#include "chi_squared.h"
#include "core/frame.h"
#include "random_numbers.h"

namespace vlp::test {

struct Fit {
    double p = 0;         // probability of a worse fit by chance
    double expected = 0;  // integral of the density
    double seen = 0;      // share of draws that were valid
};

// What integrating the density by points may miss: all of a cell whose corner alone it reaches, and in total.
inline constexpr double k_sliver = 1e-4, k_integral_error = 0.01;

// `draw(point)` fills a point of the unit hypercube and says whether the draw was valid; `density(point)` is per unit
// volume of it. Invalid draws are a cell of their own, which the density expects to hold what it lacks to 1. Draws
// where the density is 0 give p = 0. Each cell's integral takes `subdivision` ^ N stratified points.
template <int N, typename Draw, typename Density>
Fit goodness_of_fit(const int (&cells)[N], int draws, int subdivision, Random& random, Draw&& draw, Density&& density) {
    size_t cell_count = 1, sub_count = 1;
    for (const int c : cells) cell_count *= static_cast<size_t>(c), sub_count *= static_cast<size_t>(subdivision);
    std::vector<double> expected(cell_count), observed(cell_count);
    for (size_t cell = 0; cell < cell_count; ++cell) {
        double sum = 0;
        for (size_t s = 0; s < sub_count; ++s) {
            float point[N];
            size_t rest = cell, sub = s;
            for (int i = 0; i < N; ++i) {
                const size_t count = static_cast<size_t>(cells[i]), parts = static_cast<size_t>(subdivision);
                const double in_cell = (static_cast<double>(sub % parts) + random.next()) / subdivision;
                point[i] = static_cast<float>((static_cast<double>(rest % count) + in_cell) / cells[i]);
                rest /= count;
                sub /= parts;
            }
            sum += static_cast<double>(density(point));
        }
        expected[cell] = sum / static_cast<double>(sub_count) / static_cast<double>(cell_count) * draws;
    }
    int valid = 0;
    for (int n = 0; n < draws; ++n) {
        float point[N];
        if (!draw(point)) continue;
        ++valid;
        size_t cell = 0;
        for (int i = N - 1; i >= 0; --i) {
            const int c = clamp(static_cast<int>(point[i] * static_cast<float>(cells[i])), 0, cells[i] - 1);
            cell = cell * static_cast<size_t>(cells[i]) + static_cast<size_t>(c);
        }
        observed[cell] += 1;
    }
    Fit fit;
    fit.expected = std::accumulate(expected.begin(), expected.end(), 0.0) / draws;
    fit.seen = static_cast<double>(valid) / draws;
    for (size_t i = 0; i < cell_count; ++i) {
        if (expected[i] == 0 && observed[i] > k_sliver * draws) return fit;
    }
    if (1 - fit.expected >= k_integral_error) {
        expected.push_back((1 - fit.expected) * draws);
        observed.push_back(draws - valid);
    }
    fit.p = compare_counts(observed, expected).p;
    return fit;
}

// Directions around an axis as points of the unit square, of equal area: those with 1 - cos up to `one_minus_cos`.
struct DirectionMap {
    Frame frame;
    float one_minus_cos = 2;

    Vec3 direction(Vec2 p) const {
        const float k = one_minus_cos * p.x, s = safe_sqrt(k * (2 - k)), angle = k_two_pi * p.y;
        return frame.to_world({s * std::cos(angle), s * std::sin(angle), 1 - k});
    }
    Vec2 point(Vec3 d) const {
        const Vec3 l = frame.to_local(d);
        const float s2 = l.x * l.x + l.y * l.y;  // 1 - cos by the sine where it is small
        const float k = l.z > 0 ? s2 / (1 + safe_sqrt(1 - s2)) : 1 - l.z;
        const float angle = std::atan2(l.y, l.x) / k_two_pi;
        return {k / one_minus_cos, angle < 0 ? angle + 1 : angle};
    }
    float solid_angle() const { return k_two_pi * one_minus_cos; }
};

}  // namespace vlp::test
