// Point lamps: a sphere of constant radiance, or a point of constant intensity when the radius is 0.
//
// A sphere shines outward; a receiver inside it sees the inner side by next event and by hits, as in Cycles, but no
// light path starts inward (that density is 0, so weights leave the strategy out). Cycles differs when the lamp's Soft
// Falloff is on, as it is by default: it then draws a disc of the sphere's radius and radiance that faces the receiver,
// which lights a receiver at distance d by d² / (d² + r²) of what the sphere does.
#pragma once

#include "core/frame.h"
#include "light/light_data.h"
#include "light/sphere_shape.h"

namespace vlp {

VLP_HD inline Rgb point_emitted(const Light& light, Vec3 normal, Vec3 direction) {
    return dot(normal, direction) > 0 || light.radius == 0 ? light.radiance : Rgb{};
}

VLP_HD inline Emission point_sample_emission(const Light& light, Vec2 u_position, Vec2 u_direction) {
    Emission e;
    if (light.radius == 0) {
        e.position = light.position;
        e.normal = e.direction = sample_sphere(u_direction);
        e.pdf_position = 1;
        e.pdf_direction = pdf_cone(2.0f);
        e.weight = light.radiance * (2 * k_two_pi);
        return e;
    }
    const Vec3 local = sample_cosine(u_direction);
    e.normal = sample_sphere(u_position);
    e.position = light.position + light.radius * e.normal;
    e.direction = make_frame(e.normal).to_world(local);
    e.pdf_position = 1 / light.area;
    e.pdf_direction = local.z * k_inv_pi;
    if (local.z > 0) e.weight = light.radiance * (light.area * k_pi);
    return e;
}

VLP_HD inline EmissionPdf point_pdf_emission(const Light& light, Vec3 position, Vec3 normal, Vec3 direction) {
    if (light.radius == 0) return {1, pdf_cone(2.0f)};
    const float cosine = dot(normal, direction);
    if (cosine <= 0 || dot(position - light.position, normal) <= 0) return {};
    return {1 / light.area, cosine * k_inv_pi};
}

VLP_HD inline NextEvent point_sample_next_event(const Light& light, Vec3 receiver, Vec2 u) {
    if (light.radius > 0) {
        NextEvent e = sample_sphere_shape(light.position, light.radius, receiver, u);
        e.radiance = light.radiance;
        return e;
    }
    NextEvent e;
    const Vec3 to_light = light.position - receiver;
    const float distance_squared = length_squared(to_light);
    e.radiance = light.radiance / distance_squared;
    if (!is_finite(e.radiance) || !is_finite(distance_squared)) return e;
    e.position = light.position;
    e.distance = std::sqrt(distance_squared);
    e.direction = to_light / e.distance;
    e.normal = -e.direction;
    e.pdf_solid_angle = 1;
    e.delta = true;
    return e;
}

VLP_HD inline float point_pdf_next_event(const Light& light, Vec3 receiver, Vec3 position, Vec3 normal) {
    return light.radius == 0 ? 0 : pdf_sphere_shape(light.position, light.radius, receiver, position, normal);
}

}  // namespace vlp
