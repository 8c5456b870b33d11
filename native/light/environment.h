// The environment: a constant radiance from every direction.
#pragma once

#include "light/sun.h"

namespace vlp {

VLP_HD inline Emission environment_sample_emission(const Light& light, Vec3 center, float radius, Vec2 u_position,
                                                   Vec2 u_direction) {
    Emission e;
    e.direction = e.normal = sample_sphere(u_direction);
    e.position = sample_scene_disc(center, radius, e.direction, u_position);
    e.pdf_position = pdf_scene_disc(radius);
    e.pdf_direction = pdf_cone(2.0f);
    e.weight = light.radiance / (e.pdf_position * e.pdf_direction);
    return e;
}

VLP_HD inline NextEvent environment_sample_next_event(const Light& light, float scene_radius, Vec3 receiver, Vec2 u) {
    NextEvent e;
    e.direction = sample_sphere(u);
    e.normal = -e.direction;
    e.position = beyond_scene(receiver, e.direction, scene_radius);
    e.distance = k_infinity;
    e.radiance = light.radiance;
    e.pdf_solid_angle = pdf_cone(2.0f);
    return e;
}

}  // namespace vlp
