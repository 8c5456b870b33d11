// What is known of a virtual light point before a connection to it is worked out: about how much light it would bring.
//
// A promise is the light of a connection, times its weight, as if both ends were Lambertian and nothing stood between them.
// It only says which of several candidates is kept (Talbot, Cline & Egbert 2005): what it leaves out costs noise, not light,
// as long as it is above 0 wherever there is light.
#pragma once

#include "core/bits.h"
#include "core/simd.h"
#include "integrator/weights.h"

namespace vlp {

// An eye vertex that VLPs may light.
struct Receiver {
    Vec3 position, normal;  // towards the side that is seen
    float behind;  // share of the light from the other side that counts
    Rgb wanted;  // what reflected light is multiplied by
    float others;  // as VlpCandidate::others, for the strategies of more light vertices
    float scale;  // of VlpCandidate::others: less where there are more connections
};

namespace detail {

// How much of light that goes through the surface counts. If nothing goes through, hardly ever a shading normal disagrees.
VLP_HD inline float share_behind(const Material& material) { return material.transmits ? 1.0f : 1.0f / 64; }

// Two bfloat16, the upper halves of floats. The first is read with the second's bits as its last ones.
VLP_HD inline uint32_t pack_halves(float a, float b) {
    return (static_cast<uint32_t>(bits_of(a)) & 0xffff0000u) | static_cast<uint32_t>(bits_of(b)) >> 16;
}
VLP_HD inline float first_half(uint32_t halves) { return float_of(static_cast<int32_t>(halves)); }
VLP_HD inline float second_half(uint32_t halves) { return float_of(static_cast<int32_t>(halves << 16)); }

}  // namespace detail

// Promises are weighted by the balance heuristic whatever the weights are: its sums are linear in the densities, so that what
// is known of either end alone can be summed before they meet.
VLP_HD inline StrategySum sum_of_promises(const PassSettings& pass, uint32_t s, uint32_t t) {
    return {Weighting::balance, strategy_count(pass, s, t)};
}

// The VLP in `slot`. Strategies of fewer light vertices than a connection have, in sum, others * |cos cos| / dist^2 times the
// density of C connections if both surfaces are Lambertian; others is in m^2.
VLP_HD inline VlpCandidate make_candidate(const SceneView& scene, const PassSettings& pass, const LightVertex* slots,
                                          uint32_t slot) {
    const LightVertex& vlp = slots[slot];
    const Material& material = scene.materials[vlp.material()];
    const Vec3 normal = decode(vlp.geometric_normal);
    const float cos_previous = dot(normal, decode(vlp.to_previous));
    const uint32_t s = vlp.index() + 1;
    StrategySum sum = sum_of_promises(pass, s, 3);
    add_shorter_light_walks(sum, pass, &vlp, s, s + 2, k_inv_pi / vlp.pdf_area,
                            std::fabs(cos_previous) * k_inv_pi * vlp.rev_geometry);
    const Rgb reflected = vlp.throughput * material.albedo;
    return {vlp.position,
            encode(cos_previous < 0 ? -normal : normal),
            detail::pack_halves(reflected.r, reflected.g),
            detail::pack_halves(reflected.b, detail::share_behind(material)),
            sum.sum - 1,
            slot};
}

// How many candidates are looked at together.
inline constexpr uint32_t k_candidates_at_once = 8;
// So that sums of promises are finite.
inline constexpr float k_most_promise = 1e30f;

#if VLP_AVX2

namespace detail {

VLP_FORCE_INLINE __m256 magnitude(__m256 a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
VLP_FORCE_INLINE __m256 sign_from(__m256 magnitude, __m256 sign) {
    return _mm256_or_ps(magnitude, _mm256_and_ps(_mm256_set1_ps(-0.0f), sign));
}
// A cosine, or as much of it as counts behind the surface.
VLP_FORCE_INLINE __m256 facing(__m256 cosine, __m256 behind) {
    return _mm256_blendv_ps(cosine, _mm256_mul_ps(magnitude(cosine), behind), cosine);
}
VLP_FORCE_INLINE __m256 dequantise(__m256i bits) {
    return _mm256_mul_ps(_mm256_sub_ps(_mm256_cvtepi32_ps(bits), _mm256_set1_ps(32767.0f)),
                         _mm256_set1_ps(1.0f / 32767.0f));
}

// Rows of eight records become their columns.
VLP_FORCE_INLINE void transpose(__m256 (&r)[8]) {
    __m256 pairs[8], quads[8];
    for (int i = 0; i < 8; i += 2) {
        pairs[i] = _mm256_unpacklo_ps(r[i], r[i + 1]);
        pairs[i + 1] = _mm256_unpackhi_ps(r[i], r[i + 1]);
    }
    for (int i = 0; i < 8; i += 4) {
        for (int k = 0; k < 2; ++k) {
            quads[i + 2 * k] = _mm256_shuffle_ps(pairs[i + k], pairs[i + k + 2], 0x44);
            quads[i + 2 * k + 1] = _mm256_shuffle_ps(pairs[i + k], pairs[i + k + 2], 0xee);
        }
    }
    for (int i = 0; i < 4; ++i) {
        r[i] = _mm256_permute2f128_ps(quads[i], quads[i + 4], 0x20);
        r[i + 4] = _mm256_permute2f128_ps(quads[i], quads[i + 4], 0x31);
    }
}

}  // namespace detail

// promises[i]: that of list[i], for i below `count`, which is k_candidates_at_once at most; 0 for the others up to there.
VLP_FORCE_INLINE void promise(const Receiver& to, const VlpCandidate* list, uint32_t count, float* promises) {
    static_assert(sizeof(VlpCandidate) == sizeof(__m256));
    const auto all = [](float x) { return _mm256_set1_ps(x); };
    __m256 row[8];
    for (uint32_t i = 0; i < 8; ++i) {
        row[i] = _mm256_load_ps(reinterpret_cast<const float*>(list + (i < count ? i : 0)));
    }
    detail::transpose(row);
    const __m256 dx = _mm256_sub_ps(row[0], all(to.position.x)), dy = _mm256_sub_ps(row[1], all(to.position.y)),
                 dz = _mm256_sub_ps(row[2], all(to.position.z));
    const __m256 inverse =
        _mm256_div_ps(all(1), _mm256_fmadd_ps(dx, dx, _mm256_fmadd_ps(dy, dy, _mm256_mul_ps(dz, dz))));

    // As `decode` does.
    const __m256i bits = _mm256_castps_si256(row[3]);
    __m256 nx = detail::dequantise(_mm256_and_si256(bits, _mm256_set1_epi32(0xffff)));
    __m256 ny = detail::dequantise(_mm256_srli_epi32(bits, 16));
    const __m256 ax = detail::magnitude(nx), ay = detail::magnitude(ny);
    const __m256 nz = _mm256_sub_ps(_mm256_sub_ps(all(1), ax), ay);
    nx = _mm256_blendv_ps(nx, detail::sign_from(_mm256_sub_ps(all(1), ay), nx), nz);
    ny = _mm256_blendv_ps(ny, detail::sign_from(_mm256_sub_ps(all(1), ax), ny), nz);
    const __m256 size = _mm256_sqrt_ps(_mm256_fmadd_ps(nx, nx, _mm256_fmadd_ps(ny, ny, _mm256_mul_ps(nz, nz))));

    const auto toward = [&](__m256 x, __m256 y, __m256 z) {
        return _mm256_fmadd_ps(dx, x, _mm256_fmadd_ps(dy, y, _mm256_mul_ps(dz, z)));
    };
    const auto upper = [](__m256 x) { return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_castps_si256(x), 16)); };
    const __m256 at_eye = detail::facing(toward(all(to.normal.x), all(to.normal.y), all(to.normal.z)), all(to.behind));
    const __m256 at_vlp = detail::facing(_mm256_sub_ps(all(0), toward(nx, ny, nz)), upper(row[5]));
    const __m256 geometry =
        _mm256_div_ps(_mm256_mul_ps(_mm256_mul_ps(at_eye, inverse), _mm256_mul_ps(at_vlp, inverse)), size);
    const __m256 light =
        _mm256_fmadd_ps(all(to.wanted.r), row[4],
                        _mm256_fmadd_ps(all(to.wanted.g), upper(row[4]), _mm256_mul_ps(all(to.wanted.b), row[5])));
    const __m256 others = _mm256_fmadd_ps(row[6], all(to.scale), all(to.others));
    const __m256 weighted = _mm256_div_ps(_mm256_mul_ps(light, geometry), _mm256_fmadd_ps(others, geometry, all(1)));
    const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256 there = _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lanes));
    // In this order NaN becomes 0.
    const __m256 bounded = _mm256_min_ps(_mm256_max_ps(weighted, all(0)), all(k_most_promise));
    _mm256_storeu_ps(promises, _mm256_and_ps(bounded, there));
}

