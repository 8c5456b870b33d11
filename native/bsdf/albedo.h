// Directional albedos of GGX lobes, from tables: what energy compensation and layering need to know.
//
// The tables are the ones that Cycles interpolates, on the same grids, so that both renderers err alike:
//   albedo of GGX with a reflectance of 1         E(roughness, cos)           32 x 32      and its cosine-weighted average
//   albedo of GGX glass, entered from outside     E(ior, roughness, cos)      16 x 16 x 16 and its cosine-weighted average
//   the same, entered from inside                 E(ior, roughness, cos)      16 x 16 x 16 and its cosine-weighted average
//   rise of a dielectric's reflectance from its value at normal incidence to 1,
//   averaged over the visible microfacets         rise(ior, roughness, cos)   16 x 16 x 16
// The last index varies fastest; roughness is Blender's (alpha = roughness^2), the axis of the ior is (F0)^(1/4).
#pragma once

#include "core/rgb.h"

namespace vlp {

inline constexpr uint32_t k_fine = 32, k_coarse = 16;

// Where each table begins.
inline constexpr uint32_t k_ggx_albedo = 0;
inline constexpr uint32_t k_ggx_average = k_ggx_albedo + k_fine * k_fine;
inline constexpr uint32_t k_glass_albedo = k_ggx_average + k_fine;  // outside, then inside
inline constexpr uint32_t k_glass_average = k_glass_albedo + 2 * k_coarse * k_coarse * k_coarse;
inline constexpr uint32_t k_dielectric_rise = k_glass_average + 2 * k_coarse * k_coarse;
inline constexpr uint32_t k_albedo_table_size = k_dielectric_rise + k_coarse * k_coarse * k_coarse;

struct GridPosition {
    uint32_t index;  // of the lower node
    float t;  // share of the upper one
};

VLP_HD inline GridPosition grid_position(float x, uint32_t count) {
    const float scaled = clamp(x, 0.0f, 1.0f) * static_cast<float>(count - 1);
    const uint32_t index = min_of(static_cast<uint32_t>(scaled), count - 2);
    return {index, scaled - static_cast<float>(index)};
}

VLP_HD inline float read_table(const float* table, GridPosition x) {
    return lerp(table[x.index], table[x.index + 1], x.t);
}

VLP_HD inline float read_table(const float* table, uint32_t row, GridPosition y, GridPosition x) {
    table += y.index * row;
    return lerp(read_table(table, x), read_table(table + row, x), y.t);
}

VLP_HD inline float read_table(const float* table, GridPosition z, GridPosition y, GridPosition x) {
    table += z.index * k_coarse * k_coarse;
    return lerp(read_table(table, k_coarse, y, x), read_table(table + k_coarse * k_coarse, k_coarse, y, x), z.t);
}

VLP_HD inline float roughness_of(float alpha) { return std::sqrt(alpha); }
VLP_HD inline float ior_axis(float eta) { return std::sqrt(std::fabs((eta - 1.0f) / (eta + 1.0f))); }

struct Albedo {
    float directional, average;
};

VLP_HD inline Albedo ggx_albedo(const float* tables, float alpha, float cos) {
    const GridPosition r = grid_position(roughness_of(alpha), k_fine);
    return {read_table(tables + k_ggx_albedo, k_fine, r, grid_position(cos, k_fine)),
            read_table(tables + k_ggx_average, r)};
}

// `eta` behind over in front.
VLP_HD inline Albedo glass_albedo(const float* tables, float alpha, float eta, float cos) {
    const uint32_t inside = eta < 1 ? 1 : 0;
    const GridPosition z = grid_position(ior_axis(eta), k_coarse), r = grid_position(roughness_of(alpha), k_coarse);
    return {read_table(tables + k_glass_albedo + inside * k_coarse * k_coarse * k_coarse, z, r,
                       grid_position(cos, k_coarse)),
            read_table(tables + k_glass_average + inside * k_coarse * k_coarse, k_coarse, z, r)};
}

// Mean over the microfacets visible at `cos` of (F - F0) / (1 - F0).
VLP_HD inline float dielectric_rise(const float* tables, float alpha, float eta, float cos) {
    return read_table(tables + k_dielectric_rise, grid_position(ior_axis(eta), k_coarse),
                      grid_position(roughness_of(alpha), k_coarse), grid_position(cos, k_coarse));
}

// The factor by which light that scatters between microfacets more than once raises single scattering of albedo E, each
// bounce being tinted by the average reflectance `fresnel` (Kulla & Conty 2017; Turquin 2019, "Practical multiple
// scattering compensation for microfacet models", for its shape).
VLP_HD inline Rgb compensation(Albedo e, Rgb fresnel) {
    const float missing = (1.0f - e.directional) / max_of(e.directional, 1e-4f), lost = 1.0f - e.average;
    const auto raise = [&](float f) {
        const float reflected = min_of(f, 1.0f);  // colours may exceed 1, the series of bounces must not diverge
        return 1.0f + missing * reflected * e.average / (1.0f - reflected * lost);
    };
    return {raise(fresnel.r), raise(fresnel.g), raise(fresnel.b)};
}

}  // namespace vlp
