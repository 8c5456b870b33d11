// What a ray hits first, and whether it hits anything: the two loops through the tree.
#pragma once

#include "bvh/leaves.h"
#include "scene/scene_view.h"

namespace vlp {

namespace detail {

// The ray in the space of an instance. The direction is not normalised, so that t stays in world units.
VLP_HD inline TraversalRay enter(const InstanceView& instance, const Ray& ray) {
    return make_traversal_ray(transform_point(instance.world_to_object, ray.origin),
                              transform_vector(instance.world_to_object, ray.direction));
}

// Asks for the memory of a child that will soon be visited, while others are still in work.
VLP_HD VLP_FORCE_INLINE void prefetch([[maybe_unused]] const BvhView& bvh, [[maybe_unused]] uint32_t child) {
#if !VLP_ON_DEVICE
    // Without a branch, which would be mispredicted; spheres and instances are few and not worth it.
    const uint64_t at_leaf = child_kind(child) == ChildKind::node ? 0 : ~uint64_t{0};
    const auto* const nodes = reinterpret_cast<const char*>(bvh.nodes);
    const uint64_t to_blocks = reinterpret_cast<uint64_t>(bvh.triangle_blocks) - reinterpret_cast<uint64_t>(nodes);
    const uint64_t size = sizeof(BvhNode) ^ ((sizeof(BvhNode) ^ sizeof(TriangleBlock)) & at_leaf);
    const char* const first = nodes + ((to_blocks & at_leaf) + child_index(child) * size);
    __builtin_prefetch(first);
    __builtin_prefetch(first + 64);
    __builtin_prefetch(first + 128);
#endif
}

// A child that waits on the stack, and where the ray enters it, in one number that sorts by the entry: entries are not
// negative, so that their bits sort as they do.
VLP_HD inline uint64_t make_waiting(float t, uint32_t child) {
    return static_cast<uint64_t>(static_cast<uint32_t>(bits_of(t))) << 32 | child;
}
VLP_HD inline float entry_of(uint64_t waiting) { return float_of(static_cast<int32_t>(waiting >> 32)); }

// Puts the children of `mask` (two or more) on the stack, farthest first, but for the nearest, which is returned.
VLP_HD VLP_FORCE_INLINE uint32_t push_sorted(const BvhView& bvh, const BvhNode& node, uint32_t mask, const float* entry,
                                             uint64_t* stack, uint32_t& top) {
    const auto take = [&] {
        const uint32_t i = lowest_bit(mask);
        mask &= mask - 1;
        prefetch(bvh, node.child[i]);
        return make_waiting(entry[i], node.child[i]);
    };
    uint64_t nearest = take();
    uint64_t other = take();
    const uint64_t far = min_of(nearest, other) ^ nearest ^ other;
    nearest = min_of(nearest, other);
    uint32_t end = top;
    stack[end++] = far;
    while (mask != 0) {
        other = take();
        uint64_t next = max_of(nearest, other);
        nearest = min_of(nearest, other);
        uint32_t j = end++;
        for (; j > top && stack[j - 1] < next; --j) stack[j] = stack[j - 1];
        stack[j] = next;
    }
    top = end;
    return static_cast<uint32_t>(nearest);
}

// One tree: the world's, where leaves may be instances, or that of `instance`. Narrows `hit`.
template <bool in_world>
VLP_HD inline void closest_in_tree(const SceneView& scene, const Ray& world_ray, const TraversalRay& ray, uint32_t root,
                                   uint32_t instance, PrimitiveId skip, uint64_t* stack, Hit& hit) {
    const BvhView& bvh = scene.bvh;
    uint32_t top = 0;
    uint32_t child = make_child(ChildKind::node, root);
    for (;;) {
        bool at_leaf = true;
        while (child_kind(child) == ChildKind::node) {
            count_node();
            const BvhNode& node = bvh.nodes[child];
            alignas(32) float entry[k_node_width];
            const uint32_t mask = meet_children(ray, node, hit.t, entry);
            if (mask == 0) {
                at_leaf = false;
                break;
            }
            child = (mask & (mask - 1)) == 0 ? node.child[lowest_bit(mask)]
                                             : push_sorted(bvh, node, mask, entry, stack, top);
        }
        if (at_leaf) {
            if (child_kind(child) != ChildKind::instance) {
                closest_in_leaf(bvh, ray, child, in_world ? k_none : instance, skip, hit);
            } else if constexpr (in_world) {
                const uint32_t index = child_index(child);
                const TraversalRay local = enter(scene.instances[index], world_ray);
                closest_in_tree<false>(scene, world_ray, local, bvh.instance_roots[index], index, skip, stack + top,
                                       hit);
            }
        }
        uint64_t next;
        do {
            if (top == 0) return;
            next = stack[--top];
        } while (entry_of(next) >= hit.t);
        child = static_cast<uint32_t>(next);
    }
}

template <bool in_world>
VLP_HD inline bool any_in_tree(const SceneView& scene, const Ray& world_ray, const TraversalRay& ray, uint32_t root,
                               uint32_t instance, PrimitiveId skip_a, PrimitiveId skip_b, uint32_t* stack) {
    const BvhView& bvh = scene.bvh;
    uint32_t top = 0;
    uint32_t child = make_child(ChildKind::node, root);
    for (;;) {
        bool at_leaf = true;
        while (child_kind(child) == ChildKind::node) {
            count_node();
            const BvhNode& node = bvh.nodes[child];
            alignas(32) float entry[k_node_width];
            uint32_t mask = meet_children(ray, node, world_ray.t_max, entry);
            if (mask == 0) {
                at_leaf = false;
                break;
            }
            child = node.child[lowest_bit(mask)];
            prefetch(bvh, child);
            for (mask &= mask - 1; mask != 0; mask &= mask - 1) {
                prefetch(bvh, node.child[lowest_bit(mask)]);
                stack[top++] = node.child[lowest_bit(mask)];
            }
        }
        if (at_leaf) {
            if (child_kind(child) != ChildKind::instance) {
                const uint32_t owner = in_world ? k_none : instance;
                if (any_in_leaf(bvh, ray, world_ray.t_max, child, owner, skip_a, skip_b)) return true;
            } else if constexpr (in_world) {
                const uint32_t index = child_index(child);
                const TraversalRay local = enter(scene.instances[index], world_ray);
                if (any_in_tree<false>(scene, world_ray, local, bvh.instance_roots[index], index, skip_a, skip_b,
                                       stack + top)) {
                    return true;
                }
            }
        }
        if (top == 0) return false;
        child = stack[--top];
    }
}

}  // namespace detail

// The first hit with t in (0, ray.t_max). `skip` is the primitive that the ray leaves: a triangle is ignored wholly, a
// sphere where the ray starts. Invalid rays (NaN, infinite or zero direction) hit nothing.
VLP_HD inline Hit closest_hit(const SceneView& scene, const Ray& ray, PrimitiveId skip) {
    Hit hit;
    if (scene.bvh.root == k_none || !is_valid(ray)) return hit;
    hit.t = ray.t_max;
    uint64_t stack[k_stack_size];
    const TraversalRay prepared = make_traversal_ray(ray.origin, ray.direction);
    detail::closest_in_tree<true>(scene, ray, prepared, scene.bvh.root, k_none, skip, stack, hit);
    if (!hit.found()) hit.t = k_infinity;
    return hit;
}

// Whether anything is hit with t in (0, ray.t_max). `skip_a` is the primitive that the ray leaves and `skip_b` the one it
// goes to: triangles are ignored wholly, spheres where the ray starts and where it ends.
VLP_HD inline bool any_hit(const SceneView& scene, const Ray& ray, PrimitiveId skip_a, PrimitiveId skip_b) {
    if (scene.bvh.root == k_none || !is_valid(ray)) return false;
    uint32_t stack[k_stack_size];
    const TraversalRay prepared = make_traversal_ray(ray.origin, ray.direction);
    return detail::any_in_tree<true>(scene, ray, prepared, scene.bvh.root, k_none, skip_a, skip_b, stack);
}

}  // namespace vlp
