// Which subtrees of the binary tree become wide nodes and which become leaves: the cheapest cut (Ylitie, Karras & Laine 2017).
#pragma once

#include <array>

#include "bvh/binary.h"
#include "bvh/layout.h"

namespace vlp {

// A subtree of the binary tree: a node, or a leaf of refs [begin, end).
struct Subtree {
    Box box;
    uint32_t node;  // k_leaf_flag: a leaf
    uint32_t begin, end;

    bool is_leaf() const { return node == k_leaf_flag; }
    uint32_t size() const { return end - begin; }
};

// Children of a wide node; a leaf of it may cover a whole subtree of the binary tree.
struct WideChildren {
    std::array<Subtree, k_node_width> child;
    uint32_t count = 0;

    void add(const Subtree& s) { child[count++] = s; }
};

class Plan {
public:
    // Costs of a ray through the tree, in units of one step through a wide node: `rule.block_cost` for a block of
    // primitives. A leaf holds at most two blocks, all of one kind.
    Plan(const BinaryTree& tree, std::span<const Ref> refs, const LeafRule& rule, ThreadPool& pool);

    // The children of the wide node that stands for `subtree`, which is not a leaf unless it is the whole tree.
    WideChildren children_of(const Subtree& subtree) const;

private:
    // Of a subtree as at most k children of a wide node, k = 1 to 8: what they cost, and how many of them lie on the left
    // side (0: as with k - 1 children; for k = 1, a wide node).
    struct Choice {
        std::array<float, k_node_width> cost;
        std::array<uint8_t, k_node_width> left;
        uint8_t left_of_wide;  // how many of a wide node's children lie on the left side
        bool is_leaf;  // as one child it is a leaf
        uint8_t kind;  // what it holds, if all of one kind that may share a leaf, else k_mixed
    };

    void plan(const Subtree& subtree, uint32_t planned_below);
    Choice choose(const Subtree& subtree, const Choice& left, const Choice& right) const;
    Choice choice_of_leaf(const Subtree& leaf) const;
    Choice choice_of(const Subtree& subtree) const;
    void gather(const Subtree& subtree, uint32_t slots, WideChildren& children) const;

    const BinaryTree& tree_;
    std::span<const Ref> refs_;
    const LeafRule& rule_;
    LazyArray<Choice> choices_;  // by node
};

// The two sides of a node.
Subtree left_of(const BinaryTree& tree, const Subtree& subtree);
Subtree right_of(const BinaryTree& tree, const Subtree& subtree);

}  // namespace vlp
