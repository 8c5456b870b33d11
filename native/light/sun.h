// Suns: a disc at infinity around one direction, or that direction alone when the angle is 0.
#pragma once

#include "light/light_data.h"
#include "light/light_sample.h"
#include "light/portals.h"

namespace vlp {

// A point far outside the scene toward an infinite light.
VLP_HD inline Vec3 beyond_scene(Vec3 receiver, Vec3 direction, float radius) {
    return receiver + direction * (4 * radius);
}

VLP_HD inline float sun_one_minus_cos(const Light& light) { return square(light.radius) / (1 + light.cos_outer); }

// |a - b|² = 2 (1 - cos), which keeps its digits for a disc of half a degree where the cosine does not.
VLP_HD inline bool sun_contains(const Light& light, Vec3 direction) {
    return length_squared(direction - light.normal) <= 2 * sun_one_minus_cos(light);
}

VLP_HD inline Rgb sun_emitted(const Light& light, Vec3 direction) {
    return light.radius == 0 || sun_contains(light, direction) ? light.radiance : Rgb{};
}

VLP_HD inline float sun_pdf_direction(const Light& light, Vec3 direction) {
    return sun_contains(light, direction) ? pdf_cone(sun_one_minus_cos(light)) : 0.0f;
}

VLP_HD inline Vec3 sun_sample_direction(const Light& light, Vec2 u) {
    if (light.radius == 0) return light.normal;
    return make_frame(light.normal).to_world(sample_cone(u, sun_one_minus_cos(light)));
}

VLP_HD inline Emission sun_sample_emission(const Light& light, const Portals& portals, Vec3 center, float radius,
                                           Vec2 u_position, Vec2 u_direction) {
    Emission e;
    e.direction = e.normal = sun_sample_direction(light, u_direction);
    e.position = sample_scene_disc(portals, center, radius, e.direction, u_position);
    e.pdf_position = pdf_scene_disc(portals, radius, e.position, e.direction);
    e.pdf_direction = light.radius == 0 ? 1 : pdf_cone(sun_one_minus_cos(light));
    e.weight = light.radiance / (e.pdf_position * e.pdf_direction);
    return e;
}

// `point`: any of the ray.
VLP_HD inline EmissionPdf sun_pdf_emission(const Light& light, const Portals& portals, float radius, Vec3 point,
                                           Vec3 direction) {
    return {pdf_scene_disc(portals, radius, point, direction),
            light.radius == 0 ? 1 : sun_pdf_direction(light, direction)};
}

VLP_HD inline NextEvent sun_sample_next_event(const Light& light, float scene_radius, Vec3 receiver, Vec2 u) {
    NextEvent e;
    e.normal = sun_sample_direction(light, u);
    e.direction = -e.normal;
    e.position = beyond_scene(receiver, e.direction, scene_radius);
    e.distance = k_infinity;
    e.radiance = light.radiance;
    e.delta = light.radius == 0;
    e.pdf_solid_angle = e.delta ? 1 : pdf_cone(sun_one_minus_cos(light));
    return e;
}

}  // namespace vlp
