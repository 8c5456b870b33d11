// Builds the acceleration structure of a scene.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bvh/layout.h"
#include "bvh/tree_span.h"
#include "core/parallel.h"
#include "core/raw_vector.h"
#include "scene/scene_view.h"

namespace vlp {

struct Bvh {
    RawVector<BvhNode> nodes;  // each before its children
    RawVector<TriangleBlock> triangle_blocks;
    RawVector<SphereBlock> sphere_blocks;
    std::vector<uint32_t> instance_roots;
    uint32_t root = k_none;
    Vec3 low, high;  // bounds of every surface in world space; both 0 in an empty scene

    // For updates, which need to know what stands where: the world's tree, one for each geometry (often none), the end.
    std::vector<TreeSpan> trees;
    std::vector<uint8_t> flattened;  // by instance: its primitives are in the world's tree
    std::vector<std::optional<double>> built_costs;  // of the trees, see Refitted; told by the first update

    bool is_empty(size_t tree) const { return trees[tree].node == trees[tree + 1].node; }
    BvhView view() const;
    size_t bytes() const;
};

// Geometries that are placed once, or are small, are moved into the world's tree; the others keep a tree of their own,
// which their instances share. The result depends on the input alone, not on the number of threads. Positions, radii and
// transforms must be finite. Throws std::length_error when there are more primitives than a tree can number (2^27).
Bvh build_bvh(std::span<const GeometryView> geometries, std::span<const InstanceView> instances, ThreadPool& pool);

}  // namespace vlp
