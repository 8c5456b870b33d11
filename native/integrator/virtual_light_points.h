// Joining an eye vertex to a virtual light point: the second sum of the paper's (7), with (6) for the VLP's radiance.
#pragma once

#include "bsdf/bsdf.h"
#include "integrator/trace.h"
#include "integrator/vlp_candidates.h"

namespace vlp {

// An eye walk: its vertices' densities from the lens z_0 on, and where it stands.
struct EyeWalk {
    VertexDensity* vertices = nullptr;  // K + 1 of whoever traces the walk
    uint32_t t = 1;     // vertices so far, the lens counted
    Rgb throughput = rgb(1);
    SurfacePoint surface;  // z_{t-1}
    Vec3 w_eye;            // unit, from z_{t-1} to z_{t-2}

    VLP_HD VertexDensity& last() { return vertices[t - 1]; }
    VLP_HD const VertexDensity& last() const { return vertices[t - 1]; }
};

// Light that strategy (s, t) found: its estimate without the weight, the weight, and the end of the path that the eye walk
// does not hold.
struct Contribution {
    uint32_t s = 0, t = 0;
    Rgb value{};
    float weight = 0;
    // Told to sinks that want a ConnectionSum, beside the shares: how many draws this one stands for, as it is kept from several,
    // and which connection of its vertex it is.
    ConnectionShares shares{};
    float draws = 1;
    uint32_t number = 0;
    uint32_t light = k_none;  // s < 2: the light, and the point y_0 (the direction to it where it is infinite)
    Vec3 position{}, normal{};
    const LightVertex* vlp = nullptr;  // s >= 2: y_{s-1}
};

VLP_HD inline SurfacePoint surface_of(const LightVertex& vlp) {
    SurfacePoint p{};
    p.position = vlp.position;
    p.geometric_normal = decode(vlp.geometric_normal);
    const bool flat = vlp.shading_normal.bits == vlp.geometric_normal.bits;
    p.shading_normal = flat ? p.geometric_normal : decode(vlp.shading_normal);
    p.material = vlp.material();
    p.instance = vlp.instance;
    p.primitive = vlp.primitive;
    return p;
}

// For the weight of joining z_{t-1} to a VLP by `edge`, which runs from the eye vertex; both BSDFs as evaluated along it.
template <typename Sum>
VLP_HD inline Sum connection_sum(const PassSettings& pass, const EyeWalk& eye, const LobeValue& at_eye,
                                 const LightVertex* vlp, const LobeValue& at_vlp, const Edge& edge, float cos_eye,
                                 float cos_vlp) {
    const uint32_t s = vlp->index() + 1, n = s + eye.t;
    Sum sum = strategy_sum<Sum>(pass, strategy_count(pass, s, eye.t), eye.t);
    const float light_pdf = at_vlp.pdf_eye * cos_eye / edge.dist_squared;
    add_longer_light_walks(sum, pass, eye.vertices, n, s + 1, light_pdf / eye.last().pdf_area,
                           at_eye.pdf_eye * eye.last().rev_geometry);
    const float eye_pdf = at_eye.pdf_light * cos_vlp / edge.dist_squared;
    add_shorter_light_walks(sum, pass, vlp, s, n, eye_pdf / vlp->pdf_area, at_vlp.pdf_light * vlp->rev_geometry);
    return sum;
}

// A connection of z_{t-1} to a VLP, as long as nothing stands between them.
struct VlpConnection {
    Contribution found;
    Anchor vlp;
    Vec3 direction;  // unit, to it
};

// With nothing between.
template <typename Sum = StrategySum>
VLP_HD inline VlpConnection join_unshadowed(const SceneView& scene, const PassSettings& pass,
                                            const LightVertexCache& cache, const EyeWalk& eye, const Bsdf& eye_bsdf,
                                            VlpChoice choice) {
    const LightVertex* vlp = cache.slots + choice.slot;
    const SurfacePoint point = surface_of(*vlp);
    const Edge edge = edge_between(eye.surface.position, point.position);
    VlpConnection joined{{.s = vlp->index() + 1, .t = eye.t, .vlp = vlp}, anchor_of(point), edge.direction};
    Contribution& found = joined.found;
    const float cos_eye = abs_dot(eye.surface.geometric_normal, edge.direction);
    const float cos_vlp = abs_dot(point.geometric_normal, edge.direction);
    const float geometry = cos_eye * cos_vlp / edge.dist_squared;
    if (!(geometry > 0) || !is_finite(geometry)) return joined;

    const LobeValue at_eye = evaluate(eye_bsdf, eye.w_eye, edge.direction);
    if (is_black(at_eye.f)) return joined;
    const LobeValue at_vlp = evaluate(make_bsdf(scene, point), -edge.direction, decode(vlp->to_previous));
    if (is_black(at_vlp.f)) return joined;

    const float paths = choice.stands_for / static_cast<float>(pass.light_paths);
    found.value = eye.throughput * at_eye.f * at_vlp.f * vlp->throughput * (geometry * paths);
    const Sum sum = connection_sum<Sum>(pass, eye, at_eye, vlp, at_vlp, edge, cos_eye, cos_vlp);
    found.weight = sum.weight();
    found.shares = sum.shares();
    if constexpr (std::is_same_v<Sum, ConnectionSum>) {
        found.draws = choice.stands_for / static_cast<float>(cache.hand_count);
    }
    return joined;
}

// Asks for the memory of the VLP that a connection will read, which lies anywhere: a light sample takes as long as it takes to
// arrive.
VLP_HD inline void prefetch_virtual_light_point([[maybe_unused]] const LightVertexCache& cache,
                                                [[maybe_unused]] VlpChoice choice) {
#if !VLP_ON_DEVICE
    __builtin_prefetch(cache.slots + choice.slot);
    __builtin_prefetch(cache.slots + max_of(choice.slot, 1u) - 1);  // the weights look at the vertices before it
#endif
}

// z_{t-1} as VLPs may light it.
VLP_HD inline Receiver make_receiver(const SceneView& scene, const PassSettings& pass, const EyeWalk& eye) {
    const Material& material = scene.materials[eye.surface.material];
    const float cos_previous = dot(eye.surface.geometric_normal, eye.w_eye);
    StrategySum sum = sum_of_promises(pass, 2, eye.t);
    add_longer_light_walks(sum, pass, eye.vertices, eye.t + 2, 3, k_inv_pi / eye.last().pdf_area,
                           std::fabs(cos_previous) * k_inv_pi * eye.last().rev_geometry);
    return {eye.surface.position,
            eye.surface.geometric_normal * (cos_previous < 0 ? -1.0f : 1.0f),
            detail::share_behind(material),
            eye.throughput * material.albedo,
            sum.sum - 1,
            1 / static_cast<float>(eye.t == 2 ? pass.first_times : 1)};
}

// One of the connections at z_{t-1}, to the VLP that was chosen, by a ray that `see` sends. The estimate is of what all VLPs of
// an iteration bring, and this is its share of it.
template <typename See>
VLP_HD inline Contribution connect_virtual_light_point(const SceneView& scene, const PassSettings& pass,
                                                       const LightVertexCache& cache, const EyeWalk& eye,
                                                       const Bsdf& eye_bsdf, VlpChoice choice, See& see) {
    if (!(choice.stands_for > 0)) return {.t = eye.t};
    VlpConnection joined = join_unshadowed<typename SumFor<See>::Type>(scene, pass, cache, eye, eye_bsdf, choice);
    if (is_black(joined.found.value)) return joined.found;
    const Rgb through = see(shadow_ray(anchor_of(eye.surface), joined.vlp, joined.direction));
    joined.found.value *= 1.0f / static_cast<float>(pass.connections_at(eye.t));
    joined.found.value *= through;
    return joined.found;
}

}  // namespace vlp
