// Emitting surfaces: triangles and spheres of meshes and point clouds, which shine on both sides.
#pragma once

#include "light/light_data.h"
#include "light/sphere_shape.h"

namespace vlp {

VLP_HD inline Vec3 triangle_point(const Light& light, Vec2 u) {
    // Uniform without a square root, folding the unit square along its diagonal's normal (Heitz 2019, "A Low-Distortion Map
    // Between Triangle and Square").
    const Vec2 b = u.x < u.y ? Vec2{0.5f * u.x, u.y - 0.5f * u.x} : Vec2{u.x - 0.5f * u.y, 0.5f * u.y};
    return light.position + light.axis_u * b.x + light.axis_v * b.y;
}

// The side of a surface that a share `back` of draws leave from, with the number made anew for the next use.
VLP_HD inline bool choose_back(float back, float& u) {
    const bool chosen = u < back;
    u = chosen ? u / back : (u - back) / (1 - back);
    return chosen;
}

inline constexpr float k_triangle_back_share = 0.5f;
inline constexpr float k_sphere_back_share = 0.125f;  // inward: of use only where a sphere holds (part of) the scene

// The ray's weight and densities, its direction being cosine distributed around `e.normal` in which `local` is.
VLP_HD inline void leave_surface(Emission& e, const Light& light, Vec3 local, float side_share) {
    e.direction = make_frame(e.normal).to_world(local);
    e.pdf_position = 1 / light.area;
    e.pdf_direction = side_share * local.z * k_inv_pi;
    if (local.z > 0) e.weight = light.radiance * (light.area * k_pi / side_share);
}

VLP_HD inline Emission triangle_sample_emission(const Light& light, Vec2 u_position, Vec2 u_direction) {
    Emission e;
    e.position = triangle_point(light, u_position);
    e.normal = choose_back(k_triangle_back_share, u_direction.x) ? -light.normal : light.normal;
    leave_surface(e, light, sample_cosine(u_direction), 0.5f);
    return e;
}

VLP_HD inline Emission sphere_sample_emission(const Light& light, Vec2 u_position, Vec2 u_direction) {
    const Vec3 outward = sample_sphere(u_position);
    Emission e;
    const bool inward = choose_back(k_sphere_back_share, u_direction.x);
    e.position = light.position + light.radius * outward;
    e.normal = inward ? -outward : outward;
    leave_surface(e, light, sample_cosine(u_direction), inward ? k_sphere_back_share : 1 - k_sphere_back_share);
    return e;
}

VLP_HD inline EmissionPdf surface_pdf_emission(const Light& light, Vec3 position, Vec3 normal, Vec3 direction) {
    const float cosine = dot(normal, direction);
    if (cosine <= 0) return {};
    const bool sphere = light.kind == LightKind::sphere, inward = sphere && dot(position - light.position, normal) < 0;
    const float share = !sphere ? 0.5f : inward ? k_sphere_back_share : 1 - k_sphere_back_share;
    return {1 / light.area, share * cosine * k_inv_pi};
}

VLP_HD inline NextEvent triangle_sample_next_event(const Light& light, Vec3 receiver, Vec2 u) {
    NextEvent e;
    e.position = triangle_point(light, u);
    const Vec3 to_light = e.position - receiver;
    e.distance = length(to_light);
    if (e.distance == 0) return e;
    e.direction = to_light / e.distance;
    e.normal = face_toward(light.normal, -e.direction);
    e.radiance = light.radiance;
    e.pdf_solid_angle = to_solid_angle(1 / light.area, square(e.distance), -dot(e.normal, e.direction));
    return e;
}

VLP_HD inline float triangle_pdf_next_event(const Light& light, Vec3 receiver, Vec3 position, Vec3 direction) {
    return to_solid_angle(1 / light.area, length_squared(position - receiver), abs_dot(light.normal, direction));
}

}  // namespace vlp
