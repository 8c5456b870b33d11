// The trees that a scene's hierarchy is made of, one at a time: the world's, and those that instances share.
#pragma once

#include "bvh/build.h"
#include "bvh/collapse.h"

namespace vlp {

inline constexpr float k_block_cost = 0.6f;  // of a block of primitives, in units of one step through a wide node

// Which instances stand in the world's tree as primitives.
std::vector<uint8_t> choose_flattened(std::span<const GeometryView> geometries,
                                      std::span<const InstanceView> instances);

WideTree build_geometry_tree(std::span<const GeometryView> geometries, std::span<const InstanceView> instances,
                             size_t geometry, ThreadPool& pool);

// `roots`: of the geometries' own trees, by geometry; null: it has none.
WideTree build_world_tree(std::span<const GeometryView> geometries, std::span<const InstanceView> instances,
                          std::span<const uint8_t> flattened, std::span<const BvhNode* const> roots, ThreadPool& pool);

// Of an instance: around the boxes of its tree's first level, which is tighter than around the root's box.
Box instance_box(const BvhNode& root, const Affine& object_to_world);

// Throws std::length_error when there is more than nodes can number.
void check_size(const Bvh& bvh);

}  // namespace vlp
