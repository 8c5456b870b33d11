// Writes wide nodes from the root down; subtrees are done in parallel and put one behind the other.
#include "bvh/collapse.h"

#include <memory>

#include "bvh/node_box.h"
#include "bvh/pack.h"

namespace vlp {

namespace {

constexpr uint32_t k_min_job = 2048;  // refs in a subtree that is worth a thread
constexpr uint32_t k_batch = 16;  // jobs of a thread before what they wrote is put into the tree, which takes memory

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

// Of a wide tree or of a part of it.
struct Size {
    size_t nodes = 0;
    size_t blocks[2] = {0, 0};  // by GeometryKind

    void add(const Size& s) { nodes += s.nodes, blocks[0] += s.blocks[0], blocks[1] += s.blocks[1]; }
};

void reserve(WideTree& tree, const Size& size) {
    tree.nodes.reserve(size.nodes);
    tree.triangle_blocks.reserve(size.blocks[static_cast<size_t>(GeometryKind::mesh)]);
    tree.sphere_blocks.reserve(size.blocks[static_cast<size_t>(GeometryKind::spheres)]);
}

class Collapser {
public:
    // `plan`: null for a balanced tree.
    Collapser(const BinaryTree& tree, std::span<const Ref> refs, const LeafSource& source, const Plan* plan,
              uint32_t job_size, WideTree& out)
        : tree_(tree), refs_(refs), source_(source), plan_(plan), job_size_(job_size), out_(out) {}

    // Writes the subtree and returns its root, the stack that it needs and its depth.
    struct Written {
        uint32_t node, stack_need, depth;
    };
    Written write(const Subtree& subtree) {
        const WideChildren children = plan_ ? plan_->children_of(subtree) : balanced_children(tree_, subtree);
        const auto index = static_cast<uint32_t>(out_.nodes.size());
        out_.nodes.emplace_back();
        uint32_t stack_need = 1, depth_below = 0;
        for (uint32_t i = 0; i < k_node_width; ++i) {
            const bool there = i < children.count;
            const Subtree& to = children.child[i];
            set_child_box(out_.nodes[index], i, there ? widened(to.box) : Box{});
            uint32_t child = k_none;
            if (there && to.is_leaf()) {
                child = pack_leaf(refs_.subspan(to.begin, to.size()), source_, out_);
            } else if (there && to.size() < job_size_) {
                jobs.push_back({to, index, i});
            } else if (there) {
                const Written written = write(to);
                child = make_child(ChildKind::node, written.node);
                stack_need = max_of(stack_need, written.stack_need);
                depth_below = max_of(depth_below, written.depth);
            }
            out_.nodes[index].child[i] = child;
        }
        return {index, stack_need + children.count - 1, depth_below + 1};
    }

    // What `write` would append, of jobs nothing.
    Size size_of(const Subtree& subtree) const {
        const WideChildren children = plan_ ? plan_->children_of(subtree) : balanced_children(tree_, subtree);
        Size size{1, {0, 0}};
        for (uint32_t i = 0; i < children.count; ++i) {
            const Subtree& to = children.child[i];
            if (to.is_leaf()) {
                const Ref& first = refs_[to.begin];
                if (first.primitive == k_none) continue;
                size.blocks[static_cast<size_t>(source_.geometry_of(first).kind)] += blocks_for(to.size());
            } else if (to.size() >= job_size_) {
                size.add(size_of(to));
            }
        }
        return size;
    }

    std::vector<Job> jobs;

private:
    const BinaryTree& tree_;
    std::span<const Ref> refs_;
    const LeafSource& source_;
    const Plan* plan_;
    uint32_t job_size_;  // smaller subtrees become jobs; 0: none does
    WideTree& out_;
};

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
    Collapser top(tree, refs, source, plan.get(), job_size, whole);
    const auto top_part = top.write({tree.box, tree.root, 0, count});
    const auto job_count = static_cast<uint32_t>(top.jobs.size());
    std::vector<Size> sizes(job_count);
    pool.run(job_count, [&](uint32_t i) {
        sizes[i] = Collapser(tree, refs, source, plan.get(), 0, whole).size_of(top.jobs[i].subtree);
    });
    Size size{whole.nodes.size(), {whole.triangle_blocks.size(), whole.sphere_blocks.size()}};
    for (const Size& part : sizes) size.add(part);
    reserve(whole, size);
    uint32_t stack_need = 0, depth = 0;
    std::vector<WideTree> parts;
    for (uint32_t begin = 0; begin < job_count; begin += static_cast<uint32_t>(parts.size())) {
        parts = std::vector<WideTree>(min_of(k_batch * pool.size(), job_count - begin));
        pool.run(static_cast<uint32_t>(parts.size()), [&](uint32_t i) {
            reserve(parts[i], sizes[begin + i]);
            Collapser part(tree, refs, source, plan.get(), 0, parts[i]);
            const auto written = part.write(top.jobs[begin + i].subtree);
            parts[i].stack_need = written.stack_need, parts[i].depth = written.depth;
        });
        for (uint32_t i = 0; i < parts.size(); ++i) {
            const Job& job = top.jobs[begin + i];
            const uint32_t root = append(whole, parts[i]);
            whole.nodes[job.parent].child[job.slot] = make_child(ChildKind::node, root);
            stack_need = max_of(stack_need, parts[i].stack_need);
            depth = max_of(depth, parts[i].depth);
        }
    }
    whole.stack_need = top_part.stack_need + stack_need;
    whole.depth = top_part.depth + depth;
    return whole;
}

}  // namespace vlp
