// Lights that the eye walk's own rays meet: strategy s = 0, the L_e of the paper's (3).
#pragma once

#include "integrator/light_density.h"
#include "integrator/trace.h"
#include "integrator/virtual_light_points.h"

namespace vlp {

// A light that the walk's ray met at y_0 = z_{t-1}, seen from the walk's last vertex z_{t-2} (strategy s = 0).
template <typename Sum>
VLP_HD inline Contribution hit_light(const SceneView& scene, const PassSettings& pass, const EyeWalk& eye,
                                     Rgb throughput, float pdf_solid_angle, uint32_t light_index, Vec3 position,
                                     Vec3 normal, Vec3 direction) {
    const Light& light = scene.lights[light_index];
    const uint32_t t = eye.t + 1;
    Contribution c{.s = 0, .t = t, .value = throughput * emitted(scene, light, position, normal, -direction)};
    c.weight = 1;
    c.light = light_index;
    c.position = is_infinite(light) ? direction : position;
    c.normal = normal;
    if (is_black(c.value) || t == 2) return c;  // only the eye walk itself sees a light directly

    const SurfacePoint& x_1 = eye.surface;
    const float dist_squared = length_squared(position - x_1.position);
    const float eye_pdf =
        is_infinite(light) ? pdf_solid_angle : pdf_solid_angle * abs_dot(normal, direction) / dist_squared;
    const float next_event = pdf_next_event_from(scene, light_index, x_1, position, normal, direction);
    const LightEnd end =
        light_end(scene, light_index, x_1.position, position, normal, direction, dist_squared, next_event);
    Sum sum = strategy_sum<Sum>(pass, strategy_count(pass, 0, t));
    if (!eye.last().specular) sum.add(end.pdf_next_event / eye_pdf, strategy_count(pass, 1, t - 1));
    const float cos_x_1 = abs_dot(x_1.geometric_normal, direction);
    const float ratio = end.pdf_emission / eye_pdf * (end.pdf_next * cos_x_1 / eye.last().pdf_area);
    add_longer_light_walks(sum, pass, eye.vertices, t, 2, ratio, eye.last().rev_ratio);
    c.weight = sum.weight();
    c.shares = sum.shares();
    return c;
}

// Hands every light that the ray leaving the walk's last vertex meets to the sink: lamps on its way, surfaces that shine,
// whether they are passed or not, and what lies behind everything.
template <typename Sink>
struct LightHits {
    const SceneView& scene;
    const PassSettings& pass;
    const EyeWalk& eye;
    Vec3 direction;
    float pdf_solid_angle;  // of `direction`
    Sink& sink;

    VLP_HD bool sees(const Light& light) const { return eye.t > 1 || (light.visibility & k_visible_to_camera) != 0; }

    VLP_HD void on_stretch(const Ray& ray, Rgb through) const {
        if (!pass.hits) return;
        for_each_lamp_hit(scene, ray, [&](uint32_t light, float, Vec3 position, Vec3 normal) {
            if (sees(scene.lights[light])) add(light, position, normal, through);
        });
    }
    VLP_HD void on_surface(const SurfacePoint& z, Rgb through) const {
        const Rgb emission = scene.materials[z.material].emission;
        if (is_black(emission) || !pass.hits) return;
        const uint32_t light = light_of_surface(scene, z.instance, z.primitive);
        if (light != k_none) {
            add(light, z.position, face_toward(z.geometric_normal, -direction), through);
        } else {  // an emitter that only hits can find
            sink.add({.s = 0, .t = eye.t + 1, .value = eye.throughput * through * emission, .weight = 1});
        }
    }
    VLP_HD void on_escape(Rgb through) const {
        if (!pass.hits) return;
        for_each_infinite_light(scene, direction, [&](uint32_t light) {
            if (sees(scene.lights[light])) add(light, {}, -direction, through);
        });
    }

private:
    VLP_HD void add(uint32_t light, Vec3 position, Vec3 normal, Rgb through) const {
        sink.add(hit_light<typename SumFor<Sink>::Type>(scene, pass, eye, eye.throughput * through, pdf_solid_angle,
                                                        light, position, normal, direction));
    }
};

}  // namespace vlp
