// What a ray precomputes for boxes, triangles and spheres.
#pragma once

#include "bvh/layout.h"
#include "core/ray.h"
#include "core/simd.h"
#include "geometry/triangle.h"

namespace vlp {

// A plane x = b of a box is entered at t = b * slope + entry and left at b * slope + exit. The entry is rounded down and
// the exit up, by more than the rounding errors of slope and offset, and boxes are wider by more than what b adds to them
// (k_box_margin): no box is missed whose triangles the watertight test would hit (Ize 2013).
struct TraversalRay {
    Vec3 origin, direction;
    alignas(16) float slope[4], entry[4], exit[4];  // the fourth of each: room for a vector
    alignas(16) uint32_t near_row[4], far_row[4];   // rows of BvhNode::bounds
    ShearedRay sheared;
};

namespace detail {

inline constexpr float k_offset_error = 0x1p-21f;
inline constexpr float k_max_offset = 0x1p126f;  // keeps times numbers
// A component that is 0, or too small to invert, becomes so small a share of the largest that it moves nothing.
inline constexpr float k_least_component = 1e-18f;

VLP_HD VLP_FORCE_INLINE TraversalRay traversal_ray_by_axis(Vec3 origin, Vec3 direction) {
    TraversalRay r;
    r.origin = origin, r.direction = direction;
    const float o[3] = {origin.x, origin.y, origin.z}, d[3] = {direction.x, direction.y, direction.z};
    const float least = k_least_component * max_of(std::fabs(d[0]), max_of(std::fabs(d[1]), std::fabs(d[2])));
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const float safe = std::fabs(d[axis]) < least ? std::copysign(least, d[axis]) : d[axis];
        const float slope = 1.0f / safe, offset = max_of(min_of(-o[axis] * slope, k_max_offset), -k_max_offset);
        const float error = std::fabs(offset) * k_offset_error;
        r.slope[axis] = slope, r.entry[axis] = offset - error, r.exit[axis] = offset + error;
        r.near_row[axis] = slope >= 0 ? axis : axis + 3;
        r.far_row[axis] = slope >= 0 ? axis + 3 : axis;
    }
    r.sheared = shear(origin, direction);
    return r;
}

#if VLP_AVX2

VLP_FORCE_INLINE __m128 vector_of(Vec3 v) { return _mm_setr_ps(v.x, v.y, v.z, 0); }

// The same numbers, the axes in the lanes of a vector.
VLP_FORCE_INLINE TraversalRay traversal_ray_by_lanes(Vec3 origin, Vec3 direction) {
    alignas(16) static constexpr int32_t rotation[3][4] = {{1, 2, 0, 0}, {2, 0, 1, 0}, {0, 1, 2, 0}};
    TraversalRay r;
    r.origin = origin, r.direction = direction;
    const __m128 o = vector_of(origin), d = vector_of(direction);
    const __m128 sign = _mm_set1_ps(-0.0f), size = _mm_andnot_ps(sign, d);
    const __m128 most_of_two = _mm_max_ps(size, _mm_movehl_ps(size, size));
    const __m128 most = _mm_broadcastss_ps(_mm_max_ss(most_of_two, _mm_movehdup_ps(size)));
    const __m128 least = _mm_mul_ps(most, _mm_set1_ps(k_least_component));
    const __m128 safe = _mm_blendv_ps(d, _mm_or_ps(least, _mm_and_ps(d, sign)), _mm_cmplt_ps(size, least));
    const __m128 slope = _mm_div_ps(_mm_set1_ps(1), safe);
    __m128 offset = _mm_mul_ps(_mm_xor_ps(o, sign), slope);
    offset = _mm_max_ps(_mm_min_ps(offset, _mm_set1_ps(k_max_offset)), _mm_set1_ps(-k_max_offset));
    const __m128 error = _mm_mul_ps(_mm_andnot_ps(sign, offset), _mm_set1_ps(k_offset_error));
    _mm_store_ps(r.slope, slope);
    _mm_store_ps(r.entry, _mm_sub_ps(offset, error));
    _mm_store_ps(r.exit, _mm_add_ps(offset, error));
    const __m128i three_back = _mm_and_si128(_mm_srai_epi32(_mm_castps_si128(slope), 31), _mm_set1_epi32(3));
    const __m128i axis = _mm_setr_epi32(0, 1, 2, 0);
    _mm_store_si128(reinterpret_cast<__m128i*>(r.near_row), _mm_add_epi32(axis, three_back));
    const __m128i other = _mm_sub_epi32(_mm_add_epi32(axis, _mm_set1_epi32(3)), three_back);
    _mm_store_si128(reinterpret_cast<__m128i*>(r.far_row), other);

    // Of components of the same size the last is the longest, as in shear().
    const auto longest = 31u - static_cast<uint32_t>(__builtin_clz(
                                   (static_cast<uint32_t>(_mm_movemask_ps(_mm_cmpeq_ps(size, most))) & 7u) | 1u));
    const __m128i k = _mm_load_si128(reinterpret_cast<const __m128i*>(rotation[longest]));
    const __m128 slope_k = _mm_permutevar_ps(slope, k);
    const __m128 scale = _mm_shuffle_ps(slope_k, slope_k, 0xaa);
    const __m128 shears = _mm_mul_ps(_mm_permutevar_ps(d, k), scale);
    ShearedRay& sheared = r.sheared;
    _mm_store_ps(sheared.origin, _mm_permutevar_ps(o, k));
    _mm_store_si128(reinterpret_cast<__m128i*>(sheared.k), k);
    sheared.shear_x = _mm_cvtss_f32(shears);
    sheared.shear_y = _mm_cvtss_f32(_mm_movehdup_ps(shears));
    sheared.scale_z = _mm_cvtss_f32(scale);
    return r;
}

#endif

}  // namespace detail

VLP_HD VLP_FORCE_INLINE TraversalRay make_traversal_ray(Vec3 origin, Vec3 direction) {
#if VLP_AVX2
    return detail::traversal_ray_by_lanes(origin, direction);
#else
    return detail::traversal_ray_by_axis(origin, direction);
#endif
}

// Finite, and with somewhere to go.
VLP_HD inline bool is_valid(const Ray& ray) {
    const float size = length_squared(ray.direction);
    return size > 0 && size < k_infinity && is_finite(ray.origin) && ray.t_max > 0;
}

}  // namespace vlp
