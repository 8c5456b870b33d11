// Multiple importance weights within the window of path lengths that the passes can make.
//
// A path x_0 ... x_{n-1} runs from a light to the lens. Strategy k makes x_0 ... x_{k-1} by the light walk and the rest by
// the eye walk; k = 0 hits the light, k = 1 is next event, k >= 2 joins an eye vertex to a virtual light point, or the lens
// to a light vertex where k = n - 1. It draws a path with density
//     p_k = count_k * prod_{i < k} light_i * prod_{i >= k} eye_i,
// light_i and eye_i being the densities of x_i per area in the two walks. Neighbouring strategies differ in one vertex, so
// p_{k+1} / p_k = count_{k+1} / count_k * light_k / eye_k, and the weights need only products of such ratios (Veach 1997,
// 10.2). Strategies with k > L + 1 or n - k > K + 1 do not exist (the paper fixes lengths) and are left out, as are those
// whose connection touches a delta distribution. Next event chooses x_0 by a density of its own: p_1 takes it for light_0.
// The lens point x_{n-1} has the same density in every strategy. Eye walks of one pixel, and splats on it, share its filter
// h, which is left out: eye_{n-2} is as if film positions had density 1 per pixel^2, and so the weights of a path sum to
// one whatever the pixel.
#pragma once

#include <type_traits>

#include "integrator/pass.h"
#include "integrator/path_vertex.h"

namespace vlp {

// What a hit counts in the weights beside other draws: those that meet a light by chance have more noise than the densities
// say. Any count is unbiased.
inline constexpr float k_hit_worth = 0.5f;

// How often an iteration draws strategy (s, t) for a pixel: hits once, S light samples, kappa draws of a virtual light point
// by each connection. 0: it is switched off. Those with t = 1 are counted by splat_count.
VLP_HD inline float strategy_count(const PassSettings& pass, uint32_t s, uint32_t t) {
    if (s == 0) return pass.hits ? k_hit_worth : 0.0f;
    return s == 1 ? static_cast<float>(pass.light_samples) : pass.kappa * static_cast<float>(pass.connections_at(t));
}

// Whether the vertices y_i of light paths splat. Those of direct light, i = 1, do so only where there is no next event,
// which finds the same light with less noise: one sample for each pixel, where splats crowd at random.
VLP_HD inline bool splats_from(const PassSettings& pass, uint32_t i) {
    return pass.splats && (i > 1 || pass.light_samples == 0);
}

// Strategies (s, 1): each of R N light paths may splat on the pixel.
VLP_HD inline float splat_count(const PassSettings& pass, uint32_t s) {
    return splats_from(pass, s - 1) ? static_cast<float>(pass.splat_paths()) : 0.0f;
}

// What connections to VLPs have of all strategies that could have made a path, what those at z_1 alone have, and what joining
// light vertices to the lens has.
struct ConnectionShares {
    float all = 0, first = 0, splats = 0;  // `all` counts no splats
};

// Sums what the other strategies have relative to the one at hand.
struct StrategySum {
    Weighting weighting;
    float own_count;
    float sum = 1;

    // `ratio` = density of the other strategy over the density of this one, without the counts. `connection`: t, if it joins
    // to a light vertex; of the lens t is 1.
    VLP_HD void add(float ratio, float count, uint32_t /*connection*/ = 0) {
        const float relative = ratio * count / own_count;
        switch (weighting) {
            case Weighting::uniform:
                sum += relative > 0 ? 1.0f : 0.0f;
                break;
            case Weighting::balance:
                sum += relative;
                break;
            case Weighting::power:
                sum += relative * relative;
                break;
        }
    }
    VLP_HD float weight() const { return 1.0f / sum; }
    VLP_HD ConnectionShares shares() const { return {}; }  // nobody asks
};

// The same, with what connections to light vertices have of it.
struct ConnectionSum {
    StrategySum all;
    float connections = 0, first = 0, splats = 0;

    VLP_HD ConnectionSum(const StrategySum& own, uint32_t connection) : all(own) { count(own.sum, connection); }
    VLP_HD void add(float ratio, float count_, uint32_t connection = 0) {
        const float before = all.sum;
        all.add(ratio, count_);
        count(all.sum - before, connection);
    }
    VLP_HD float weight() const { return all.weight(); }
    VLP_HD ConnectionShares shares() const { return {connections / all.sum, first / all.sum, splats / all.sum}; }

private:
    VLP_HD void count(float part, uint32_t connection) {
        if (connection > 1) connections += part;
        if (connection == 2) first += part;
        if (connection == 1) splats += part;
    }
};

// The one that a sink of contributions asks for as its `Sum`; by default only weights.
template <typename Sink>
struct SumFor {
    using Type = StrategySum;
};
template <typename Sink>
    requires requires { typename Sink::Sum; }
struct SumFor<Sink> {
    using Type = typename Sink::Sum;
};

template <typename Sum = StrategySum>
VLP_HD inline Sum strategy_sum(const PassSettings& pass, float own_count, [[maybe_unused]] uint32_t connection = 0) {
    const StrategySum own{pass.weighting, own_count};
    if constexpr (std::is_same_v<Sum, ConnectionSum>) {
        return {own, connection};
    } else {
        return own;
    }
}

// Adds strategies k_first, k_first + 1, ...: eye vertices become light vertices, from the light's end of the eye walk on.
// `eye` holds z_0 ... z_{t-1} = x_{n-1} ... x_{n-t}; `ratio` is p_{k_first} over the density at hand without counts, and
// `next_ratio` is light / eye density of x_{k_first}, which the connection at hand decides; further ones are in `eye`.
template <typename Sum>
VLP_HD inline void add_longer_light_walks(Sum& sum, const PassSettings& pass, const VertexDensity* eye, uint32_t n,
                                          uint32_t k_first, float ratio, float next_ratio) {
    const uint32_t t_least = pass.splats ? 1 : 2;
    for (uint32_t k = k_first; k <= pass.light_path_length + 1 && k + t_least <= n && ratio > 0; ++k) {
        const VertexDensity &end = eye[n - 1 - k], &freed = eye[n - k];  // x_k and x_{k-1}
        if (!end.specular && !freed.specular)
            sum.add(ratio, k + 1 < n ? strategy_count(pass, k, n - k) : splat_count(pass, k), n - k);
        ratio *= k == k_first ? next_ratio : freed.rev_ratio;
    }
}

// Adds strategies s - 1, s - 2, ..., 0: light vertices become eye vertices, from the light vertex `vlp` = y_{s-1} back to
// the light. `ratio` is eye / light density of the VLP and `next_ratio` of the vertex before it, as connected.
template <typename Sum>
VLP_HD inline void add_shorter_light_walks(Sum& sum, const PassSettings& pass, const LightVertex* vlp, uint32_t s,
                                           uint32_t n, float ratio, float next_ratio) {
    const LightVertex* freed = vlp;  // x_k = y_k, free of the light walk from strategy k on
    for (uint32_t k = s - 1; n - k <= pass.eye_path_length + 1 && ratio > 0; --k, --freed) {
        if (k == 0) {  // y_0 has no slot: `freed` must not be looked at
            sum.add(ratio, strategy_count(pass, 0, n));
            return;
        }
        const bool finite = freed == vlp || !freed->specular();
        if (k == 1) {
            if (finite) sum.add(ratio * freed->next_event_ratio, strategy_count(pass, 1, n - 1));
        } else if (finite && !freed[-1].specular()) {
            sum.add(ratio, strategy_count(pass, k, n - k), n - k);
        }
        ratio *= freed == vlp ? next_ratio : freed->rev_ratio;
    }
}

}  // namespace vlp
