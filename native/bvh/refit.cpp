// Leaves first, in any order, then the inner nodes from the last to the first: children stand behind their parents.
#include "bvh/refit.h"

#include "bvh/moved_part.h"
#include "bvh/node_box.h"
#include "bvh/pack.h"
#include "bvh/trees.h"

namespace vlp {

namespace {

constexpr uint32_t k_chunk = 256;  // nodes

double area_of(const Box& box) { return static_cast<double>(box.half_area()); }

// Of the primitives and instances in some leaves.
struct Contents {
    Box box;
    double area = 0;

    void include(const Box& b) { box.include(b), area += area_of(b); }
    void include(const Contents& c) { box.include(c.box), area += c.area; }
};

class Refitter {
public:
    Refitter(Bvh& bvh, const LeafSource& source, const MovedRefs& moved) : bvh_(bvh), source_(source), moved_(moved) {}

    void refit_leaves(BvhNode& node, Contents& contents) {
        for (uint32_t i = 0; i < k_node_width; ++i) {
            const uint32_t child = node.child[i];
            if (child == k_none) continue;
            switch (child_kind(child)) {
                case ChildKind::node:
                    break;
                case ChildKind::triangles:
                    refit_leaf(bvh_.triangle_blocks, node, i, contents);
                    break;
                case ChildKind::spheres:
                    refit_leaf(bvh_.sphere_blocks, node, i, contents);
                    break;
                case ChildKind::instance:
                    refit_instance(node, i, contents);
                    break;
            }
        }
    }

    // Boxes of children that are nodes, whose own boxes are right. Returns what the node's children cost.
    double refit_node(BvhNode& node) {
        double cost = 0;
        for (uint32_t i = 0; i < k_node_width; ++i) {
            const uint32_t child = node.child[i];
            if (child == k_none) continue;
            const ChildKind kind = child_kind(child);
            if (kind == ChildKind::node) set_child_box(node, i, node_box(bvh_.nodes[child_index(child)]));
            const bool is_leaf = kind == ChildKind::triangles || kind == ChildKind::spheres;
            const double steps = is_leaf ? static_cast<double>(k_block_cost) * child_blocks(child) : 1.0;
            cost += steps * area_of(child_box(node, i));
        }
        return cost;
    }

private:
    template <typename Block>
    void refit_leaf(RawVector<Block>& all, BvhNode& node, uint32_t i, Contents& contents) {
        const uint32_t first = child_index(node.child[i]);
        const std::span<Block> blocks(all.data() + first, child_blocks(node.child[i]));
        const bool moves = has_moved(blocks);
        const Box before = child_box(node, i);
        Box after;
        for (Block& block : blocks) {
            for (uint32_t lane = 0; lane < k_block_width && block.primitive[lane] != k_none; ++lane) {
                if (moves) after.include(move(block, lane, before));
                contents.include(box_of(in_lane(block, lane)));
            }
        }
        if (moves) set_child_box(node, i, widened(after));
    }

    template <typename Block>
    bool has_moved(std::span<Block> blocks) const {
        for (const Block& block : blocks) {
            for (uint32_t lane = 0; lane < k_block_width && block.primitive[lane] != k_none; ++lane) {
                if (moved_.of(block.instance[lane])) return true;
            }
        }
        return false;
    }

    // Of the primitive in a lane, or of its part in the leaf's box from before.
    Box move(TriangleBlock& block, uint32_t lane, const Box& before) {
        const Ref ref{{}, block.instance[lane], {}, block.primitive[lane]};
        const Corners from = in_lane(block, lane), to = source_.corners_of(ref);
        set_lane(block, lane, to, ref);
        return moved_part(from, before, to);
    }
    Box move(SphereBlock& block, uint32_t lane, const Box&) {
        const Ref ref{{}, block.instance[lane], {}, block.primitive[lane]};
        const Sphere to = source_.sphere_of(ref);
        set_lane(block, lane, to, ref);
        return box_of(to);
    }

    void refit_instance(BvhNode& node, uint32_t i, Contents& contents) {
        const uint32_t index = child_index(node.child[i]);
        const BvhNode& root = bvh_.nodes[bvh_.instance_roots[index]];
        const Box box = instance_box(root, source_.instances[index].object_to_world);
        if (moved_.of(index)) set_child_box(node, i, widened(box));
        contents.box.include(box);
        contents.area += area_of(child_box(node, i));  // of what has not moved as it was
    }

    Bvh& bvh_;
    const LeafSource& source_;
    const MovedRefs& moved_;
};

}  // namespace

Refitted refit(Bvh& bvh, size_t which, const LeafSource& source, const MovedRefs& moved, ThreadPool& pool) {
    const uint32_t begin = bvh.trees[which].node, end = bvh.trees[which + 1].node;
    Refitter refitter(bvh, source, moved);
    std::vector<Contents> parts((end - begin + k_chunk - 1) / k_chunk);
    pool.run(static_cast<uint32_t>(parts.size()), [&](uint32_t chunk) {
        const uint32_t first = begin + chunk * k_chunk, stop = min_of(end, first + k_chunk);
        for (uint32_t n = first; n < stop; ++n) refitter.refit_leaves(bvh.nodes[n], parts[chunk]);
    });
    Contents contents;
    for (const Contents& part : parts) contents.include(part);
    double cost = 0;
    for (uint32_t n = end; n-- > begin;) cost += refitter.refit_node(bvh.nodes[n]);
    cost += area_of(node_box(bvh.nodes[begin]));
    return {contents.box, contents.area > 0 ? cost / contents.area : 0};
}

}  // namespace vlp
