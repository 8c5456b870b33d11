// The GGX distribution of microfacet normals with Smith's height-correlated shadowing (Walter et al. 2007, Heitz 2014).
#pragma once

#include "core/warp.h"

namespace vlp {

// Half vectors shorter than this, squared, have no direction: both rays graze the surface from opposite ways.
inline constexpr float k_min_half_squared = 1e-12f;

// D of the unit microfacet normal `h` around the unit `normal`, per solid angle of h. The sine comes from a difference
// of vectors: 1 - cos^2 has no digits left in narrow lobes.
VLP_HD inline float ggx_d(float alpha2, Vec3 normal, Vec3 h) {
    const float cos_h = dot(normal, h);
    if (cos_h <= 0) return 0;
    const float sin2 = length_squared(h - normal * cos_h);
    return alpha2 / (k_pi * square(sin2 + alpha2 * cos_h * cos_h));
}

// cos (1 + 2 Lambda): the part of Smith's terms that depends on one direction. With it
//   G1 = 2 c / (c + root),  G2 = 2 c_i c_o / (root_i c_o + root_o c_i).
VLP_HD inline float smith_root(float alpha2, float cos) { return std::sqrt(alpha2 + (1.0f - alpha2) * cos * cos); }

// A normal from the microfacets visible along `w` (local, w.z > 0), density G1(w) D(h) (w.h) / w.z: a uniform point of a
// spherical cap, shifted and scaled back (Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps").
VLP_HD inline Vec3 sample_visible_normal(Vec3 w, float alpha, Vec2 u) {
    const Vec3 stretched = normalize(Vec3{alpha * w.x, alpha * w.y, w.z});
    const float drop = u.y * (1.0f + stretched.z);  // 1 - z of a point on the cap
    const float sin_z = safe_sqrt(drop * (2.0f - drop));
    const Vec2 circle = unit_circle(u.x);
    const Vec3 h = Vec3{sin_z * circle.x, sin_z * circle.y, 1.0f - drop} + stretched;
    return normalize(Vec3{alpha * h.x, alpha * h.y, max_of(h.z, 0.0f)});
}

// Density of `sample_visible_normal` divided by the cosine w.h, which the Jacobians of reflection and refraction carry:
// G1(w) D / w.z, given D.
VLP_HD inline float visible_density(float d, float cos_w, float root_w) { return 2.0f * d / (cos_w + root_w); }

VLP_HD constexpr Vec3 reflect(Vec3 w, Vec3 h) { return h * (2.0f * dot(w, h)) - w; }

// The refraction of `w` through a facet of normal `h` on its side, `eta` being the index behind over the one in front;
// call only without total internal reflection.
VLP_HD inline Vec3 refract(Vec3 w, Vec3 h, float eta) {
    const float cos_i = dot(w, h);
    const float eta_cos_t = safe_sqrt(eta * eta - 1.0f + cos_i * cos_i);
    return (h * (cos_i - eta_cos_t) - w) * (1.0f / eta);
}

}  // namespace vlp
