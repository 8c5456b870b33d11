// Opens the largest child until a node is full; subtrees are done in parallel and put one behind the other.
#include "bvh/collapse.h"

#include <array>

#include "bvh/pack.h"

namespace vlp {

namespace {

constexpr uint32_t k_min_job = 2048;  // refs in a subtree that is worth a thread

// A subtree of the binary tree: a node, or a leaf of refs [begin, end).
struct Entry {
    Box box;
    uint32_t node, begin, end;
};

// A subtree left to a thread, and the child that will point to it.
struct Job {
    Entry entry;
    uint32_t parent, slot;
};

class Collapser {
public:
    Collapser(const BinaryTree& tree, std::span<const Ref> refs, const LeafSource& source, bool balanced,
              uint32_t job_size, WideTree& out)
        : tree_(tree), refs_(refs), source_(source), balanced_(balanced), job_size_(job_size), out_(out) {}

    // Writes the subtree and returns its root and the stack that it needs.
    struct Written {
        uint32_t node, stack_need;
    };
    Written write(const Entry& entry) {
        std::array<Entry, k_node_width> children;
        const uint32_t count = open(entry, children);
        const auto index = static_cast<uint32_t>(out_.nodes.size());
        out_.nodes.emplace_back();
        uint32_t deepest = 1;
        for (uint32_t i = 0; i < k_node_width; ++i) {
            set_bounds(out_.nodes[index], i, i < count ? children[i].box : Box{});
            uint32_t child = k_none;
            if (i < count && children[i].node == k_leaf_flag) {
                child = pack_leaf(refs_.subspan(children[i].begin, children[i].end - children[i].begin), source_, out_);
            } else if (i < count && children[i].end - children[i].begin < job_size_) {
                jobs.push_back({children[i], index, i});
            } else if (i < count) {
                const Written written = write(children[i]);
                child = make_child(ChildKind::node, written.node);
                deepest = max_of(deepest, written.stack_need);
            }
            out_.nodes[index].child[i] = child;
        }
        return {index, deepest + count - 1};
    }

    std::vector<Job> jobs;

private:
    uint32_t open(const Entry& entry, std::array<Entry, k_node_width>& children) const {
        uint32_t count = 1;
        children[0] = entry;
        while (count < k_node_width) {
            uint32_t best = k_none;
            float largest = -1;
            for (uint32_t i = 0; i < count; ++i) {
                if (children[i].node == k_leaf_flag) continue;
                const float size = balanced_ ? static_cast<float>(children[i].end - children[i].begin)
                                             : min_of(children[i].box.half_area(), 0x1p127f);
                if (size > largest) largest = size, best = i;
            }
            if (best == k_none) break;
            const uint32_t split = children[best].node;
            const BinaryNode& node = tree_.nodes[split];
            children[best] = {node.box[0], node.child[0], node.begin, split};
            children[count++] = {node.box[1], node.child[1], split, node.end};
        }
        return count;
    }

    static void set_bounds(BvhNode& node, uint32_t i, const Box& box) {
        for (uint32_t axis = 0; axis < 3; ++axis) {
            node.bounds[axis][i] = (&box.low.x)[axis];
            node.bounds[axis + 3][i] = (&box.high.x)[axis];
        }
    }

    const BinaryTree& tree_;
    std::span<const Ref> refs_;
    const LeafSource& source_;
    bool balanced_;
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

WideTree collapse(const BinaryTree& tree, std::span<const Ref> refs, const LeafSource& source, bool balanced,
                  ThreadPool& pool) {
    WideTree whole;
    whole.box = tree.box;
    if (refs.empty()) return whole;
    const auto count = static_cast<uint32_t>(refs.size());
    const uint32_t job_size = count < 2 * k_min_job ? 0 : max_of(k_min_job, count / 256);
    Collapser top(tree, refs, source, balanced, job_size, whole);
    const uint32_t top_need = top.write({tree.box, tree.root, 0, count}).stack_need;
    std::vector<WideTree> parts(top.jobs.size());
    pool.run(static_cast<uint32_t>(parts.size()), [&](uint32_t i) {
        Collapser part(tree, refs, source, balanced, 0, parts[i]);
        parts[i].stack_need = part.write(top.jobs[i].entry).stack_need;
    });
    uint32_t deepest = 0;
    for (size_t i = 0; i < parts.size(); ++i) {
        const Job& job = top.jobs[i];
        const uint32_t root = append(whole, parts[i]);
        parts[i].nodes = {}, parts[i].triangle_blocks = {}, parts[i].sphere_blocks = {};
        whole.nodes[job.parent].child[job.slot] = make_child(ChildKind::node, root);
        deepest = max_of(deepest, parts[i].stack_need);
    }
    whole.stack_need = top_need + deepest;
    return whole;
}

}  // namespace vlp