// begins[i] = promises[0] + ... + promises[i - 1]. Returns the sum of all.
VLP_FORCE_INLINE float line_up(const float* promises, float* begins) {
    const auto shifted = [](__m256 x, auto by) {
        return _mm256_castsi256_ps(_mm256_bslli_epi128(_mm256_castps_si256(x), decltype(by)::value));
    };
    const __m256 own = _mm256_loadu_ps(promises);
    __m256 sums = _mm256_add_ps(own, shifted(own, std::integral_constant<int, 4>{}));
    sums = _mm256_add_ps(sums, shifted(sums, std::integral_constant<int, 8>{}));
    const __m256 low = _mm256_permute2f128_ps(sums, sums, 0x08);  // the low half above, 0 below
    sums = _mm256_add_ps(sums, _mm256_permute_ps(low, 0xff));
    const __m256 before = _mm256_permutevar8x32_ps(sums, _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6));
    _mm256_storeu_ps(begins, _mm256_blend_ps(before, _mm256_setzero_ps(), 1));
    return _mm256_cvtss_f32(before);
}

// The last that begins at or before `at` and has some width.
VLP_FORCE_INLINE uint32_t last_begun(const float* promises, const float* begins, float at) {
    const __m256 begun = _mm256_cmp_ps(_mm256_loadu_ps(begins), _mm256_set1_ps(at), _CMP_LE_OQ);
    const __m256 wide = _mm256_cmp_ps(_mm256_loadu_ps(promises), _mm256_setzero_ps(), _CMP_GT_OQ);
    const auto mask = static_cast<uint32_t>(_mm256_movemask_ps(_mm256_and_ps(begun, wide)));
    return 31 - static_cast<uint32_t>(__builtin_clz(mask | 1u));
}

