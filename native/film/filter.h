// Pixel filters, sampled in proportion to themselves so that every camera sample has weight 1.
//
// `width` is Blender's filter width and the shapes are Cycles': a box of that side; a Gaussian of standard deviation
// width / 4; a Blackman-Harris window that ends at `width` from the pixel's centre. Box widths other than 1 px are our
// own: Cycles always takes 1.
#pragma once

#include "core/bits.h"
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

// The Blackman-Harris window (Harris 1978, the 4-term one of 92 dB) over [0, 1], of integral 1, at x in [0, 1/2]; the other
// half is its mirror image.
VLP_HD inline float blackman_harris(float x) {
    constexpr float k_1 = 0.48829f / 0.35875f, k_2 = 0.14128f / 0.35875f, k_3 = 0.01168f / 0.35875f;
    const float c = -cos_sin_half_turn(2 * x - 0.5f).y;  // of 2 pi x
    return max_of(0.0f, 1 - k_1 * c + k_2 * (2 * c * c - 1) - k_3 * c * (4 * c * c - 3));
}

// A table for each bell-shaped filter, filled by filter_tables.cpp: how far from the pixel's centre, in widths, lies the
// point beyond which there is the share p of the filter, p <= 1/2. Cubic polynomials over sixteenths of octaves of p, which
// are where floats keep their fourth bit after the point: as precise far out as near the centre.
inline constexpr uint32_t k_filter_octaves = 24, k_filter_pieces = 16 * k_filter_octaves + 1;
inline constexpr uint32_t k_filter_table_size = 4 * k_filter_pieces;  // floats
inline constexpr float k_least_filter_share = 0x1p-25f;

VLP_HD inline float filter_distance(const float* table, float p) {
    constexpr int32_t k_piece_shift = 19, k_first_piece = (127 - 25) << 4;
    const int32_t bits = bits_of(max_of(p, k_least_filter_share));
    const float* const c = table + 4 * ((bits >> k_piece_shift) - k_first_piece);
    const float t = static_cast<float>(bits & ((1 << k_piece_shift) - 1)) * 0x1p-19f;
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}

// Offset from the pixel's centre (pixels).
VLP_HD inline Vec2 sample(Filter filter, float width, const float* tables, Vec2 u) {
    const Vec2 v = u - Vec2{0.5f, 0.5f};
    if (filter == Filter::box) return width * v;
    const float* const table = tables + (filter == Filter::gaussian ? 0 : k_filter_table_size);
    return {std::copysign(width * filter_distance(table, 0.5f - std::fabs(v.x)), v.x),
            std::copysign(width * filter_distance(table, 0.5f - std::fabs(v.y)), v.y)};
}

VLP_HD inline float eval_1d(Filter filter, float width, float offset) {
    if (!(std::fabs(offset) <= filter_radius(filter, width))) return 0;
    switch (filter) {
        case Filter::box:
            return 1 / width;
        case Filter::gaussian:
            return 1.5957691f / width * std::exp(-8 * square(offset / width));  // 4 / sqrt(2 pi)
        case Filter::blackman_harris:
            return blackman_harris(0.5f - std::fabs(offset) / (2 * width)) / (2 * width);
    }
    return 0;
}

// Density per square pixel, of integral 1.
VLP_HD inline float eval(Filter filter, float width, Vec2 offset) {
    return eval_1d(filter, width, offset.x) * eval_1d(filter, width, offset.y);
}

}  // namespace vlp
