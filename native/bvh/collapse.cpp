// Writes wide nodes from the root down; subtrees are done in parallel, each in a place of its own that is counted before.
#include "bvh/collapse.h"

#include <memory>

#include "bvh/node_box.h"
#include "bvh/pack.h"

namespace vlp {

namespace {

constexpr uint32_t k_min_job = 2048;  // refs in a subtree that is worth a thread

// Opens the child with the most refs until a node is full, which bounds the depth.
WideChildren balanced_children(const BinaryTree& tree, const Subtree& subtree) {
    WideChildren children;
    children.add(subtree);
    while (children.count < k_node_width) {
        uint32_t best = k_none, most = 0;
        for (uint32_t i = 0; i < children.count; ++i) {
            const Subtree& child = children.child[i];
            if (!child.is_leaf() && child.size() > most) most = child.size(), best = i;
        }
        if (best == k_none) break;
        const Subtree opened = children.child[best];
        children.child[best] = left_of(tree, opened);
        children.add(right_of(tree, opened));
    }
    return children;
}

// A subtree left to a thread, and the child that will point to it.
struct Job {
    Subtree subtree;
    uint32_t parent, slot;
};

class Collapser {
public:
    // `plan`: null for a balanced tree.
    Collapser(const BinaryTree& tree, std::span<const Ref> refs, const LeafSource& source, const Plan* plan,
              uint32_t job_size, WideTree& out)
        : tree_(tree), refs_(refs), source_(source), plan_(plan), job_size_(job_size), out_(out) {}

    // Writes the subtree at `place`, which moves behind it, and returns its root, the stack that it needs and its depth.
    struct Written {
        uint32_t node = 0, stack_need = 0, depth = 0;
    };
    Written write(const Subtree& subtree, TreeSpan& place) {
        const WideChildren children = children_of(subtree);
        const uint32_t index = place.node++;
        BvhNode& node = out_.nodes[index];
        uint32_t stack_need = 1, depth_below = 0;
        for (uint32_t i = 0; i < k_node_width; ++i) {
            const bool there = i < children.count;
            const Subtree& to = children.child[i];
            set_child_box(node, i, there ? widened(to.box) : Box{});
            uint32_t child = k_none;
            if (there && to.is_leaf()) {
                child = pack_leaf(refs_.subspan(to.begin, to.size()), source_, out_, place);
            } else if (there && to.size() < job_size_) {
                jobs.push_back({to, index, i});
            } else if (there) {
                const Written written = write(to, place);
                child = make_child(ChildKind::node, written.node);
                stack_need = max_of(stack_need, written.stack_need);
                depth_below = max_of(depth_below, written.depth);
            }
            node.child[i] = child;
        }
        return {index, stack_need + children.count - 1, depth_below + 1};
    }

    // What `write` takes, of jobs nothing.
    TreeSpan size_of(const Subtree& subtree) const {
        const WideChildren children = children_of(subtree);
        TreeSpan size{1, 0, 0};
        for (uint32_t i = 0; i < children.count; ++i) {
            const Subtree& to = children.child[i];
            if (to.is_leaf()) {
                const Ref& first = refs_[to.begin];
                if (first.primitive == k_none) continue;
                const bool mesh = source_.geometry_of(first).kind == GeometryKind::mesh;
                (mesh ? size.triangle_block : size.sphere_block) += blocks_for(to.size());
            } else if (to.size() >= job_size_) {
                size.add(size_of(to));
            }
        }
        return size;
    }

    std::vector<Job> jobs;

private:
    WideChildren children_of(const Subtree& subtree) const {
        return plan_ ? plan_->children_of(subtree) : balanced_children(tree_, subtree);
    }

    const BinaryTree& tree_;
    std::span<const Ref> refs_;
    const LeafSource& source_;
    const Plan* plan_;
    uint32_t job_size_;  // smaller subtrees become jobs; 0: none does
    WideTree& out_;
};

void resize(WideTree& tree, const TreeSpan& size) {
    tree.nodes.resize(size.node);
    tree.triangle_blocks.resize(size.triangle_block);
    tree.sphere_blocks.resize(size.sphere_block);
}

}  // namespace

uint32_t append(WideTree& whole, const WideTree& part) {
    const auto node_base = static_cast<uint32_t>(whole.nodes.size());
    const auto triangle_base = static_cast<uint32_t>(whole.triangle_blocks.size());
    const auto sphere_base = static_cast<uint32_t>(whole.sphere_blocks.size());
    whole.nodes.insert(whole.nodes.end(), part.nodes.begin(), part.nodes.end());
    whole.triangle_blocks.insert(whole.triangle_blocks.end(), part.triangle_blocks.begin(), part.triangle_blocks.end());
    whole.sphere_blocks.insert(whole.sphere_blocks.end(), part.sphere_blocks.begin(), part.sphere_blocks.end());
    const uint32_t base[4] = {node_base, triangle_base, sphere_base, 0};
    for (size_t i = node_base; i < whole.nodes.size(); ++i) {
        for (uint32_t& child : whole.nodes[i].child) child += base[static_cast<uint32_t>(child_kind(child))];
    }
    return node_base;
}

WideTree collapse(const BinaryTree& tree, std::span<const Ref> refs, const LeafSource& source, const LeafRule* rule,
                  ThreadPool& pool) {
    WideTree whole;
    whole.box = tree.box;
    if (refs.empty()) return whole;
    const auto count = static_cast<uint32_t>(refs.size());
    const uint32_t job_size = count < 2 * k_min_job ? 0 : max_of(k_min_job, count / 256);
    const auto plan = rule ? std::make_unique<Plan>(tree, refs, *rule, pool) : nullptr;
    const Subtree root{tree.box, tree.root, 0, count};
    Collapser top(tree, refs, source, plan.get(), job_size, whole);
    TreeSpan place, size = top.size_of(root);
    resize(whole, size);
    const auto top_part = top.write(root, place);
    const std::vector<Job>& jobs = top.jobs;
    const auto job_count = static_cast<uint32_t>(jobs.size());
    Collapser below(tree, refs, source, plan.get(), 0, whole);
    std::vector<TreeSpan> places(job_count);
    pool.run(job_count, [&](uint32_t i) { places[i] = below.size_of(jobs[i].subtree); });
    for (TreeSpan& job : places) {
        const TreeSpan begin = size;
        size.add(job);
        job = begin;
    }
    resize(whole, size);
    std::vector<Collapser::Written> parts(job_count);
    pool.run(job_count, [&](uint32_t i) {
        parts[i] = below.write(jobs[i].subtree, places[i]);
        whole.nodes[jobs[i].parent].child[jobs[i].slot] = make_child(ChildKind::node, parts[i].node);
    });
    Collapser::Written deepest;
    for (const auto& part : parts) {
        deepest.stack_need = max_of(deepest.stack_need, part.stack_need),
        deepest.depth = max_of(deepest.depth, part.depth);
    }
    whole.stack_need = top_part.stack_need + deepest.stack_need;
    whole.depth = top_part.depth + deepest.depth;
    return whole;
}

}  // namespace vlp
