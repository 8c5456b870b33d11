// Spheres as light sources: what a receiver sees of one, and where a ray meets it first.
#pragma once

#include "core/frame.h"
#include "core/ray.h"
#include "core/warp.h"
#include "light/light_sample.h"

namespace vlp {

// What a receiver sees: from outside the near cap, from inside the whole inner side.
struct SphereAspect {
    Vec3 to_center;  // unit
    float distance;  // to the centre
    float one_minus_cos;  // of the cone that the sphere fills
    bool inside;
};

VLP_HD inline SphereAspect sphere_aspect(Vec3 center, float radius, Vec3 receiver) {
    const Vec3 to_center = center - receiver;
    const float distance = length(to_center);
    if (!(distance > radius)) return {{0, 0, 1}, distance, 2.0f, true};
    return {to_center / distance, distance, one_minus_cos_of(square(radius / distance)), false};
}

VLP_HD inline float pdf_solid_angle(const SphereAspect& a) { return pdf_cone(a.one_minus_cos); }

// Distance along a ray to the sphere's far side from a point in it.
VLP_HD inline float distance_to_far_side(Vec3 center, float radius, Vec3 origin, Vec3 direction) {
    const Vec3 from_center = origin - center;
    const float b = -dot(from_center, direction);
    const float root = safe_sqrt(square(radius) - length_squared(from_center + b * direction));
    const float d = length(from_center);
    return b > 0 ? b + root : (radius - d) * (radius + d) / (root - b);
}

// Position, normal, direction, distance and density; the rest is the light's. Uniform in solid angle: no weight exceeds
// the radiance times the angle, however near the receiver is.
VLP_HD inline NextEvent sample_sphere_shape(Vec3 center, float radius, Vec3 receiver, Vec2 u) {
    const SphereAspect aspect = sphere_aspect(center, radius, receiver);
    NextEvent e;
    e.pdf_solid_angle = pdf_solid_angle(aspect);
    if (aspect.inside) {
        e.direction = sample_sphere(u);
        e.distance = distance_to_far_side(center, radius, receiver, e.direction);
        const Vec3 outward = normalize((receiver - center) + e.distance * e.direction);
        e.normal = -outward;
        e.position = center + radius * outward;
        return e;
    }
    // With m = 1 - cos of the widest angle and rho the disc's radius: 1 - cos = m rho², and the ratio of the squared
    // sines is rho² (2 - m rho²) / (2 - m), which loses no digits however small the sphere looks.
    const Frame frame = make_frame(aspect.to_center);
    const Vec2 disc = sample_disc(u);
    const float m = aspect.one_minus_cos, rho2 = disc.x * disc.x + disc.y * disc.y;
    const float k = m * rho2, cosine = 1 - k, sine_over_rho = safe_sqrt(m * (2 - k));
    const float past = safe_sqrt(1 - rho2 * (2 - k) / (2 - m));  // half the chord over the radius
    const float d = aspect.distance;
    const float t = d * cosine - radius * past;
    const float across = sine_over_rho * t / radius, back = k * (2 - k) * d / radius + cosine * past;
    e.direction = frame.to_world({disc.x * sine_over_rho, disc.y * sine_over_rho, cosine});
    e.distance = t;
    e.normal = normalize(frame.to_world({disc.x * across, disc.y * across, -back}));
    e.position = center + radius * e.normal;
    return e;
}

// Density with which the above finds the point `position`, whose normal looks toward the receiver: from outside, it
// finds only points of the near cap, whose normals look outward.
VLP_HD inline float pdf_sphere_shape(Vec3 center, float radius, Vec3 receiver, Vec3 position, Vec3 normal) {
    const SphereAspect aspect = sphere_aspect(center, radius, receiver);
    const bool outer_side = dot(position - center, normal) > 0;
    return outer_side != aspect.inside ? pdf_solid_angle(aspect) : 0.0f;
}

// First crossing in (0, ray.t_max), the normal looking against the ray; false: none.
VLP_HD inline bool intersect_sphere_shape(Vec3 center, float radius, const Ray& ray, float& t, Vec3& normal) {
    const Vec3 from_center = ray.origin - center;
    const float b = -dot(from_center, ray.direction);
    const float d = length(from_center);
    const bool inside = !(d > radius);
    if (!inside && b <= 0) return false;
    const float root2 = square(radius) - length_squared(from_center + b * ray.direction);
    if (!inside && root2 < 0) return false;
    t = inside ? distance_to_far_side(center, radius, ray.origin, ray.direction)
               : (d - radius) * (d + radius) / (b + std::sqrt(root2));
    if (!(t > 0 && t < ray.t_max)) return false;
    const Vec3 outward = normalize(from_center + t * ray.direction);
    normal = inside ? -outward : outward;
    return true;
}

}  // namespace vlp
