// Uniform numbers in the unit square bent to discs, cones and spheres, keeping their stratification.
#pragma once

#include "core/vec.h"

namespace vlp {

// (cos x, sin x) for |x| <= pi / 4, to 1e-7, by polynomials.
VLP_HD constexpr Vec2 cos_sin_eighth(float x) {
    const float x2 = x * x;
    return {1 + x2 * (-0.5f + x2 * (0.0416666493f + x2 * (-0.001388759f + x2 * 2.44638359e-5f))),
            x + x * x2 * (-0.166666642f + x2 * (0.0083327489f + x2 * -0.000195879504f))};
}

// (cos(2 pi u), sin(2 pi u)) for u in [0, 1], to 1e-7.
VLP_HD inline Vec2 unit_circle(float u) {
    const float turns = 4 * u;
    const int quadrant = static_cast<int>(turns + 0.5f);
    const Vec2 p = cos_sin_eighth((turns - static_cast<float>(quadrant)) * (0.5f * k_pi));
    const float c = quadrant & 1 ? p.y : p.x, d = quadrant & 1 ? p.x : p.y;  // no branches: nothing predicts them
    return {(quadrant + 1) & 2 ? -c : c, quadrant & 2 ? -d : d};
}

// Uniform on the unit disc (Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square").
VLP_HD inline Vec2 sample_disc(Vec2 u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    const bool wide = std::fabs(a) > std::fabs(b);
    const float radius = wide ? a : b, other = wide ? b : a;
    const Vec2 p = radius * cos_sin_eighth(radius == 0 ? 0 : 0.25f * k_pi * (other / radius));
    return wide ? p : Vec2{p.y, p.x};
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
