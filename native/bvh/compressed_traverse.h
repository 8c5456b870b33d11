// Searches of the tree for a GPU without ray tracing units: compressed nodes, front to back without sorting, and a stack
// of groups of children (Ylitie, Karras & Laine 2017).
#pragma once

#include "bvh/compressed.h"
#include "bvh/leaves.h"
#include "scene/scene_view.h"

namespace vlp {
namespace detail {

// A ray that meets grids; bit a of `octant`: it runs towards lower coordinates along axis a.
//
// The plane at B = origin + q * step is met at q * (step * slope) + (origin * slope + entry), where step * slope is exact.
// With u = 2^-24 and S the node's largest coordinate, that may round more than B * slope + entry does (TraversalRay) by u
// times |origin * slope|, |q * step * slope| and |origin * slope + entry|: less than 5 u S |slope| + u |entry|, as |origin|
// is S at most and |q * step| little more than 2 S, but for the margin. The grid's boxes are wider by 8 u S
// (k_grid_margin), and here entries come earlier and exits later by u times themselves (2 u, half of which rounding may
// take).
struct GridRay {
    TraversalRay ray;
    uint32_t octant;
};

VLP_HD inline GridRay make_grid_ray(Vec3 origin, Vec3 direction) {
    GridRay r{make_traversal_ray(origin, direction), 0};
    for (uint32_t axis = 0; axis < 3; ++axis) {
        r.ray.entry[axis] -= std::fabs(r.ray.entry[axis]) * 0x1p-23f;
        r.ray.exit[axis] += std::fabs(r.ray.exit[axis]) * 0x1p-23f;
        r.octant |= (r.ray.near_row[axis] == axis ? 0u : 1u) << axis;
    }
    return r;
}

// Bit i: the ray meets the child in place i ^ octant before t_max; the lowest bit is the first on its way.
VLP_HD VLP_FORCE_INLINE uint32_t meet_grid(const GridRay& r, const ChildGrid& grid, float t_max) {
    constexpr float k_most = 0x1p118f;  // times 255 it is a number
    float slope[3], entry[3], exit[3];
    uint32_t near_planes[3][2], far_planes[3][2];
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const float step = float_of(static_cast<int32_t>(byte_of(grid.exponents, axis) << 23));
        slope[axis] = step * r.ray.slope[axis];
        entry[axis] = grid.origin[axis] * r.ray.slope[axis] + r.ray.entry[axis];
        exit[axis] = grid.origin[axis] * r.ray.slope[axis] + r.ray.exit[axis];
        const bool is_number = std::fabs(slope[axis]) < k_most && std::fabs(entry[axis]) < k_most;
        if (!is_number) slope[axis] = 0, entry[axis] = 0, exit[axis] = k_infinity;  // tells nothing
        const bool is_backward = (r.octant >> axis & 1) != 0;
        for (uint32_t half = 0; half < 2; ++half) {
            near_planes[axis][half] = is_backward ? grid.high[axis][half] : grid.low[axis][half];
            far_planes[axis][half] = is_backward ? grid.low[axis][half] : grid.high[axis][half];
        }
    }
    const uint32_t there = byte_of(grid.exponents, 3);
    uint32_t mask = 0;
    for (uint32_t i = 0; i < k_node_width; ++i) {
        float near_t = 0, far_t = t_max;
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const auto near_plane = static_cast<float>(byte_of(near_planes[axis][i / 4], i % 4));
            const auto far_plane = static_cast<float>(byte_of(far_planes[axis][i / 4], i % 4));
            near_t = max_of(near_t, near_plane * slope[axis] + entry[axis]);
            far_t = min_of(far_t, far_plane * slope[axis] + exit[axis]);
        }
        mask |= ((near_t <= far_t ? 1u : 0u) & (there >> i)) << (i ^ r.octant);
    }
    return mask;
}

// Children of a node that wait to be visited, in bits as meet_grid gives them.
struct ChildGroup {
    uint32_t node, mask;
};

// In the space of an instance, or the world's for k_none. The direction is not normalised, so that t stays in world units.
VLP_HD inline GridRay grid_ray_in(const SceneView& scene, const Ray& ray, uint32_t instance) {
    if (instance == k_none) return make_grid_ray(ray.origin, ray.direction);
    const Affine& to_object = scene.instances[instance].world_to_object;
    return make_grid_ray(transform_point(to_object, ray.origin), transform_vector(to_object, ray.direction));
}

