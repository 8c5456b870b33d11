// The boxes of a node's children, and the margin by which they are wider than what they hold.
#pragma once

#include "bvh/layout.h"
#include "bvh/refs.h"

namespace vlp {

inline Box child_box(const BvhNode& node, uint32_t i) {
    const auto& b = node.bounds;
    return {{b[0][i], b[1][i], b[2][i]}, {b[3][i], b[4][i], b[5][i]}};
}

inline void set_child_box(BvhNode& node, uint32_t i, const Box& box) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
        node.bounds[axis][i] = (&box.low.x)[axis];
        node.bounds[axis + 3][i] = (&box.high.x)[axis];
    }
}

// Around every child; absent ones are empty boxes. Of boxes that are wide enough: it needs no margin of its own.
inline Box node_box(const BvhNode& node) {
    Box box;
    for (uint32_t i = 0; i < k_node_width; ++i) box.include(child_box(node, i));
    return box;
}

// Of a box that is not empty.
inline Box widened(const Box& box) {
    const auto margin = [](Vec3 v) { return Vec3{std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)} * k_box_margin; };
    return {box.low - margin(box.low), box.high + margin(box.high)};
}

}  // namespace vlp
