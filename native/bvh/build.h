// Builds the acceleration structure of a scene.
#pragma once

#include <span>
#include <vector>

#include "bvh/layout.h"
#include "core/parallel.h"
#include "scene/scene_view.h"

namespace vlp {

struct Bvh {
    std::vector<BvhNode> nodes;
    std::vector<TriangleBlock> triangle_blocks;
    std::vector<SphereBlock> sphere_blocks;
    std::vector<uint32_t> instance_roots;
    uint32_t root = k_none;
    Vec3 low, high;  // bounds of every surface in world space; both 0 in an empty scene

    BvhView view() const;
    size_t bytes() const;
};

// Geometries that are placed once, or are small, are moved into the world's tree; the others keep a tree of their own,
// which their instances share. The result depends on the input alone, not on the number of threads. Positions, radii and
// transforms must be finite. Throws std::length_error when there are more primitives than a tree can number (2^27).
Bvh build_bvh(std::span<const GeometryView> geometries, std::span<const InstanceView> instances, ThreadPool& pool);

}  // namespace vlp
