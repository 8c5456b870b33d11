// Linear Rec. 709 colour: radiance, power, throughput and reflectance.
#pragma once

#include "core/vec.h"

namespace vlp {

struct Rgb {
    float r = 0, g = 0, b = 0;
};

VLP_HD constexpr Rgb operator+(Rgb a, Rgb b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
VLP_HD constexpr Rgb operator-(Rgb a, Rgb b) { return {a.r - b.r, a.g - b.g, a.b - b.b}; }
VLP_HD constexpr Rgb operator*(Rgb a, Rgb b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
VLP_HD constexpr Rgb operator*(Rgb a, float s) { return {a.r * s, a.g * s, a.b * s}; }
VLP_HD constexpr Rgb operator*(float s, Rgb a) { return a * s; }
VLP_HD constexpr Rgb operator/(Rgb a, float s) { return a * (1.0f / s); }
VLP_HD constexpr Rgb& operator+=(Rgb& a, Rgb b) { return a = a + b; }
VLP_HD constexpr Rgb& operator*=(Rgb& a, Rgb b) { return a = a * b; }
VLP_HD constexpr Rgb& operator*=(Rgb& a, float s) { return a = a * s; }

VLP_HD constexpr Rgb rgb(float v) { return {v, v, v}; }
VLP_HD constexpr float luminance(Rgb c) { return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b; }
VLP_HD constexpr float average(Rgb c) { return (c.r + c.g + c.b) * (1.0f / 3.0f); }
VLP_HD constexpr float max_component(Rgb c) { return max_of(c.r, max_of(c.g, c.b)); }
VLP_HD constexpr bool is_black(Rgb c) { return c.r == 0 && c.g == 0 && c.b == 0; }
VLP_HD inline bool is_finite(Rgb c) { return is_finite(c.r) && is_finite(c.g) && is_finite(c.b); }

}  // namespace vlp
