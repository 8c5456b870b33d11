// A binary tree over boxes by the surface area heuristic, in bins (Wald 2007), built in parallel.
#pragma once

#include "bvh/refs.h"
#include "core/lazy_array.h"

namespace vlp {

inline constexpr uint32_t k_leaf_flag = 0x80000000u;

// Cuts refs [begin, end), which the one above it tells, at `split`.
struct BinaryNode {
    Box box[2];
    uint32_t child[2];  // index of a node; k_leaf_flag: a leaf
    uint32_t split;
};

// Nodes stand at places below the number of refs, of which some are empty: every thread has its own.
struct BinaryTree {
    LazyArray<BinaryNode> nodes;
    Box box;
    uint32_t root = k_leaf_flag;  // of all refs
};

// What a leaf may hold and what things cost, in units of one step through a wide node.
struct LeafRule {
    uint32_t max_refs;
    float block_cost;
    const uint8_t* kind_of_instance;  // GeometryKind of the refs, by instance; null: all alike
};

// Sorts the refs so that every node's are neighbours. Below `max_depth` nodes are cut in halves, which bounds the depth.
// The tree depends on the refs and their order alone, not on the number of threads.
BinaryTree build_binary(RawVector<Ref>& refs, const LeafRule& rule, uint32_t max_depth, ThreadPool& pool);

}  // namespace vlp
