// What a ray hits first, and whether it hits anything: the two loops through the tree.
#pragma once

#include "bvh/lanes.h"
#include "scene/scene_view.h"

namespace vlp {

namespace detail {

// On the stack: go back from an instance's tree to the world's.
inline constexpr uint32_t k_leave_instance = k_none;

VLP_HD inline bool is(PrimitiveId id, uint32_t instance, uint32_t primitive) {
    return id.primitive == primitive && id.instance == instance;
}

// The ray in the space of an instance. The direction is not normalised, so that t stays in world units.
VLP_HD inline TraversalRay enter(const InstanceView& instance, const Ray& ray) {
    return make_traversal_ray(transform_point(instance.world_to_object, ray.origin),
                              transform_vector(instance.world_to_object, ray.direction));
}

VLP_HD inline float intersect_lane(const TraversalRay& ray, const SphereBlock& block, uint32_t i, float t_max, bool from,
                                   bool to) {
    const Vec3 center{block.center[0][i], block.center[1][i], block.center[2][i]};
    const SphereRoots roots = intersect_sphere(ray.origin, ray.direction, center, block.radius[i]);
    return roots.found ? first_root(roots, t_max, from, to) : k_infinity;
}

// A node or leaf that waits, and where the ray enters it: one number that sorts by the entry, which is not negative.
VLP_HD inline uint64_t make_entry(float t, uint32_t child) {
    return static_cast<uint64_t>(static_cast<uint32_t>(bits_of(t))) << 32 | child;
}
VLP_HD inline float entry_t(uint64_t entry) { return float_of(static_cast<int32_t>(entry >> 32)); }

VLP_HD inline void sort_pair(uint64_t& a, uint64_t& b) {  // larger first
    const uint64_t low = b < a ? b : a, high = b < a ? a : b;
    a = high, b = low;
}

// Puts the children of `mask` on the stack, the nearest one last.
VLP_HD VLP_FORCE_INLINE uint32_t push_sorted(uint64_t* stack, uint32_t top, const BvhNode& node, uint32_t mask,
                                             const float* entry) {
    uint32_t count = 0;
    for (; mask != 0; mask &= mask - 1) {
        const uint32_t i = lowest_bit(mask);
        const uint64_t added = make_entry(entry[i], node.child[i]);
        uint32_t j = count++;
        for (; j > 0 && stack[top + j - 1] < added; --j) stack[top + j] = stack[top + j - 1];
        stack[top + j] = added;
    }
    return top + count;
}

}  // namespace detail

// The first hit with t in (0, ray.t_max). `skip` is the primitive that the ray leaves: a triangle is ignored wholly, a
// sphere where the ray starts. Invalid rays (NaN, infinite or zero direction) hit nothing.
VLP_HD inline Hit closest_hit(const SceneView& scene, const Ray& ray, PrimitiveId skip) {
    Hit hit;
    const BvhView& bvh = scene.bvh;
    if (bvh.root == k_none || !is_valid(ray)) return hit;
    hit.t = ray.t_max;
    const TraversalRay world = make_traversal_ray(ray.origin, ray.direction);
    TraversalRay local = world;
    uint32_t instance = k_none;  // whose tree we are in; k_none: the world's
    uint64_t stack[k_stack_size];
    uint32_t top = 0;
    stack[top++] = detail::make_entry(0, make_child(ChildKind::node, bvh.root));
    while (top > 0) {
        const uint64_t next = stack[--top];
        const auto child = static_cast<uint32_t>(next);
        if (child == detail::k_leave_instance) {
            local = world;
            instance = k_none;
            continue;
        }
        if (detail::entry_t(next) >= hit.t) continue;
        const uint32_t index = child_index(child);
        switch (child_kind(child)) {
            case ChildKind::node: {
                const BvhNode& node = bvh.nodes[index];
                alignas(32) float entry[k_node_width];
                const uint32_t mask = meet_children(local, node, hit.t, entry);
                top = detail::push_sorted(stack, top, node, mask, entry);
                break;
            }
            case ChildKind::triangles: {
                for (uint32_t b = index; b < index + child_blocks(child); ++b) {
                    const TriangleBlock& block = bvh.triangle_blocks[b];
                    BlockHits hits;
                    for (uint32_t mask = intersect_block(local, block, hit.t, hits); mask != 0; mask &= mask - 1) {
                        const uint32_t i = lowest_bit(mask);
                        const uint32_t owner = instance == k_none ? block.instance[i] : instance;
                        if (hits.t[i] >= hit.t || detail::is(skip, owner, block.primitive[i])) continue;
                        hit = {hits.t[i], hits.u[i], hits.v[i], block.primitive[i], owner};
                    }
                }
                break;
            }
            case ChildKind::spheres: {
                for (uint32_t b = index; b < index + child_blocks(child); ++b) {
                    const SphereBlock& block = bvh.sphere_blocks[b];
                    for (uint32_t i = 0; i < k_block_width; ++i) {
                        const uint32_t owner = instance == k_none ? block.instance[i] : instance;
                        const bool from = detail::is(skip, owner, block.primitive[i]);
                        const float t = detail::intersect_lane(local, block, i, hit.t, from, false);
                        if (t < hit.t) hit = {t, 0, 0, block.primitive[i], owner};
                    }
                }
                break;
            }
            case ChildKind::instance: {
                instance = index;
                local = detail::enter(scene.instances[instance], ray);
                stack[top++] = detail::k_leave_instance;
                stack[top++] = detail::make_entry(detail::entry_t(next),
                                                  make_child(ChildKind::node, bvh.instance_roots[instance]));
                break;
            }
        }
    }
    if (!hit.found()) hit.t = k_infinity;
    return hit;
}

// Whether anything is hit with t in (0, ray.t_max). `skip_a` is the primitive that the ray leaves and `skip_b` the one it
// goes to: triangles are ignored wholly, spheres where the ray starts and where it ends.
VLP_HD inline bool any_hit(const SceneView& scene, const Ray& ray, PrimitiveId skip_a, PrimitiveId skip_b) {
    const BvhView& bvh = scene.bvh;
    if (bvh.root == k_none || !is_valid(ray)) return false;
    const TraversalRay world = make_traversal_ray(ray.origin, ray.direction);
    TraversalRay local = world;
    uint32_t instance = k_none;
    uint32_t stack[k_stack_size];
    uint32_t top = 0;
    stack[top++] = make_child(ChildKind::node, bvh.root);
    while (top > 0) {
        const uint32_t child = stack[--top];
        if (child == detail::k_leave_instance) {
            local = world;
            instance = k_none;
            continue;
        }
        const uint32_t index = child_index(child);
        switch (child_kind(child)) {
            case ChildKind::node: {
                const BvhNode& node = bvh.nodes[index];
                alignas(32) float entry[k_node_width];
                for (uint32_t mask = meet_children(local, node, ray.t_max, entry); mask != 0; mask &= mask - 1) {
                    stack[top++] = node.child[lowest_bit(mask)];
                }
                break;
            }
            case ChildKind::triangles: {
                for (uint32_t b = index; b < index + child_blocks(child); ++b) {
                    const TriangleBlock& block = bvh.triangle_blocks[b];
                    BlockHits hits;
                    for (uint32_t mask = intersect_block(local, block, ray.t_max, hits); mask != 0; mask &= mask - 1) {
                        const uint32_t i = lowest_bit(mask);
                        const uint32_t owner = instance == k_none ? block.instance[i] : instance;
                        if (!detail::is(skip_a, owner, block.primitive[i]) && !detail::is(skip_b, owner, block.primitive[i])) {
                            return true;
                        }
                    }
                }
                break;
            }
            case ChildKind::spheres: {
                for (uint32_t b = index; b < index + child_blocks(child); ++b) {
                    const SphereBlock& block = bvh.sphere_blocks[b];
                    for (uint32_t i = 0; i < k_block_width; ++i) {
                        const uint32_t owner = instance == k_none ? block.instance[i] : instance;
                        const bool from = detail::is(skip_a, owner, block.primitive[i]);
                        const bool to = detail::is(skip_b, owner, block.primitive[i]);
                        if (detail::intersect_lane(local, block, i, ray.t_max, from, to) < ray.t_max) return true;
                    }
                }
                break;
            }
            case ChildKind::instance: {
                instance = index;
                local = detail::enter(scene.instances[instance], ray);
                stack[top++] = detail::k_leave_instance;
                stack[top++] = make_child(ChildKind::node, bvh.instance_roots[instance]);
                break;
            }
        }
    }
    return false;
}

}  // namespace vlp
