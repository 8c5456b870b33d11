// Each tree by itself: moving one instance never builds the trees of geometries anew.
#include "bvh/update.h"

#include <algorithm>

#include "bvh/refit.h"
#include "bvh/trees.h"

namespace vlp {

namespace {

// Puts `part` where `whole` has [begin, end).
template <typename T>
void replace(RawVector<T>& whole, size_t begin, size_t end, const RawVector<T>& part) {
    const size_t common = min_of(part.size(), end - begin);
    const auto at = [&](size_t i) { return static_cast<std::ptrdiff_t>(i); };
    std::copy_n(part.begin(), common, whole.begin() + at(begin));
    whole.erase(whole.begin() + at(begin + common), whole.begin() + at(end));
    whole.insert(whole.begin() + at(begin + common), part.begin() + at(common), part.end());
}

// Moves the indices of the nodes [begin, end) by what is added to each kind's.
void shift_children(std::span<BvhNode> nodes, const TreeSpan& by) {
    const uint32_t add[4] = {by.node, by.triangle_block, by.sphere_block, 0};
    for (BvhNode& node : nodes) {
        for (uint32_t& child : node.child) child += add[static_cast<uint32_t>(child_kind(child))];
    }
}

// In place of the one that stands there; the trees behind it move.
void replace_tree(Bvh& bvh, size_t which, const WideTree& tree) {
    const TreeSpan begin = bvh.trees[which], end = bvh.trees[which + 1];
    replace(bvh.nodes, begin.node, end.node, tree.nodes);
    replace(bvh.triangle_blocks, begin.triangle_block, end.triangle_block, tree.triangle_blocks);
    replace(bvh.sphere_blocks, begin.sphere_block, end.sphere_block, tree.sphere_blocks);
    check_size(bvh);
    const TreeSpan moved_end{begin.node + static_cast<uint32_t>(tree.nodes.size()),
                             begin.triangle_block + static_cast<uint32_t>(tree.triangle_blocks.size()),
                             begin.sphere_block + static_cast<uint32_t>(tree.sphere_blocks.size())};
    // Differences may be negative: unsigned numbers that wrap round.
    const TreeSpan by{moved_end.node - end.node, moved_end.triangle_block - end.triangle_block,
                      moved_end.sphere_block - end.sphere_block};
    const std::span<BvhNode> nodes(bvh.nodes);
    shift_children(nodes.subspan(begin.node, tree.nodes.size()), begin);
    shift_children(nodes.subspan(moved_end.node), by);
    for (size_t t = which + 1; t < bvh.trees.size(); ++t) bvh.trees[t].add(by);
    for (uint32_t& root : bvh.instance_roots) {
        if (root != k_none && root >= end.node) root += by.node;
    }
}

class Updater {
public:
    Updater(Bvh& bvh, std::span<const GeometryView> geometries, std::span<const InstanceView> instances,
            double max_growth, ThreadPool& pool)
        : bvh_(bvh), geometries_(geometries), instances_(instances), max_growth_(max_growth), pool_(pool) {}

    void update_geometry(size_t g) {
        if (bvh_.is_empty(1 + g)) return;
        update(1 + g, {geometries_, instances_, &geometries_[g]}, {true, {}},
               [&] { return build_geometry_tree(geometries_, instances_, g, pool_); });
    }

    void update_world(std::span<const uint8_t> moved) {
        if (bvh_.is_empty(0)) return;
        const Box box = update(0, {geometries_, instances_, nullptr}, {false, moved}, [&] {
            std::vector<const BvhNode*> roots(geometries_.size());
            for (size_t g = 0; g < roots.size(); ++g) {
                if (!bvh_.is_empty(1 + g)) roots[g] = &bvh_.nodes[bvh_.trees[1 + g].node];
            }
            return build_world_tree(geometries_, instances_, bvh_.flattened, roots, pool_);
        });
        bvh_.low = box.low, bvh_.high = box.high;
    }

private:
    template <typename Build>
    Box update(size_t which, const LeafSource& source, const MovedRefs& moved, const Build& build) {
        std::optional<double>& built_cost = bvh_.built_costs[which];
        if (!built_cost) built_cost = refit(bvh_, which, source, {}, pool_).cost;
        const Refitted refitted = refit(bvh_, which, source, moved, pool_);
        if (refitted.cost <= max_growth_ * *built_cost) return refitted.box;
        const WideTree tree = build();
        replace_tree(bvh_, which, tree);
        built_cost.reset();
        return tree.box;
    }

    Bvh& bvh_;
    std::span<const GeometryView> geometries_;
    std::span<const InstanceView> instances_;
    double max_growth_;
    ThreadPool& pool_;
};

}  // namespace

void update_bvh(Bvh& bvh, std::span<const GeometryView> geometries, std::span<const InstanceView> instances,
                const Moved& moved, ThreadPool& pool, double max_growth) {
    // A transform may make ellipsoids of spheres, which then stand apart.
    if (choose_flattened(geometries, instances) != bvh.flattened) {
        bvh = build_bvh(geometries, instances, pool);
        return;
    }
    std::vector<uint8_t> in_world(instances.size());
    for (size_t i = 0; i < instances.size(); ++i) {
        in_world[i] = moved.instances[i] | moved.geometries[instances[i].geometry];
    }
    if (std::ranges::find(in_world, 1) == in_world.end()) return;
    Updater updater(bvh, geometries, instances, max_growth, pool);
    for (size_t g = 0; g < geometries.size(); ++g) {
        if (moved.geometries[g]) updater.update_geometry(g);
    }
    updater.update_world(in_world);
}

}  // namespace vlp
