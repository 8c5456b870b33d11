// Uniform numbers in the unit square bent to discs, cones and spheres, keeping their stratification.
#pragma once

#include "core/vec.h"

namespace vlp {

// Uniform on the unit disc (Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square").
VLP_HD inline Vec2 sample_disc(Vec2 u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    if (a == 0 && b == 0) return {};
    const bool wide = a * a > b * b;
    const float radius = wide ? a : b;
    const float angle = 0.25f * k_pi * (wide ? b / a : a / b);
    const float c = radius * std::cos(angle), s = radius * std::sin(angle);
    return wide ? Vec2{c, s} : Vec2{s, c};
}

// Uniform in solid angle, z being the axis: every direction whose 1 - z is below `one_minus_cos` (2: the whole sphere).
// The density is 1 / (2 pi one_minus_cos).
VLP_HD inline Vec3 sample_cone(Vec2 u, float one_minus_cos) {
    const Vec2 d = sample_disc(u);
    const float k = one_minus_cos * (d.x * d.x + d.y * d.y);
    const float s = safe_sqrt(one_minus_cos * (2 - k));
    return {d.x * s, d.y * s, 1 - k};
}

VLP_HD inline float pdf_cone(float one_minus_cos) { return 1.0f / (k_two_pi * one_minus_cos); }

VLP_HD inline Vec3 sample_sphere(Vec2 u) { return sample_cone(u, 2.0f); }

// Density proportional to z, of directions whose sine to the z axis is below `sin_max`: z / (pi sin_max²).
VLP_HD inline Vec3 sample_cosine(Vec2 u, float sin_max = 1.0f) {
    const Vec2 d = sin_max * sample_disc(u);
    return {d.x, d.y, safe_sqrt(1 - d.x * d.x - d.y * d.y)};
}

// 1 - cos of an angle from the square of its sine, which may be tiny.
VLP_HD inline float one_minus_cos_of(float sin_squared) { return sin_squared / (1 + safe_sqrt(1 - sin_squared)); }

}  // namespace vlp
