// The tests of one ray against a whole node or block: AVX2 where the compiler targets it, lane by lane elsewhere.
#pragma once

#include "bvh/traversal_ray.h"
#include "core/simd.h"
#include "geometry/sphere.h"

namespace vlp {

#if VLP_AVX2

namespace detail {

// Planes of eight boxes: `row` of the node times slope plus offset.
VLP_FORCE_INLINE __m256 meet(const BvhNode& node, uint32_t row, float slope, float offset) {
    return _mm256_fmadd_ps(_mm256_load_ps(node.bounds[row]), _mm256_set1_ps(slope), _mm256_set1_ps(offset));
}

// A product that is rounded before it is used (see rounded_product).
VLP_FORCE_INLINE __m128 rounded_product(__m128 a, __m128 b) {
    __m128 product = _mm_mul_ps(a, b);
    asm("" : "+x"(product));
    return product;
}

// The larger and the smaller of times of which the result is at least 0 or does not matter: as integers they compare
// faster, and negative ones still come before the others.
VLP_FORCE_INLINE __m256 later(__m256 a, __m256 b) {
    return _mm256_castsi256_ps(_mm256_max_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b)));
}
VLP_FORCE_INLINE __m256 earlier(__m256 a, __m256 b) {
    return _mm256_castsi256_ps(_mm256_min_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b)));
}

}  // namespace detail

// Bit i: the ray meets child i before t_max, and enters it at entry[i].
VLP_FORCE_INLINE uint32_t meet_children(const TraversalRay& ray, const BvhNode& node, float t_max, float* entry) {
    using detail::earlier, detail::later, detail::meet;
    const __m256 near_x = meet(node, ray.near_row[0], ray.slope[0], ray.entry[0]);
    const __m256 near_y = meet(node, ray.near_row[1], ray.slope[1], ray.entry[1]);
    const __m256 near_z = meet(node, ray.near_row[2], ray.slope[2], ray.entry[2]);
    const __m256 far_x = meet(node, ray.far_row[0], ray.slope[0], ray.exit[0]);
    const __m256 far_y = meet(node, ray.far_row[1], ray.slope[1], ray.exit[1]);
    const __m256 far_z = meet(node, ray.far_row[2], ray.slope[2], ray.exit[2]);
    const __m256 near_t = later(later(near_x, near_y), later(near_z, _mm256_setzero_ps()));
    const __m256 far_t = earlier(earlier(far_x, far_y), earlier(far_z, _mm256_set1_ps(t_max)));
    _mm256_store_ps(entry, near_t);
    return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(near_t, far_t, _CMP_LE_OQ)));
}

struct alignas(16) BlockHits {
    float t[k_block_width], u[k_block_width], v[k_block_width];
};

