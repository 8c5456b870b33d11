// Whether samples follow a density: Pearson's chi-squared over the cells of a unit square or hypercube.
#pragma once

#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include "core/frame.h"
#include "core/vec.h"

namespace vlp::test {

using Random = std::mt19937_64;

// As the renderer's: 24 bits, below 1.
inline float uniform(Random& random) { return static_cast<float>(random() >> 40) * 0x1p-24f; }
inline Vec2 uniform_2d(Random& random) {
    const float x = uniform(random);
    return {x, uniform(random)};
}

// Probability that a chi-squared variable of `freedom` degrees exceeds `statistic`: the regularised upper incomplete gamma
// function, by its series or its continued fraction (Lentz), whichever converges.
inline double chi_squared_tail(double statistic, double freedom) {
    const double a = freedom / 2, x = statistic / 2;
    if (x <= 0) return 1;
    const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (double n = a + 1; term > sum * 1e-16; n += 1) sum += term *= x / n;
        return 1 - scale * sum;
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int i = 1; i < 100000; ++i) {
        const double an = -i * (i - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        const double change = c * d;
        h *= change;
        if (std::fabs(change - 1) < 1e-15) break;
    }
    return scale * h;
}

struct Fit {
    double p = 0;         // probability of a worse fit by chance
    double expected = 0;  // integral of the density
    double seen = 0;      // share of draws that were valid
};

// What integrating the density by points may miss: all of a cell's corner that it just reaches, and in total.
inline constexpr double k_sliver = 1e-4, k_integral_error = 0.01;

// `draw(point)` fills a point of the unit hypercube and says whether the draw was valid; `density(point)` is per unit
// volume of it. Cells expected to hold fewer than 10 draws are pooled; invalid draws are a cell of their own, which the
// density expects to hold what it lacks to 1. Draws where the density is 0 give p = 0.
template <int N, typename Draw, typename Density>
Fit goodness_of_fit(const int (&cells)[N], uint64_t draws, int subdivision, Random& random, Draw&& draw, Density&& density) {
    size_t cell_count = 1;
    for (const int c : cells) cell_count *= static_cast<size_t>(c);
    std::vector<double> expected(cell_count), seen(cell_count);
    int sub_count = 1;
    for (int i = 0; i < N; ++i) sub_count *= subdivision;
    for (size_t cell = 0; cell < cell_count; ++cell) {  // stratified points in every cell
        double sum = 0;
        for (int s = 0; s < sub_count; ++s) {
            float point[N];
            size_t rest = cell;
            int sub = s;
            for (int i = 0; i < N; ++i) {
                const double in_cell = (sub % subdivision + static_cast<double>(uniform(random))) / subdivision;
                point[i] = static_cast<float>((static_cast<double>(rest % static_cast<size_t>(cells[i])) + in_cell) / cells[i]);
                rest /= static_cast<size_t>(cells[i]);
                sub /= subdivision;
            }
            sum += static_cast<double>(density(point));
        }
        expected[cell] = sum / sub_count / static_cast<double>(cell_count);
    }
    uint64_t valid = 0;
    for (uint64_t n = 0; n < draws; ++n) {
        float point[N];
        if (!draw(point)) continue;
        ++valid;
        size_t cell = 0;
        for (int i = N - 1; i >= 0; --i) {
            const int c = clamp(static_cast<int>(point[i] * static_cast<float>(cells[i])), 0, cells[i] - 1);
            cell = cell * static_cast<size_t>(cells[i]) + static_cast<size_t>(c);
        }
        seen[cell] += 1;
    }
    Fit fit;
    fit.expected = std::accumulate(expected.begin(), expected.end(), 0.0);
    fit.seen = static_cast<double>(valid) / static_cast<double>(draws);
    const double total = static_cast<double>(draws);
    double statistic = 0, pooled_expected = 0, pooled_seen = 0;
    int freedom = -1;
    const auto add = [&](double e, double s) { statistic += (s - e) * (s - e) / e, ++freedom; };
    for (size_t i = 0; i < cell_count; ++i) {
        const double e = expected[i] * total;
        if (e >= 10) {
            add(e, seen[i]);
        } else {
            if (e == 0 && seen[i] > k_sliver * total) return fit;
            pooled_expected += e;
            pooled_seen += seen[i];
        }
    }
    const double missing = total * (1 - fit.expected);
    if (missing >= k_integral_error * total) add(missing, total - static_cast<double>(valid));
    if (pooled_expected >= 10) add(pooled_expected, pooled_seen);
    fit.p = freedom > 0 ? chi_squared_tail(statistic, freedom) : 1;
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