// `query` has t_max() and in_leaf(bvh, ray, leaf, instance), which narrows it and tells whether to end there. One loop
// for the world's tree and those of instances, so that a GPU's threads in both are in step. Returns whether it was ended.
template <typename Query>
VLP_HD inline bool search(const SceneView& scene, const Ray& world_ray, Query& query) {
    const BvhView& bvh = scene.bvh;
    GridRay ray;
    // A level of a tree leaves a group at most. Those below `bottom` are of the world's tree while in that of `instance`.
    ChildGroup stack[k_group_stack_size];
    uint32_t top = 0, bottom = 0, instance = k_none;
    ChildGroup group{0, 0};
    const auto take = [&] {
        const uint32_t place = lowest_bit(group.mask) ^ ray.octant;
        group.mask &= group.mask - 1;
        return bvh.compressed[group.node].child[place];
    };
    uint32_t child = make_child(ChildKind::node, bvh.root);  // k_none: the next of the group
    bool changes_tree = true;
    for (;;) {
        if (changes_tree) ray = grid_ray_in(scene, world_ray, instance);
        changes_tree = false;
        if (child == k_none) child = take();
        while (child != k_none && child_kind(child) == ChildKind::node) {
            count_node();
            if (group.mask != 0) stack[top++] = group;
            const ChildGrid grid = bvh.compressed[child].grid;
            group = {child, meet_grid(ray, grid, query.t_max())};
            if (group.mask == 0 && top > bottom) group = stack[--top];
            child = group.mask != 0 ? take() : k_none;
        }
        if (child != k_none && child_kind(child) == ChildKind::instance) {
            if (group.mask != 0) stack[top++] = group;
            group.mask = 0, bottom = top, instance = child_index(child);
            child = make_child(ChildKind::node, bvh.instance_roots[instance]);
            changes_tree = true;
            continue;
        }
        if (child != k_none && query.in_leaf(bvh, ray.ray, child, instance)) return true;
        child = k_none;
        if (group.mask == 0 && top == bottom && instance != k_none) {
            instance = k_none, bottom = 0;
            changes_tree = true;
        }
        if (group.mask == 0) {
            if (top == bottom) return false;
            group = stack[--top];
        }
    }
}

struct ClosestQuery {
    PrimitiveId skip;
    Hit hit;

    VLP_HD float t_max() const { return hit.t; }
    VLP_HD bool in_leaf(const BvhView& bvh, const TraversalRay& ray, uint32_t leaf, uint32_t instance) {
        closest_in_leaf(bvh, ray, leaf, instance, skip, hit);
        return false;
    }
};

struct AnyQuery {
    PrimitiveId skip_a, skip_b;
    float end;

    VLP_HD float t_max() const { return end; }
    VLP_HD bool in_leaf(const BvhView& bvh, const TraversalRay& ray, uint32_t leaf, uint32_t instance) const {
        return any_in_leaf(bvh, ray, end, leaf, instance, skip_a, skip_b);
    }
};

}  // namespace detail

// What closest_hit and any_hit find, to the last bit. Of primitives that are hit at the same t, but for its rounding, either
// may be found: t can come before the primitive's box, and then the order of the search decides in both forms.
VLP_HD inline Hit closest_hit_compressed(const SceneView& scene, const Ray& ray, PrimitiveId skip) {
    detail::ClosestQuery query{skip, {}};
    if (scene.bvh.root == k_none || !is_valid(ray)) return query.hit;
    query.hit.t = ray.t_max;
    detail::search(scene, ray, query);
    if (!query.hit.found()) query.hit.t = k_infinity;
    return query.hit;
}

VLP_HD inline bool any_hit_compressed(const SceneView& scene, const Ray& ray, PrimitiveId skip_a, PrimitiveId skip_b) {
    if (scene.bvh.root == k_none || !is_valid(ray)) return false;
    detail::AnyQuery query{skip_a, skip_b, ray.t_max};
    return detail::search(scene, ray, query);
}

}  // namespace vlp
