// Nodes as a GPU reads them: the boxes of their children in bytes, on a grid of each node (Ylitie, Karras & Laine 2017).
#pragma once

#include <span>
#include <vector>

#include "bvh/layout.h"
#include "core/parallel.h"

namespace vlp {

// Plane q of axis a stands at origin[a] + q * 2^(exponent - 127). The planes of the child in place i are byte i % 4 of word
// i / 4. It is what a ray needs before it knows which children it meets, and takes two sectors of a GPU's memory.
struct alignas(16) ChildGrid {
    float origin[3];
    uint32_t exponents;  // bytes: of x, y and z; the last tells by bits which children there are
    uint32_t low[3][2], high[3][2];
};

// Stands where its BvhNode does and has the same children, in other places: bit a of a place tells on which side of the
// node along axis a its child lies, as far as the children allow. So they come front to back in the order of place ^ octant
// for rays that run towards lower coordinates along the axes of which `octant` has the bits. It takes three sectors of 32
// bytes; the paper's 80 bytes touch as many, and ask for children and blocks that are neighbours, in an order of their own.
struct alignas(32) CompressedNode {
    ChildGrid grid;
    uint32_t child[k_node_width];
};
static_assert(sizeof(CompressedNode) == 96);

// Every box contains the one of the node, and by so much more that rays miss none for their rounding; see enter_grid.
CompressedNode compress(const BvhNode& node);

// The result does not depend on the number of threads.
std::vector<CompressedNode> compress(std::span<const BvhNode> nodes, ThreadPool& pool);

// By how much of a node's largest coordinate boxes are moved outwards before they are put on the grid.
inline constexpr float k_grid_margin = 0x1p-21f;

VLP_HD constexpr uint32_t byte_of(uint32_t word, uint32_t i) { return (word >> (8 * i)) & 255u; }

}  // namespace vlp
