// Which light next event asks: a binary tree over lights, walked from the root to one of them by what either half may bring
// to the receiver (Conty Estevez & Kulla 2018). Lights that are infinitely far away are a list beside it.
#pragma once

#include "core/distribution.h"
#include "light/light_data.h"

namespace vlp {

// Bounds of some lights: a sphere around their shapes, a cone around their normals, and how far from a normal they shine.
struct LightTreeNode {
    Vec3 center;
    float radius;
    Vec3 axis;  // unit
    float cos_normals;  // no normal is farther from the axis; -1: every direction
    float cos_shine;  // nothing shines farther from its normal
    float intensity;  // along the normals (W/sr), mean of the channels' sizes, of all lights
    uint32_t child;  // the first of two neighbours, or a light with k_tree_leaf
    uint32_t parent;
    bool two_sided;  // normals count in either direction
};

inline constexpr uint32_t k_tree_leaf = 1u << 31;
inline constexpr uint32_t k_tree_root = 1;  // node 0 is none, so that siblings are 2 k and 2 k + 1
inline constexpr uint32_t k_tree_infinite = 1u << 31;
// Bounds know neither the BSDF nor what stands between: no half that may bring something is chosen more seldom.
inline constexpr float k_least_chance = 1.0f / 128;

namespace detail {

// cos(max(a - b, 0)) of two angles in [0, pi].
VLP_HD inline float cos_of_difference(float cos_a, float cos_b) {
    if (cos_a >= cos_b) return 1;
    return cos_a * cos_b + safe_sqrt(1 - cos_a * cos_a) * safe_sqrt(1 - cos_b * cos_b);
}

}  // namespace detail

// About the irradiance that a node's lights bring to a point of a surface, on whichever side of it: no more than that, within
// their bounds, but for lights inside of which the point lies. 0 only where they bring nothing.
VLP_HD inline float importance(const LightTreeNode& node, Vec3 position, Vec3 normal) {
    constexpr float k_slack = 1e-3f;  // for rounding at the edges of cones
    const Vec3 d = position - node.center;
    const float distance_squared = length_squared(d), radius_squared = node.radius * node.radius;
    if (distance_squared <= radius_squared) return node.intensity / radius_squared;
    const Vec3 direction = d * (1 / std::sqrt(distance_squared));
    const float cos_size = safe_sqrt(1 - radius_squared / distance_squared);  // of the sphere, as seen from the point
    const float cos_axis = dot(node.axis, direction);
    const float cos_normal =
        detail::cos_of_difference(node.two_sided ? std::fabs(cos_axis) : cos_axis, node.cos_normals);
    const float cos_shine = detail::cos_of_difference(cos_normal, cos_size);
    if (cos_shine < node.cos_shine - k_slack) return 0;
    const float cos_receiver = detail::cos_of_difference(abs_dot(normal, direction), cos_size);
    return node.intensity * max_of(cos_shine, k_slack) * max_of(cos_receiver, k_slack) / distance_squared;
}

namespace detail {

// The chance of the first of two that are worth `a` and `b`.
VLP_HD inline float chance_of_first(float a, float b) {
    const float share = a / (a + b);
    if (!(share >= 0)) return 0.5f;  // both 0, or too large to tell
    if (a == 0 || b == 0) return share;
    return clamp(share, k_least_chance, 1 - k_least_chance);
}

// Whether the first, of such a chance, is drawn by `u`, which is then as good as new.
VLP_HD inline bool draws_first(float chance, uint32_t& u) {
    const float numbers = chance * 0x1p32f;
    if (numbers >= 0x1p32f) return true;
    const auto limit = static_cast<uint32_t>(numbers);
    const bool first = u < limit;
    const uint64_t rest = first ? u : u - limit, width = first ? limit : (uint64_t{1} << 32) - limit;
    u = static_cast<uint32_t>((rest << 32) / width);
    return first;
}

// That a light is asked that is infinitely far away.
VLP_HD inline float chance_of_infinite(const LightTreeView& tree, Vec3 position, Vec3 normal) {
    if (tree.infinite.count == 0) return 0;
    if (tree.nodes == nullptr) return 1;
    return chance_of_first(tree.infinite_irradiance, importance(tree.nodes[k_tree_root], position, normal));
}

// That `child`, of two neighbours, is gone to.
VLP_HD inline float chance_of_child(const LightTreeView& tree, uint32_t child, Vec3 position, Vec3 normal) {
    const uint32_t first = child & ~1u;
    const float chance = chance_of_first(importance(tree.nodes[first], position, normal),
                                         importance(tree.nodes[first + 1], position, normal));
    return child == first ? chance : 1 - chance;
}

}  // namespace detail

// For a point of a surface. There must be a light.
VLP_HD inline DiscreteSample sample(const LightTreeView& tree, Vec3 position, Vec3 normal, uint32_t u) {
    const float infinite = detail::chance_of_infinite(tree, position, normal);
    if (detail::draws_first(infinite, u)) {
        const DiscreteSample chosen = sample(tree.infinite, u);
        return {tree.infinite_lights[chosen.index], infinite * chosen.pdf};
    }
    float chance = 1 - infinite;
    uint32_t child = tree.nodes[k_tree_root].child;
    while ((child & k_tree_leaf) == 0) {
        const float first = detail::chance_of_child(tree, child, position, normal);
        const bool to_first = detail::draws_first(first, u);
        chance *= to_first ? first : 1 - first;
        child = tree.nodes[to_first ? child : child + 1].child;
    }
    return {child & ~k_tree_leaf, chance};
}

VLP_HD inline float pdf(const LightTreeView& tree, Vec3 position, Vec3 normal, uint32_t light) {
    const uint32_t place = tree.places[light];
    const float infinite = detail::chance_of_infinite(tree, position, normal);
    if ((place & k_tree_infinite) != 0) return infinite * pdf(tree.infinite, place & ~k_tree_infinite);
    float chance = 1 - infinite;
    for (uint32_t node = place; node != k_tree_root && chance > 0; node = tree.nodes[node].parent) {
        chance *= detail::chance_of_child(tree, node, position, normal);
    }
    return chance;
}

}  // namespace vlp
