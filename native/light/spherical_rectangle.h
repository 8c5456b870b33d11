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
    float excess_23;  // of the two corners at low.x
    float solid_angle;
};

VLP_HD inline SphericalRectangle make_spherical(const SeenRectangle& r) {
    const auto slope = [&](float x) { return x / std::sqrt(x * x + r.height * r.height); };
    const float n0 = -slope(r.low.y), n1 = slope(r.high.x), n2 = slope(r.high.y), n3 = -slope(r.low.x);
    const float excess_23 = arc_sine(n2 * n3) + arc_sine(n3 * n0);
    return {n0, n2, excess_23, arc_sine(n0 * n1) + arc_sine(n1 * n2) + excess_23};
}

// A point of the rectangle, in its plane.
VLP_HD inline Vec2 sample(const SeenRectangle& r, const SphericalRectangle& s, Vec2 u) {
    // Below the angle au of the paper is pi + w.
    const float w = u.x * s.solid_angle - s.excess_23;
    const float f = (std::cos(w) * s.b0 + s.b1) / std::sin(w);
    const float h2 = square(r.height);
    const float x_over_h = 1 / safe_sqrt(f * f - h2 / (square(r.low.y) + h2));
    const float x = clamp(std::copysign(r.height * x_over_h, f), r.low.x, r.high.x);
    const float d2 = x * x + h2;
    const float v0 = r.low.y / std::sqrt(d2 + square(r.low.y)), v1 = r.high.y / std::sqrt(d2 + square(r.high.y));
    const float v = lerp(v0, v1, u.y);
    const float y = v * std::sqrt(d2 / (1 - v * v));
    return {x, clamp(y, r.low.y, r.high.y)};
}

}  // namespace vlp
