// Next event: an eye vertex joined to a point sampled on a light, the first sum of the paper's (7).
#pragma once

#include "integrator/light_density.h"
#include "integrator/trace.h"
#include "integrator/virtual_light_points.h"

namespace vlp {

// Next event at z_{t-1}: one of the S samples of a light (strategy s = 1), of which it brings its share. `see(ShadowRay)`
// tells the transmittance.
template <typename See>
VLP_HD inline Contribution sample_light(const SceneView& scene, const PassSettings& pass, const EyeWalk& eye,
                                        const Bsdf& bsdf, uint32_t u_light, Vec2 u, See& see) {
    Contribution found{.s = 1, .t = eye.t};
    const SurfacePoint& x_1 = eye.surface;
    const DiscreteSample choice = choose_light(scene, x_1, u_light);
    const Light& light = scene.lights[choice.index];
    if (is_on_light(light, x_1)) return found;
    const NextEvent event = sample_next_event(scene, light, x_1.position, u);
    if (!event.valid()) return found;
    found.light = choice.index;
    found.position = is_infinite(light) ? event.direction : event.position;
    found.normal = event.normal;
    const float cos_x_1 = abs_dot(x_1.geometric_normal, event.direction);
    const LobeValue at_x_1 = evaluate(bsdf, eye.w_eye, event.direction);
    if (!(cos_x_1 > 0) || is_black(at_x_1.f)) return found;

    const Anchor from = anchor_of(x_1), to{event.position, event.normal, event.surface};
    const Rgb through =
        see(is_infinite(light) ? shadow_ray(from, event.direction) : shadow_ray(from, to, event.direction));
    if (is_black(through)) return found;
    const float pdf_next_event = choice.pdf * event.pdf_solid_angle;
    const float share = 1.0f / static_cast<float>(pass.light_samples);
    found.value = eye.throughput * at_x_1.f * event.radiance * (cos_x_1 / pdf_next_event * share) * through;

    const uint32_t n = eye.t + 1;
    const float dist_squared = event.distance * event.distance;
    auto sum = strategy_sum<typename SumFor<See>::Type>(pass, strategy_count(pass, 1, eye.t));
    if (!event.delta && n <= pass.eye_path_length + 1) {
        sum.add(at_x_1.pdf_light / pdf_next_event, strategy_count(pass, 0, n));
    }
    if (pass.traces_light() && (eye.t > 2 || pass.splats)) {
        const LightEnd end = light_end(scene, choice.index, x_1.position, event.position, event.normal, event.direction,
                                       dist_squared, pdf_next_event);
        const float ratio = end.pdf_emission / end.pdf_next_event * (end.pdf_next * cos_x_1 / eye.last().pdf_area);
        add_longer_light_walks(sum, pass, eye.vertices, n, 2, ratio, at_x_1.pdf_eye * eye.last().rev_geometry);
    }
    found.weight = sum.weight();
    found.shares = sum.shares();
    return found;
}

}  // namespace vlp
