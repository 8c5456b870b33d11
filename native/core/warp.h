// Uniform numbers in the unit square bent to discs, cones and spheres, keeping their stratification.
#pragma once

#include "core/bits.h"
#include "core/vec.h"

namespace vlp {

// (cos(pi w), sin(pi w)) for |w| <= 1 / 2, to 2e-7, by polynomials.
VLP_HD constexpr Vec2 cos_sin_half_turn(float w) {
    const float z = w * w;
    return {
        1 + z * (-4.93480206f +
                 z * (4.05871201f + z * (-1.33526266f + z * (0.235327855f + z * (-0.0257853814f + z * 0.0018526f))))),
        w * (3.14159274f + z * (-5.1677103f + z * (2.55007744f + z * (-0.598291278f + z * 0.0776576623f))))};
}

// (cos(2 pi u), sin(2 pi u)) for u in [0, 1], to 2e-7. Exchanges and signs by their bits: branches on random numbers are not
// predicted.
VLP_HD inline Vec2 unit_circle(float u) {
    const float turns = 4 * u;
    const int quadrant = static_cast<int>(turns + 0.5f);
    const Vec2 p = cos_sin_half_turn(0.5f * (turns - static_cast<float>(quadrant)));
    const int x = bits_of(p.x), y = bits_of(p.y), exchanged = (x ^ y) & -(quadrant & 1);
    return {float_of(x ^ exchanged ^ (((quadrant + 1) & 2) << 30)), float_of(y ^ exchanged ^ ((quadrant & 2) << 30))};
}

// asin(x) for |x| <= 1, to 2e-7 of itself and without branches, so that several are computed at once.
VLP_HD inline float arc_sine(float x) {
    const float size = std::fabs(x);
    const bool steep = size > 0.5f;  // asin(x) = pi / 2 - 2 asin(sqrt((1 - x) / 2))
    const float z = steep ? 0.5f * (1 - size) : size * size;
    const float y = steep ? safe_sqrt(z) : size;
    const float series = 0.16666673f + z * (0.07498809f + z * (0.0450107f + z * (0.02649425f + z * 0.03820653f)));
    const float angle = y + y * z * series;
    return std::copysign(steep ? 0.5f * k_pi - 2 * angle : angle, x);
}

// Uniform on the unit disc (Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square").
VLP_HD inline Vec2 sample_disc(Vec2 u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    const bool wide = std::fabs(a) > std::fabs(b);
    const float radius = wide ? a : b, other = wide ? b : a;
    const Vec2 p = radius * cos_sin_half_turn(radius == 0 ? 0 : 0.25f * (other / radius));
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
