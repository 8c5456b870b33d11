// The records of the tree: wide nodes, and blocks of primitives in their leaves.
#pragma once

#include "bvh/bvh_view.h"

namespace vlp {

inline constexpr uint32_t k_node_width = 8;
inline constexpr uint32_t k_block_width = 4;

// A child is 32 bits: its kind (2), blocks in the leaf less one (3), and the index of node, first block or instance (27).
enum class ChildKind : uint32_t { node, triangles, spheres, instance };

inline constexpr uint32_t k_child_index_bits = 27;
inline constexpr uint32_t k_max_leaf_blocks = 8;

VLP_HD constexpr uint32_t make_child(ChildKind kind, uint32_t index, uint32_t blocks = 1) {
    return static_cast<uint32_t>(kind) << 30 | (blocks - 1) << k_child_index_bits | index;
}
VLP_HD constexpr ChildKind child_kind(uint32_t child) { return static_cast<ChildKind>(child >> 30); }
VLP_HD constexpr uint32_t child_index(uint32_t child) { return child & ((1u << k_child_index_bits) - 1); }
VLP_HD constexpr uint32_t child_blocks(uint32_t child) { return ((child >> k_child_index_bits) & 7u) + 1; }

// By how much of its size a coordinate of a box is moved outwards; see TraversalRay.
inline constexpr float k_box_margin = 0x1p-21f;

// Rows of `bounds`: low x, y, z, high x, y, z. An absent child has low = +inf and high = -inf, which no ray meets.
struct alignas(64) BvhNode {
    float bounds[6][k_node_width];
    uint32_t child[k_node_width];
};

constexpr uint32_t blocks_for(uint32_t primitives) { return (primitives + k_block_width - 1) / k_block_width; }

// Absent triangles have NaN vertices, which no ray meets. In a tree of its own geometry `instance` is k_none.
struct alignas(16) TriangleBlock {
    float vertex[3][3][k_block_width];  // vertex, axis
    uint32_t instance[k_block_width];
    uint32_t primitive[k_block_width];
};

// Absent spheres have a NaN radius.
struct alignas(16) SphereBlock {
    float center[3][k_block_width];
    float radius[k_block_width];
    uint32_t instance[k_block_width];
    uint32_t primitive[k_block_width];
};

// Entries that a traversal may need, in the world's tree and one instance's together; the builder keeps to it.
inline constexpr uint32_t k_stack_size = 256;

// Nodes on the longest way through a tree, which the builder keeps to as well, and the groups of children that wait on the
// stack of a search through compressed nodes: one a level at most, of the world's tree and one instance's.
inline constexpr uint32_t k_max_depth = 32;
inline constexpr uint32_t k_group_stack_size = 2 * k_max_depth;

}  // namespace vlp
