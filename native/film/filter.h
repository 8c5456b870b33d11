// Pixel filters, sampled in proportion to themselves so that every camera sample has weight 1.
//
// `width` is Blender's filter width and the shapes are Cycles': a box of that side; a Gaussian of standard deviation
// width / 4; a Blackman-Harris window that ends at `width` from the pixel's centre. Box widths other than 1 px are our
// own: Cycles always takes 1.
#pragma once

#include "core/warp.h"

namespace vlp {

// In the order of vlp_bpt.settings.Filter.
enum class Filter : uint8_t { box, gaussian, blackman_harris };

// No sample lies farther from the pixel's centre, along either axis.
VLP_HD inline float filter_radius(Filter filter, float width) {
    switch (filter) {
        case Filter::box:
            return 0.5f * width;
        case Filter::gaussian:
            return 1.5f * width;  // six standard deviations
        case Filter::blackman_harris:
            return width;
    }
    return 0;
}

// The Blackman-Harris window (Harris 1978, the 4-term one of 92 dB) over [0, 1], of integral 1, and that integral. It is
// symmetric: x is in [0, 1/2].
struct WindowValue {
    float density, cumulative;
};

VLP_HD inline WindowValue blackman_harris(float x) {
    constexpr float k_1 = 0.48829f / 0.35875f, k_2 = 0.14128f / 0.35875f, k_3 = 0.01168f / 0.35875f;
    const Vec2 p = cos_sin_half_turn(2 * x - 0.5f);
    const float c = -p.y, s = p.x;  // of 2 pi x
    const float c2 = 2 * c * c - 1, s2 = 2 * s * c, c3 = c * c2 - s * s2, s3 = s * c2 + c * s2;
    return {max_of(0.0f, 1 - k_1 * c + k_2 * c2 - k_3 * c3),
            x - (k_1 * s - 0.5f * k_2 * s2 + k_3 / 3 * s3) * (0.5f * k_inv_pi)};
}

// The x whose cumulative is u: a polynomial in the fourth root of u that is good to 4e-4 in u, then one step of
// Newton's method, which leaves 5e-7.
VLP_HD inline float blackman_harris_inverse(float u) {
    const float p = 0.5f - std::fabs(u - 0.5f);
    const float v = std::sqrt(std::sqrt(p));
    const float slope = 0.62942219f + v * (-0.3744739f + v * (1.27710818f + v * (-1.71217459f + v * 1.28380055f)));
    const float start = 0.5f - (0.84089642f - v) * slope;
    const WindowValue at = blackman_harris(start);
    const float x = clamp(start - (at.cumulative - p) / max_of(at.density, 1e-4f), 0.0f, 0.5f);
    return 0.5f + std::copysign(0.5f - x, u - 0.5f);
}

// Offset from the pixel's centre (pixels).
VLP_HD inline Vec2 sample(Filter filter, float width, Vec2 u) {
    switch (filter) {
        case Filter::box:
            return {width * (u.x - 0.5f), width * (u.y - 0.5f)};
        case Filter::gaussian:  // Box & Muller 1958; u has 24 bits, so that no sample lies beyond 5.8 deviations
            return 0.25f * width * std::sqrt(-2 * std::log(1 - u.x)) * unit_circle(u.y);
        case Filter::blackman_harris:
            return {2 * width * (blackman_harris_inverse(u.x) - 0.5f),
                    2 * width * (blackman_harris_inverse(u.y) - 0.5f)};
    }
    return {};
}

VLP_HD inline float eval_1d(Filter filter, float width, float offset) {
    if (!(std::fabs(offset) <= filter_radius(filter, width))) return 0;
    switch (filter) {
        case Filter::box:
            return 1 / width;
        case Filter::gaussian:
            return 1.5957691f / width * std::exp(-8 * square(offset / width));  // 4 / sqrt(2 pi)
        case Filter::blackman_harris:
            return blackman_harris(0.5f - std::fabs(offset) / (2 * width)).density / (2 * width);
    }
    return 0;
}

// Density per square pixel, of integral 1.
VLP_HD inline float eval(Filter filter, float width, Vec2 offset) {
    return eval_1d(filter, width, offset.x) * eval_1d(filter, width, offset.y);
}

}  // namespace vlp