// Bit i: triangle i is hit in (0, t_max), at hits.t[i].
VLP_FORCE_INLINE uint32_t intersect_block(const TraversalRay& ray, const TriangleBlock& block, float t_max,
                                          BlockHits& hits) {
    const ShearedRay& r = ray.sheared;
    const uint32_t kx = r.k[0], ky = r.k[1], kz = r.k[2];
    const __m128 ox = _mm_set1_ps(r.origin[0]), oy = _mm_set1_ps(r.origin[1]), oz = _mm_set1_ps(r.origin[2]);
    const __m128 sx = _mm_set1_ps(r.shear_x), sy = _mm_set1_ps(r.shear_y);
    const auto& p = block.vertex;
    const __m128 az = _mm_sub_ps(_mm_load_ps(p[0][kz]), oz);
    const __m128 bz = _mm_sub_ps(_mm_load_ps(p[1][kz]), oz);
    const __m128 cz = _mm_sub_ps(_mm_load_ps(p[2][kz]), oz);
    const __m128 ax = _mm_fnmadd_ps(sx, az, _mm_sub_ps(_mm_load_ps(p[0][kx]), ox));
    const __m128 ay = _mm_fnmadd_ps(sy, az, _mm_sub_ps(_mm_load_ps(p[0][ky]), oy));
    const __m128 bx = _mm_fnmadd_ps(sx, bz, _mm_sub_ps(_mm_load_ps(p[1][kx]), ox));
    const __m128 by = _mm_fnmadd_ps(sy, bz, _mm_sub_ps(_mm_load_ps(p[1][ky]), oy));
    const __m128 cx = _mm_fnmadd_ps(sx, cz, _mm_sub_ps(_mm_load_ps(p[2][kx]), ox));
    const __m128 cy = _mm_fnmadd_ps(sy, cz, _mm_sub_ps(_mm_load_ps(p[2][ky]), oy));
    using detail::rounded_product;
    const __m128 u = _mm_sub_ps(rounded_product(cx, by), rounded_product(cy, bx));
    const __m128 v = _mm_sub_ps(rounded_product(ax, cy), rounded_product(ay, cx));
    const __m128 w = _mm_sub_ps(rounded_product(bx, ay), rounded_product(by, ax));
    const __m128 zero = _mm_setzero_ps();
    const __m128 least = _mm_min_ps(_mm_min_ps(u, v), w), most = _mm_max_ps(_mm_max_ps(u, v), w);
    const __m128 inside = _mm_or_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
    if (_mm_movemask_ps(inside) == 0) return 0;
    const __m128 det = _mm_add_ps(_mm_add_ps(u, v), w);
    const __m128 inverse = _mm_div_ps(_mm_set1_ps(1.0f), det);
    const __m128 wa = _mm_mul_ps(u, inverse), wb = _mm_mul_ps(v, inverse), wc = _mm_mul_ps(w, inverse);
    const __m128 z = _mm_fmadd_ps(wa, az, _mm_fmadd_ps(wb, bz, _mm_mul_ps(wc, cz)));
    const __m128 t = _mm_mul_ps(z, _mm_set1_ps(r.scale_z));
    const __m128 in_range = _mm_and_ps(_mm_cmpgt_ps(t, zero), _mm_cmplt_ps(t, _mm_set1_ps(t_max)));
    _mm_store_ps(hits.t, t);
    _mm_store_ps(hits.u, wb);
    _mm_store_ps(hits.v, wc);
    const __m128 vanishing = _mm_and_ps(_mm_cmpeq_ps(least, zero), _mm_cmpeq_ps(most, zero));
    auto mask = static_cast<uint32_t>(_mm_movemask_ps(_mm_andnot_ps(vanishing, _mm_and_ps(inside, in_range))));
    for (auto left = static_cast<uint32_t>(_mm_movemask_ps(vanishing)); left != 0; left &= left - 1) {
        const auto i = static_cast<uint32_t>(__builtin_ctz(left));
        alignas(16) float x[3][3][4];
        _mm_store_ps(x[0][0], ax), _mm_store_ps(x[0][1], ay), _mm_store_ps(x[0][2], az);
        _mm_store_ps(x[1][0], bx), _mm_store_ps(x[1][1], by), _mm_store_ps(x[1][2], bz);
        _mm_store_ps(x[2][0], cx), _mm_store_ps(x[2][1], cy), _mm_store_ps(x[2][2], cz);
        const TriangleHit hit = intersect_exactly(x[0][0][i], x[0][1][i], x[0][2][i], x[1][0][i], x[1][1][i],
                                                  x[1][2][i], x[2][0][i], x[2][1][i], x[2][2][i], r.scale_z, t_max);
        if (!hit.found) continue;
        hits.t[i] = hit.t, hits.u[i] = hit.u, hits.v[i] = hit.v;
        mask |= 1u << i;
    }
    return mask;
}

#else

VLP_HD inline uint32_t meet_children(const TraversalRay& ray, const BvhNode& node, float t_max, float* entry) {
    uint32_t mask = 0;
    for (uint32_t i = 0; i < k_node_width; ++i) {
        float near_t = 0, far_t = t_max;
        for (uint32_t axis = 0; axis < 3; ++axis) {
            near_t = max_of(near_t, node.bounds[ray.near_row[axis]][i] * ray.slope[axis] + ray.entry[axis]);
            far_t = min_of(far_t, node.bounds[ray.far_row[axis]][i] * ray.slope[axis] + ray.exit[axis]);
        }
        entry[i] = near_t;
        mask |= (near_t <= far_t ? 1u : 0u) << i;
    }
    return mask;
}

#endif

VLP_HD inline uint32_t lowest_bit(uint32_t mask) {
#if VLP_ON_DEVICE
    return static_cast<uint32_t>(__ffs(static_cast<int>(mask))) - 1;
#else
    return static_cast<uint32_t>(__builtin_ctz(mask));
#endif
}

// Calls visit(i, t, u, v) for every triangle i of the block that is hit in (0, t_max), and returns true as soon as it does.
template <typename Visit>
VLP_HD VLP_FORCE_INLINE bool visit_hits(const TraversalRay& ray, const TriangleBlock& block, float t_max,
                                        const Visit& visit) {
#if VLP_AVX2
    BlockHits hits;
    for (uint32_t mask = intersect_block(ray, block, t_max, hits); mask != 0; mask &= mask - 1) {
        const uint32_t i = lowest_bit(mask);
        if (visit(i, hits.t[i], hits.u[i], hits.v[i])) return true;
    }
#else
    // Absent triangles come last.
    VLP_NO_UNROLL
    for (uint32_t i = 0; i < k_block_width && block.primitive[i] != k_none; ++i) {
        const auto corner = [&](uint32_t v) {
            const auto& [x, y, z] = ray.sheared.k;
            return Vec3{block.vertex[v][x][i], block.vertex[v][y][i], block.vertex[v][z][i]};
        };
        const TriangleHit hit = intersect(ray.sheared, corner(0), corner(1), corner(2), t_max);
        if (hit.found && visit(i, hit.t, hit.u, hit.v)) return true;
    }
#endif
    return false;
}

}  // namespace vlp
