// Emitting surfaces: triangles and spheres of meshes and point clouds, which shine on both sides.
#pragma once

#include "light/light_data.h"
#include "light/sphere_shape.h"
#include "light/spherical_triangle.h"

namespace vlp {

VLP_HD inline Vec3 triangle_point(const Light& light, Vec2 u) {
    // Uniform without a square root, folding the unit square along its diagonal's normal (Heitz 2019, "A Low-Distortion
    // Map Between Triangle and Square").
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

// Next event draws by area from a triangle that fills fewer steradians than this, by solid angle from others. Measured:
// by area, the cosine and the distance alone then vary by a third of their mean at most grazing views, and drawing by
// angle costs less than a tenth of a shadow ray more.
inline constexpr float k_min_triangle_angle = 0.02f;

VLP_HD inline SphericalTriangle triangle_seen_from(const Light& light, Vec3 receiver) {
    const Vec3 a = light.position - receiver;
    return make_spherical_triangle(a, a + light.axis_u, a + light.axis_v, light.normal * (2 * light.area));
}

// False for a receiver at a corner, where the angle has no meaning.
VLP_HD inline bool by_solid_angle(const SphericalTriangle& s) {
    constexpr float k_tangent = 0.5f * k_min_triangle_angle;  // of half the angle, which is small
    return s.above > k_tangent * s.below;
}

VLP_HD inline NextEvent triangle_sample_next_event(const Light& light, Vec3 receiver, Vec2 u) {
    NextEvent e;
    const SphericalTriangle seen = triangle_seen_from(light, receiver);
    if (by_solid_angle(seen)) {
        const float angle = solid_angle(seen);
        e.direction = sample(seen, angle, u);
        e.distance = dot(light.position - receiver, light.normal) / dot(e.direction, light.normal);
        e.position = receiver + e.distance * e.direction;
        e.pdf_solid_angle = is_finite(e.distance) ? 1 / angle : 0.0f;
    } else {
        e.position = triangle_point(light, u);
        const Vec3 to_light = e.position - receiver;
        e.distance = length(to_light);
        e.direction = to_light / e.distance;
        e.pdf_solid_angle = to_solid_angle(1 / light.area, square(e.distance), abs_dot(light.normal, e.direction));
    }
    e.normal = face_toward(light.normal, -e.direction);
    e.radiance = light.radiance;
    return e;
}

VLP_HD inline float triangle_pdf_next_event(const Light& light, Vec3 receiver, Vec3 position, Vec3 direction) {
    const SphericalTriangle seen = triangle_seen_from(light, receiver);
    if (by_solid_angle(seen)) return 1 / solid_angle(seen);
    return to_solid_angle(1 / light.area, length_squared(position - receiver), abs_dot(light.normal, direction));
}

}  // namespace vlp
