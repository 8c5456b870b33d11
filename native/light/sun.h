// Suns: a disc at infinity around one direction, or that direction alone when the angle is 0.
#pragma once

#include "core/frame.h"
#include "core/warp.h"
#include "light/light_data.h"
#include "light/light_sample.h"

namespace vlp {

// The ends of infinite lights' paths: a disc as wide as the scene that touches its sphere from behind.
VLP_HD inline Vec3 sample_scene_disc(Vec3 center, float radius, Vec3 direction, Vec2 u) {
    constexpr float k_beyond = 1.01f;  // so that rounding cannot put the disc inside the sphere
    const Vec2 d = radius * sample_disc(u);
    const Frame frame = make_frame(direction);
    return center + frame.tangent * d.x + frame.bitangent * d.y - direction * (k_beyond * radius);
}

VLP_HD inline float pdf_scene_disc(float radius) { return k_inv_pi / square(radius); }

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

VLP_HD inline Emission sun_sample_emission(const Light& light, Vec3 center, float radius, Vec2 u_position,
                                           Vec2 u_direction) {
    Emission e;
    e.direction = e.normal = sun_sample_direction(light, u_direction);
    e.position = sample_scene_disc(center, radius, e.direction, u_position);
    e.pdf_position = pdf_scene_disc(radius);
    e.pdf_direction = light.radius == 0 ? 1 : pdf_cone(sun_one_minus_cos(light));
    e.weight = light.radiance / (e.pdf_position * e.pdf_direction);
    return e;
}

VLP_HD inline EmissionPdf sun_pdf_emission(const Light& light, float radius, Vec3 direction) {
    return {pdf_scene_disc(radius), light.radius == 0 ? 1 : sun_pdf_direction(light, direction)};
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
