// Chi-squared test of any sampler of directions against the density that it claims, narrow lobes included.
//
// Bins cover the whole sphere around an axis; what the sampler refuses is one more bin, which must hold what the
// density leaves of 1. Use `sidak` to keep the chance of a false alarm over a whole family of tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "tails.h"

namespace vlp::test {

struct ChiSquared {
    double p = 0;         // probability of a misfit at least as bad, if the densities are right
    double statistic = 0;
    size_t bins = 0;      // after pooling
    double integral = 0;  // of the density over the sphere
    double success = 0;   // share of the draws that gave a direction
};

// Compares counts with their expectations, pooling bins until each expects at least 10.
inline ChiSquared compare_counts(const std::vector<double>& observed, const std::vector<double>& expected) {
    std::vector<size_t> order(expected.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return expected[a] < expected[b]; });
    ChiSquared result;
    double o = 0, e = 0;
    for (size_t k = 0; k < order.size(); ++k) {
        o += observed[order[k]], e += expected[order[k]];
        if (e < 10 && k + 1 < order.size()) continue;
        if (e > 0)
            result.statistic += (o - e) * (o - e) / e;
        else if (o > 0)
            result.statistic = INFINITY;
        ++result.bins;
        o = e = 0;
    }
    result.p = result.bins < 2 ? (std::isinf(result.statistic) ? 0 : 1)
                               : chi_squared_tail(result.statistic, static_cast<double>(result.bins - 1));
    return result;
}

// Bins of equal size in azimuth and in u = t (2 + w) / (2 (t + w)), t = 1 - cos: small w puts most of them near the axis.
struct SphereBins {
    Vec3 axis{0, 0, 1};
    double width = 1e9;  // about (angle of the lobe)^2 / 2; large: equal steps of the cosine
    int polar = 12, azimuthal = 18;
};

class SphereGrid {
public:
    explicit SphereGrid(const SphereBins& bins) : bins_(bins), frame_(make_frame(bins.axis)) {}

    size_t size() const { return static_cast<size_t>(bins_.polar * bins_.azimuthal); }

    size_t bin_of(Vec3 w) const {
        const Vec3 local = frame_.to_local(w);
        // 1 - cos without the cancellation near the axis
        const double r2 = static_cast<double>(local.x) * local.x + static_cast<double>(local.y) * local.y;
        const double t = local.z > 0 ? r2 / (1 + std::sqrt(std::max(0.0, 1 - r2))) : 1 - static_cast<double>(local.z);
        const double u = t * (2 + bins_.width) / (2 * (t + bins_.width));
        double v = std::atan2(local.y, local.x) / (2 * k_pi_double);
        if (v < 0) v += 1;
        const int i = std::clamp(static_cast<int>(u * bins_.polar), 0, bins_.polar - 1);
        const int j = std::clamp(static_cast<int>(v * bins_.azimuthal), 0, bins_.azimuthal - 1);
        return static_cast<size_t>(i * bins_.azimuthal + j);
    }

    // The integral of `density` (per solid angle) over bin `k`, adaptively, at least `least_depth` halvings deep.
    double integral(size_t k, const std::function<double(Vec3)>& density, int least_depth) const {
        const int i = static_cast<int>(k) / bins_.azimuthal, j = static_cast<int>(k) % bins_.azimuthal;
        const double du = 1.0 / bins_.polar, dv = 1.0 / bins_.azimuthal;
        return refine(density, i * du, j * dv, du, dv, gauss(density, i * du, j * dv, du, dv), least_depth);
    }

private:
    static constexpr double k_pi_double = 3.14159265358979323846;
    static constexpr double k_tolerance = 1e-6;  // of the whole, per cell
    static constexpr int k_depth = 8;

    double at(const std::function<double(Vec3)>& density, double u, double v) const {
        const double w = bins_.width, t = 2 * u * w / (2 + w - 2 * u);
        const double jacobian = 2 * w * (2 + w) / ((2 + w - 2 * u) * (2 + w - 2 * u)) * 2 * k_pi_double;
        const double r = std::sqrt(std::max(0.0, t * (2 - t))), phi = 2 * k_pi_double * v;
        const Vec3 local{static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                         static_cast<float>(1 - t)};
        return density(frame_.to_world(local)) * jacobian;
    }

    // Three points of Gauss-Legendre in each direction.
    double gauss(const std::function<double(Vec3)>& density, double u, double v, double du, double dv) const {
        static constexpr double x[3] = {0.1127016653792583, 0.5, 0.8872983346207417},
                                w[3] = {5.0 / 18, 4.0 / 9, 5.0 / 18};
        double sum = 0;
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) sum += w[i] * w[j] * at(density, u + x[i] * du, v + x[j] * dv);
        }
        return sum * du * dv;
    }

    double refine(const std::function<double(Vec3)>& density, double u, double v, double du, double dv, double coarse,
                  int least_depth, int depth = 0) const {
        du /= 2, dv /= 2;
        double parts[4], fine = 0;
        for (int k = 0; k < 4; ++k) fine += parts[k] = gauss(density, u + (k & 1) * du, v + (k >> 1) * dv, du, dv);
        if (depth == k_depth || (depth >= least_depth && std::fabs(fine - coarse) < k_tolerance)) return fine;
        fine = 0;
        for (int k = 0; k < 4; ++k) {
            fine += refine(density, u + (k & 1) * du, v + (k >> 1) * dv, du, dv, parts[k], least_depth, depth + 1);
        }
        return fine;
    }

    SphereBins bins_;
    Frame frame_;
};

// `draw` returns a unit direction, or nothing where the sampler refuses; `density` is per solid angle.
inline ChiSquared chi_squared(const std::function<std::optional<Vec3>()>& draw,
                              const std::function<double(Vec3)>& density, const SphereBins& bins, int draws) {
    const SphereGrid grid(bins);
    std::vector<double> observed(grid.size() + 1), expected(grid.size() + 1);
    for (int i = 0; i < draws; ++i) {
        const std::optional<Vec3> w = draw();
        observed[w ? grid.bin_of(*w) : grid.size()] += 1;
    }
    double integral = 0;
    for (size_t k = 0; k < grid.size(); ++k) {
        // A bin that got far more than its part of the draws may hide a peak that a few points miss.
        const double crowding = std::max(1.0, observed[k] * static_cast<double>(grid.size()) / draws);
        const double share = grid.integral(k, density, 1 + std::min(4, static_cast<int>(std::log2(crowding) / 2)));
        integral += share;
        expected[k] = share * draws;
    }
    expected.back() = std::max(0.0, 1 - integral) * draws;
    // Quadrature leaves about 1e-4; refusals that few cannot be told from none.
    if (1 - integral < 2e-4 && observed.back() < 2e-4 * draws + 10) expected.back() = observed.back() = 0;
    ChiSquared result = compare_counts(observed, expected);
    result.integral = integral;
    result.success = 1 - observed.back() / draws;
    return result;
}

}  // namespace vlp::test
