// Which lamps' shapes a ray may cross: a binary tree over their boxes, so that ten thousand lamps cost little more than ten.
#pragma once

#include "core/ray.h"
#include "light/light_data.h"

namespace vlp {

// Boxes of two children and what they are: a node's index, or k_lamp_leaf, the number of lamps less one (3 bits) and the
// place of the first in LampView::lights (28 bits).
struct LampNode {
    Vec3 low[2], high[2];
    uint32_t child[2];
};

inline constexpr uint32_t k_lamp_leaf = 1u << 31;
inline constexpr uint32_t k_lamp_leaf_shift = 28;
inline constexpr uint32_t k_max_lamps_in_leaf = 4;
inline constexpr uint32_t k_lamp_tree_depth = 24;  // from here on nodes are cut in halves
inline constexpr uint32_t k_lamp_stack = 64;  // k_lamp_tree_depth and the halvings of 2^28 lamps

// What a ray precomputes for boxes. Directions that are 0 along an axis become so small that they move nothing.
struct BoxRay {
    Vec3 origin, slope;
};

VLP_HD inline BoxRay make_box_ray(const Ray& ray) {
    const auto invert = [](float d) { return 1.0f / (std::fabs(d) < 1e-18f ? std::copysign(1e-18f, d) : d); };
    return {ray.origin, {invert(ray.direction.x), invert(ray.direction.y), invert(ray.direction.z)}};
}

VLP_HD inline bool meets(const BoxRay& ray, Vec3 low, Vec3 high, float t_max) {
    const Vec3 a = (low - ray.origin) * ray.slope, b = (high - ray.origin) * ray.slope;
    const Vec3 near = min_of(a, b), far = max_of(a, b);
    const float first = max_of(max_of(near.x, near.y), max_of(near.z, 0.0f));
    return first <= min_of(min_of(far.x, far.y), min_of(far.z, t_max));
}

// Calls f(light_index) for every lamp whose box the ray meets before ray.t_max.
template <typename F>
VLP_HD inline void for_each_lamp_near(const LampView& lamps, const Ray& ray, F&& f) {
    if (lamps.nodes == nullptr) {
        for (uint32_t i = 0; i < lamps.count; ++i) f(lamps.lights[i]);
        return;
    }
    const BoxRay box_ray = make_box_ray(ray);
    uint32_t stack[k_lamp_stack];
    uint32_t top = 0, next = lamps.root;
    for (;;) {
        if ((next & k_lamp_leaf) != 0) {
            const uint32_t first = next & ((1u << k_lamp_leaf_shift) - 1);
            const uint32_t count = ((next >> k_lamp_leaf_shift) & 7u) + 1;
            for (uint32_t i = 0; i < count; ++i) f(lamps.lights[first + i]);
        } else {
            const LampNode& node = lamps.nodes[next];
            for (uint32_t i = 0; i < 2; ++i) {
                if (meets(box_ray, node.low[i], node.high[i], ray.t_max)) stack[top++] = node.child[i];
            }
        }
        if (top == 0) return;
        next = stack[--top];
    }
}

}  // namespace vlp
