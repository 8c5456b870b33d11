// Uniform directions to a rectangle (Ureña et al. 2013, "An Area-Preserving Parametrization for Spherical Rectangles").
#pragma once

#include "core/warp.h"

namespace vlp {

// A rectangle of the plane z = height as seen from the origin.
struct SeenRectangle {
    Vec2 low, high;
    float height;  // > 0
};

VLP_HD inline float area(const SeenRectangle& r) { return (r.high.x - r.low.x) * (r.high.y - r.low.y); }

// The angles of the spherical rectangle at its four corners, each less a right angle; they add up to the solid angle.
// The excess over pi / 2 instead of the angle itself keeps digits when the rectangle is small.
struct SphericalRectangle {
    float b0, b1;  // z of the unit normals of the planes through the edges y = low.y and y = high.y
    float one_minus_b0_squared;
    float excess_23;  // of the two corners at low.x
    float solid_angle;
};

VLP_HD inline SphericalRectangle make_spherical(const SeenRectangle& r) {
    // Loops over the edges and corners, for the lanes of vectors.
    const float edge[4] = {-r.low.y, r.high.x, r.high.y, -r.low.x};
    float per_distance[4], z[4], excess[4];
    for (int i = 0; i < 4; ++i) {
        per_distance[i] = 1 / std::sqrt(square(edge[i]) + square(r.height));
        z[i] = edge[i] * per_distance[i];
    }
    for (int i = 0; i < 4; ++i) excess[i] = arc_sine(z[i] * z[(i + 1) % 4]);
    const float excess_23 = excess[2] + excess[3];
    return {z[0], z[2], square(r.height * per_distance[0]), excess_23, excess[0] + excess[1] + excess_23};
}

// A point of the rectangle, in its plane.
VLP_HD inline Vec2 sample(const SeenRectangle& r, const SphericalRectangle& s, Vec2 u) {
    // Below the angle au of the paper is pi + w.
    const float w = u.x * s.solid_angle - s.excess_23;
    const Vec2 half = cos_sin_half_turn(w * (0.5f * k_inv_pi));  // of w / 2
    // The paper's f is a / b.
    const float a = (1 - 2 * square(half.y)) * s.b0 + s.b1, b = 2 * half.x * half.y;
    const float x_over_h = std::copysign(b, a * b) / safe_sqrt(square(a) - square(b) * s.one_minus_b0_squared);
    const float x = clamp(r.height * x_over_h, r.low.x, r.high.x);
    const float d2 = x * x + square(r.height);
    const float v0 = r.low.y / std::sqrt(d2 + square(r.low.y)), v1 = r.high.y / std::sqrt(d2 + square(r.high.y));
    const float v = lerp(v0, v1, u.y);
    const float y = v * std::sqrt(d2 / (1 - v * v));
    return {x, clamp(y, r.low.y, r.high.y)};
}

}  // namespace vlp