#else

VLP_HD inline void promise(const Receiver& to, const VlpCandidate* list, uint32_t count, float* promises) {
    const auto facing = [](float cosine, float behind) { return cosine < 0 ? -cosine * behind : cosine; };
    for (uint32_t i = 0; i < count; ++i) {
        const VlpCandidate& c = list[i];
        const Vec3 d = c.position - to.position;
        const float inverse = 1 / length_squared(d);
        const float geometry = facing(dot(to.normal, d), to.behind) * inverse *
                               (facing(-dot(decode(c.normal), d), detail::second_half(c.blue_and_behind)) * inverse);
        const Rgb reflected{detail::first_half(c.red_and_green), detail::second_half(c.red_and_green),
                            detail::first_half(c.blue_and_behind)};
        const Rgb brought = reflected * to.wanted;
        const float light = brought.r + brought.g + brought.b;
        const float weighted = light * geometry / (1 + (c.others * to.scale + to.others) * geometry);
        promises[i] = weighted > 0 ? min_of(weighted, k_most_promise) : 0.0f;
    }
    for (uint32_t i = count; i < k_candidates_at_once; ++i) promises[i] = 0;
}

VLP_HD inline float line_up(const float* promises, float* begins) {
    float sum = 0;
    for (uint32_t i = 0; i < k_candidates_at_once; ++i) {
        begins[i] = sum;
        sum += promises[i];
    }
    return sum;
}

