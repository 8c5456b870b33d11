// Uniform directions to a triangle (Arvo 1995, "Stratified Sampling of Spherical Triangles").
#pragma once

#include "core/vec.h"

namespace vlp {

// A triangle as seen from the origin: the unit directions to its corners, and the tangent of half the solid angle it
// fills as a ratio, which is negative beyond pi.
struct SphericalTriangle {
    Vec3 a, b, c;
    float above, below;
};

// From the corners and the doubled area times the normal (Van Oosterom & Strackee 1983, "The Solid Angle of a Plane
// Triangle"). The numerator is taken from that, not from the corners, so that small triangles keep their digits.
VLP_HD inline SphericalTriangle make_spherical_triangle(Vec3 a, Vec3 b, Vec3 c, Vec3 twice_area) {
    const float la = length(a), lb = length(b), lc = length(c);
    SphericalTriangle s{a / la, b / lb, c / lc, abs_dot(a, twice_area) / (la * lb * lc), 1};
    s.below += dot(s.a, s.b) + dot(s.b, s.c) + dot(s.c, s.a);
    return s;
}

VLP_HD inline float solid_angle(const SphericalTriangle& s) { return 2 * std::atan2(s.above, s.below); }

// A part u.x of the angle is cut off by an arc from b to a point d of the arc a-c; u.y then picks a point of b-d.
VLP_HD inline Vec3 sample(const SphericalTriangle& s, float angle, Vec2 u) {
    const float cos_ab = dot(s.a, s.b);
    const Vec3 to_b = normalize(s.b - cos_ab * s.a), to_c = normalize(s.c - dot(s.a, s.c) * s.a);  // tangents at a
    const float cos_alpha = clamp(dot(to_b, to_c), -1.0f, 1.0f), sin_alpha = length(cross(to_b, to_c));
    const float cut = u.x * angle;
    const float cos_cut = std::cos(cut), sin_cut = std::sin(cut);
    const float sine = sin_cut * cos_alpha - cos_cut * sin_alpha, cosine = cos_cut * cos_alpha + sin_cut * sin_alpha;
    const float p = cosine - cos_alpha, q = sine + sin_alpha * cos_ab;
    const float below = (q * sine + p * cosine) * sin_alpha;
    const float cos_ad = below == 0 ? 1.0f : clamp(((q * cosine - p * sine) * cos_alpha - q) / below, -1.0f, 1.0f);
    const Vec3 d = cos_ad * s.a + safe_sqrt(1 - cos_ad * cos_ad) * to_c;
    const float one_minus_z = u.y * (1 - dot(d, s.b)), z = 1 - one_minus_z;
    const Vec3 toward_d = d - dot(d, s.b) * s.b;
    const float l = length(toward_d);
    return l > 0 ? normalize(z * s.b + (safe_sqrt(one_minus_z * (1 + z)) / l) * toward_d) : s.b;
}

}  // namespace vlp
