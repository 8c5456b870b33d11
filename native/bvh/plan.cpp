// Costs are found from the leaves up; large subtrees wait for their parts, which are done side by side.
#include "bvh/plan.h"

namespace vlp {

namespace {

constexpr uint32_t k_min_job = 4096;  // refs in a subtree that is worth a thread
constexpr uint32_t k_max_planned_leaf = 2 * k_block_width;
constexpr uint8_t k_mixed = 255;      // not of one kind, or instances, which stand alone

// Bounded, so that sums of costs stay finite.
float area_of(const Box& box) { return min_of(box.half_area(), 0x1p90f); }

float blocks(uint32_t refs) { return static_cast<float>(blocks_for(refs)); }

}  // namespace

Subtree left_of(const BinaryTree& tree, const Subtree& subtree) {
    const BinaryNode& node = tree.nodes[subtree.node];
    return {node.box[0], node.child[0], subtree.begin, node.split};
}

Subtree right_of(const BinaryTree& tree, const Subtree& subtree) {
    const BinaryNode& node = tree.nodes[subtree.node];
    return {node.box[1], node.child[1], node.split, subtree.end};
}

Plan::Plan(const BinaryTree& tree, std::span<const Ref> refs, const LeafRule& rule, ThreadPool& pool)
    : tree_(tree), refs_(refs), rule_(rule), choices_(tree.nodes.size()) {
    const auto count = static_cast<uint32_t>(refs.size());
    const uint32_t job_size = max_of(k_min_job, count / 128);
    const Subtree whole{tree.box, tree.root, 0, count};
    std::vector<Subtree> large{whole}, jobs;
    while (!large.empty()) {
        const Subtree subtree = large.back();
        large.pop_back();
        if (subtree.is_leaf()) continue;
        if (subtree.size() < job_size) {
            jobs.push_back(subtree);
            continue;
        }
        large.push_back(right_of(tree, subtree));
        large.push_back(left_of(tree, subtree));
    }
    pool.run(static_cast<uint32_t>(jobs.size()), [&](uint32_t i) { plan(jobs[i], 0); });
    if (whole.size() >= job_size) plan(whole, job_size);
}

// Plans the subtree from its leaves up, but for those of fewer refs than `planned_below`.
void Plan::plan(const Subtree& subtree, uint32_t planned_below) {
    if (subtree.is_leaf() || subtree.size() < planned_below) return;
    const Subtree left = left_of(tree_, subtree), right = right_of(tree_, subtree);
    plan(left, planned_below);
    plan(right, planned_below);
    choices_[subtree.node] = choose(subtree, choice_of(left), choice_of(right));
}

Plan::Choice Plan::choice_of(const Subtree& subtree) const {
    return subtree.is_leaf() ? choice_of_leaf(subtree) : choices_[subtree.node];
}

Plan::Choice Plan::choice_of_leaf(const Subtree& leaf) const {
    Choice choice{};
    choice.cost.fill(area_of(leaf.box) * rule_.block_cost * blocks(leaf.size()));
    choice.is_leaf = true;
    const Ref& first = refs_[leaf.begin];
    choice.kind = first.primitive == k_none ? k_mixed
                  : rule_.kind_of_instance  ? rule_.kind_of_instance[first.instance]
                                            : uint8_t{0};
    return choice;
}

Plan::Choice Plan::choose(const Subtree& subtree, const Choice& left, const Choice& right) const {
    Choice choice;
    choice.kind = left.kind == right.kind ? left.kind : k_mixed;
    choice.left[0] = 0;
    float cost = k_infinity;
    for (uint32_t k = 2; k <= k_node_width; ++k) {
        float best = k_infinity;
        uint8_t best_left = 1;
        for (uint32_t j = 1; j < k; ++j) {
            const float c = left.cost[j - 1] + right.cost[k - j - 1];
            if (c < best) best = c, best_left = static_cast<uint8_t>(j);
        }
        choice.left[k - 1] = best_left;
        choice.cost[k - 1] = best;
        if (k == k_node_width) choice.left_of_wide = best_left, cost = best;
    }
    const float area = area_of(subtree.box);
    const float as_node = area + cost;
    const float as_leaf = area * rule_.block_cost * blocks(subtree.size());
    choice.is_leaf = subtree.size() <= k_max_planned_leaf && choice.kind != k_mixed && as_leaf <= as_node;
    choice.cost[0] = choice.is_leaf ? as_leaf : as_node;
    for (uint32_t k = 2; k <= k_node_width; ++k) {
        if (choice.cost[k - 2] <= choice.cost[k - 1]) choice.cost[k - 1] = choice.cost[k - 2], choice.left[k - 1] = 0;
    }
    return choice;
}

void Plan::gather(const Subtree& subtree, uint32_t slots, WideChildren& children) const {
    if (subtree.is_leaf()) return children.add(subtree);
    const Choice& choice = choices_[subtree.node];
    while (slots > 1 && choice.left[slots - 1] == 0) --slots;
    if (slots == 1) {
        Subtree child = subtree;
        if (choice.is_leaf) child.node = k_leaf_flag;
        return children.add(child);
    }
    gather(left_of(tree_, subtree), choice.left[slots - 1], children);
    gather(right_of(tree_, subtree), slots - choice.left[slots - 1], children);
}

WideChildren Plan::children_of(const Subtree& subtree) const {
    WideChildren children;
    if (subtree.is_leaf()) {
        children.add(subtree);
        return children;
    }
    const uint32_t left = choices_[subtree.node].left_of_wide;
    gather(left_of(tree_, subtree), left, children);
    gather(right_of(tree_, subtree), k_node_width - left, children);
    return children;
}

}  // namespace vlp
