// What a ray hits in a leaf: the same tests for every form of the tree.
#pragma once

#include "bvh/lanes.h"

namespace vlp {

// Steps through nodes and blocks, counted on the host, and only in benchmarks compiled for it: counting takes time.
#if VLP_COUNT_VISITS
inline thread_local uint64_t visited_nodes, visited_blocks;
#endif
#if VLP_COUNT_VISITS && !VLP_ON_DEVICE
inline void count_node() { ++visited_nodes; }
inline void count_block() { ++visited_blocks; }
#else
VLP_HD inline void count_node() {}
VLP_HD inline void count_block() {}
#endif

namespace detail {

VLP_HD inline bool is(PrimitiveId id, uint32_t instance, uint32_t primitive) {
    return id.primitive == primitive && id.instance == instance;
}

// Whose a primitive is: `instance` is k_none in the world's tree, whose blocks tell it.
template <typename Block>
VLP_HD inline uint32_t owner_of(const Block& block, uint32_t i, uint32_t instance) {
    return instance == k_none ? block.instance[i] : instance;
}

VLP_HD inline float intersect_lane(const TraversalRay& ray, const SphereBlock& block, uint32_t i, float t_max,
                                   bool from, bool to) {
    const Vec3 center{block.center[0][i], block.center[1][i], block.center[2][i]};
    const SphereRoots roots = intersect_sphere(ray.origin, ray.direction, center, block.radius[i]);
    return roots.found ? first_root(roots, t_max, from, to) : k_infinity;
}

// `leaf` is a child that has triangles or spheres. Narrows `hit`.
VLP_HD VLP_FORCE_INLINE void closest_in_leaf(const BvhView& bvh, const TraversalRay& ray, uint32_t leaf,
                                             uint32_t instance, PrimitiveId skip, Hit& hit) {
    const uint32_t index = child_index(leaf), end = index + child_blocks(leaf);
    if (child_kind(leaf) == ChildKind::triangles) {
        for (uint32_t b = index; b < end; ++b) {
            count_block();
            const TriangleBlock& block = bvh.triangle_blocks[b];
            visit_hits(ray, block, hit.t, [&](uint32_t i, float t, float u, float v) {
                const uint32_t owner = owner_of(block, i, instance);
                if (t < hit.t && !is(skip, owner, block.primitive[i])) hit = {t, u, v, block.primitive[i], owner};
                return false;
            });
        }
        return;
    }
    for (uint32_t b = index; b < end; ++b) {
        count_block();
        const SphereBlock& block = bvh.sphere_blocks[b];
        VLP_NO_UNROLL
        for (uint32_t i = 0; i < k_block_width; ++i) {
            const uint32_t owner = owner_of(block, i, instance);
            const float t = intersect_lane(ray, block, i, hit.t, is(skip, owner, block.primitive[i]), false);
            if (t < hit.t) hit = {t, 0, 0, block.primitive[i], owner};
        }
    }
}

VLP_HD VLP_FORCE_INLINE bool any_in_leaf(const BvhView& bvh, const TraversalRay& ray, float t_max, uint32_t leaf,
                                         uint32_t instance, PrimitiveId skip_a, PrimitiveId skip_b) {
    const uint32_t index = child_index(leaf), end = index + child_blocks(leaf);
    if (child_kind(leaf) == ChildKind::triangles) {
        for (uint32_t b = index; b < end; ++b) {
            count_block();
            const TriangleBlock& block = bvh.triangle_blocks[b];
            const bool hit = visit_hits(ray, block, t_max, [&](uint32_t i, float, float, float) {
                const uint32_t owner = owner_of(block, i, instance);
                return !is(skip_a, owner, block.primitive[i]) && !is(skip_b, owner, block.primitive[i]);
            });
            if (hit) return true;
        }
        return false;
    }
    for (uint32_t b = index; b < end; ++b) {
        count_block();
        const SphereBlock& block = bvh.sphere_blocks[b];
        VLP_NO_UNROLL
        for (uint32_t i = 0; i < k_block_width; ++i) {
            const uint32_t owner = owner_of(block, i, instance);
            const bool from = is(skip_a, owner, block.primitive[i]), to = is(skip_b, owner, block.primitive[i]);
            if (intersect_lane(ray, block, i, t_max, from, to) < t_max) return true;
        }
    }
    return false;
}

}  // namespace detail
}  // namespace vlp