VLP_HD inline uint32_t last_begun(const float* promises, const float* begins, float at) {
    uint32_t last = 0;
    for (uint32_t i = 0; i < k_candidates_at_once; ++i) last = begins[i] <= at && promises[i] > 0 ? i : last;
    return last;
}

#endif

// The candidates of a connection that draws `u`.
VLP_HD inline const VlpCandidate* deal(const PassSettings& pass, const LightVertexCache& cache, uint32_t u) {
    const auto hand = static_cast<uint32_t>((uint64_t{u} * cache.hand_count) >> 32);
    return cache.stored + size_t{hand} * pass.vlp_candidates;
}

// What connection `i` of `count` at a vertex draws by, for `u` of the vertex: each has its part of the hands.
VLP_HD inline SamplePair draw_of_connection(SamplePair u, uint32_t i, uint32_t count) {
    if (count == 1) return u;
    return {static_cast<uint32_t>((uint64_t{i} << 32 | u.x) / count), u.y + reverse_bits(i)};
}

// Asks for the memory of the candidates of `count` connections, or of the first of them: their hands lie anywhere.
VLP_HD inline void prefetch_candidates([[maybe_unused]] const PassSettings& pass,
                                       [[maybe_unused]] const LightVertexCache& cache, [[maybe_unused]] SamplePair u,
                                       [[maybe_unused]] uint32_t count) {
#if !VLP_ON_DEVICE
    constexpr uint32_t k_most_hands = 4;
    for (uint32_t i = 0; i < min_of(count, k_most_hands); ++i) {
        const VlpCandidate* const hand = deal(pass, cache, draw_of_connection(u, i, count).x);
        for (uint32_t k = 0; k < pass.vlp_candidates; k += 64 / sizeof(VlpCandidate)) __builtin_prefetch(hand + k);
    }
#endif
}

// The VLP that a connection is made to, and how many of the V it stands for.
struct VlpChoice {
    uint32_t slot = 0;
    float stands_for = 0;
};

// Of M candidates one in proportion to its promise: `u.x` draws them and `u.y` which is kept.
VLP_HD inline VlpChoice choose_virtual_light_point(const PassSettings& pass, const LightVertexCache& cache,
                                                   const Receiver& receiver, SamplePair u) {
    const VlpCandidate* const hand = deal(pass, cache, u.x);
    const auto hands = static_cast<float>(cache.hand_count);
    if (pass.vlp_candidates == 1) return {hand->slot, hands};
    VlpChoice kept;
    float u_keep = unit_float(u.y), kept_promise = 0, sum = 0;
    for (uint32_t first = 0; first < pass.vlp_candidates; first += k_candidates_at_once) {
        const uint32_t count = min_of(pass.vlp_candidates - first, k_candidates_at_once);
        float promises[k_candidates_at_once], begins[k_candidates_at_once];
        promise(receiver, hand + first, count, promises);
        const float here = line_up(promises, begins);
        if (!(here > 0)) continue;
        sum += here;
        const float chance = here / sum;
        if (u_keep >= chance) {
            u_keep = (u_keep - chance) / (1 - chance);
            continue;
        }
        const float at = u_keep * sum;
        const uint32_t lane = last_begun(promises, begins, at);
        kept_promise = promises[lane];
        kept.slot = hand[first + lane].slot;
        u_keep = (at - begins[lane]) / kept_promise;
    }
    if (kept_promise > 0) kept.stands_for = hands * sum / kept_promise;
    return kept;
}

}  // namespace vlp
