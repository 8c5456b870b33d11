// The trees of instanced geometries first, then the world's over all the rest.
#include "bvh/build.h"

#include <stdexcept>
#include <utility>

#include "bvh/node_box.h"
#include "bvh/presplit.h"
#include "bvh/trees.h"

namespace vlp {

namespace {

constexpr uint32_t k_always_flatten = 4096;  // primitives of all placements together
constexpr uint32_t k_small_geometry = 16384;  // primitives; such trees are built side by side, one thread each
constexpr uint32_t k_tree_stack = k_stack_size / 2 - 1;  // the other half is for the tree of an instance

WideTree build_tree(RawVector<Ref>& refs, const LeafSource& source, const uint8_t* kinds, ThreadPool& pool) {
    if (refs.size() >= 1u << k_child_index_bits) throw std::length_error("Too many primitives for one scene");
    presplit(refs, source, pool);
    const LeafRule rule{k_block_width, k_block_cost, kinds};  // the plan makes larger leaves where they pay
    WideTree tree = collapse(build_binary(refs, rule, 64, pool), refs, source, &rule, pool);
    if (tree.stack_need > k_tree_stack || tree.depth > k_max_depth) {  // shapes whose sizes grow exponentially
        tree = collapse(build_binary(refs, rule, 0, pool), refs, source, nullptr, pool);
    }
    return tree;
}

// Trees of the geometries that some instance keeps apart.
std::vector<WideTree> build_geometry_trees(std::span<const GeometryView> geometries,
                                           std::span<const InstanceView> instances,
                                           const std::vector<uint8_t>& flattened, ThreadPool& pool) {
    std::vector<uint8_t> wanted(geometries.size());
    for (size_t i = 0; i < instances.size(); ++i) wanted[instances[i].geometry] |= !flattened[i];
    std::vector<WideTree> trees(geometries.size());
    const auto build = [&](size_t g, ThreadPool& threads) {
        trees[g] = build_geometry_tree(geometries, instances, g, threads);
    };
    const auto is_small = [&](size_t g) { return geometries[g].primitive_count < k_small_geometry; };
    pool.run(static_cast<uint32_t>(geometries.size()), [&](uint32_t g) {
        ThreadPool alone(1);
        if (wanted[g] && is_small(g)) build(g, alone);
    });
    for (size_t g = 0; g < geometries.size(); ++g) {
        if (wanted[g] && !is_small(g)) build(g, pool);
    }
    return trees;
}

TreeSpan end_of(const WideTree& tree) {
    return {static_cast<uint32_t>(tree.nodes.size()), static_cast<uint32_t>(tree.triangle_blocks.size()),
            static_cast<uint32_t>(tree.sphere_blocks.size())};
}

}  // namespace

BvhView Bvh::view() const {
    return {nodes.data(), triangle_blocks.data(), sphere_blocks.data(), instance_roots.data(), root};
}

size_t Bvh::bytes() const {
    return nodes.size() * sizeof(BvhNode) + triangle_blocks.size() * sizeof(TriangleBlock) +
           sphere_blocks.size() * sizeof(SphereBlock) + instance_roots.size() * sizeof(uint32_t);
}

std::vector<uint8_t> choose_flattened(std::span<const GeometryView> geometries,
                                      std::span<const InstanceView> instances) {
    std::vector<uint32_t> placements(geometries.size());
    for (const InstanceView& instance : instances) ++placements[instance.geometry];
    std::vector<uint8_t> flattened(instances.size());
    for (size_t i = 0; i < instances.size(); ++i) {
        const uint32_t g = instances[i].geometry;
        const bool worth_it =
            placements[g] == 1 || uint64_t{placements[g]} * geometries[g].primitive_count <= k_always_flatten;
        flattened[i] = worth_it && can_flatten(geometries[g], instances[i]);
    }
    return flattened;
}

WideTree build_geometry_tree(std::span<const GeometryView> geometries, std::span<const InstanceView> instances,
                             size_t geometry, ThreadPool& pool) {
    RawVector<Ref> refs(geometries[geometry].primitive_count);
    const RefRun run{&geometries[geometry], nullptr, k_none, 0};
    write_refs({&run, 1}, pool, refs);
    return build_tree(refs, {geometries, instances, &geometries[geometry]}, nullptr, pool);
}

WideTree build_world_tree(std::span<const GeometryView> geometries, std::span<const InstanceView> instances,
                          std::span<const uint8_t> flattened, std::span<const BvhNode* const> roots, ThreadPool& pool) {
    size_t count = 0;
    for (size_t i = 0; i < instances.size(); ++i) {
        count += flattened[i] ? geometries[instances[i].geometry].primitive_count : 1;
    }
    if (count >= 1u << k_child_index_bits) throw std::length_error("Too many primitives for one scene");
    RawVector<Ref> refs;
    refs.reserve(count + k_free_splits + count / k_refs_per_split);
    std::vector<RefRun> runs;
    std::vector<uint8_t> kinds(instances.size());
    for (size_t i = 0; i < instances.size(); ++i) {
        const auto index = static_cast<uint32_t>(i), first = static_cast<uint32_t>(refs.size());
        const InstanceView& instance = instances[i];
        const GeometryView& geometry = geometries[instance.geometry];
        kinds[i] = static_cast<uint8_t>(geometry.kind);
        if (flattened[i]) {
            runs.push_back({&geometry, &instance, index, first});
            refs.resize(first + geometry.primitive_count);
        } else if (roots[instance.geometry]) {
            const Box box = instance_box(*roots[instance.geometry], instance.object_to_world);
            refs.push_back({box.low, index, box.high, k_none});
        }
    }
    write_refs(runs, pool, refs);
    return build_tree(refs, {geometries, instances, nullptr}, kinds.data(), pool);
}

Box instance_box(const BvhNode& root, const Affine& object_to_world) {
    Box box;
    for (uint32_t i = 0; i < k_node_width; ++i) {
        if (root.child[i] != k_none) box.include(transform_box(object_to_world, child_box(root, i)));
    }
    return box;
}

void check_size(const Bvh& bvh) {
    constexpr size_t k_most = size_t{1} << k_child_index_bits;
    if (bvh.nodes.size() >= k_most || bvh.triangle_blocks.size() >= k_most || bvh.sphere_blocks.size() >= k_most) {
        throw std::length_error("Too many primitives for one scene");
    }
}

Bvh build_bvh(std::span<const GeometryView> geometries, std::span<const InstanceView> instances, ThreadPool& pool) {
    Bvh bvh;
    bvh.flattened = choose_flattened(geometries, instances);
    std::vector<WideTree> trees = build_geometry_trees(geometries, instances, bvh.flattened, pool);
    std::vector<const BvhNode*> root_nodes(geometries.size());
    for (size_t g = 0; g < geometries.size(); ++g) {
        if (!trees[g].nodes.empty()) root_nodes[g] = trees[g].nodes.data();
    }
    WideTree world = build_world_tree(geometries, instances, bvh.flattened, root_nodes, pool);
    if (!world.nodes.empty()) {
        bvh.root = 0;
        bvh.low = world.box.low, bvh.high = world.box.high;
    }
    bvh.trees.emplace_back();
    std::vector<uint32_t> roots(geometries.size(), k_none);
    for (size_t g = 0; g < geometries.size(); ++g) {
        bvh.trees.push_back(end_of(world));
        if (!trees[g].nodes.empty()) roots[g] = append(world, trees[g]);
        trees[g] = {};
    }
    bvh.trees.push_back(end_of(world));
    bvh.built_costs.resize(1 + geometries.size());
    bvh.instance_roots.assign(instances.size(), k_none);
    for (size_t i = 0; i < instances.size(); ++i) {
        if (!bvh.flattened[i]) bvh.instance_roots[i] = roots[instances[i].geometry];
    }
    bvh.nodes = std::move(world.nodes);
    bvh.triangle_blocks = std::move(world.triangle_blocks);
    bvh.sphere_blocks = std::move(world.sphere_blocks);
    check_size(bvh);
    return bvh;
}

}  // namespace vlp
