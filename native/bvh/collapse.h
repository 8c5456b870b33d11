// From a binary tree to wide nodes (Wald, Benthin & Boulos 2008) with their leaves packed into blocks.
#pragma once

#include "bvh/plan.h"
#include "bvh/tree_span.h"

namespace vlp {

struct WideTree {
    RawVector<BvhNode> nodes;  // the root is the first; empty: no refs
    RawVector<TriangleBlock> triangle_blocks;
    RawVector<SphereBlock> sphere_blocks;
    Box box;
    uint32_t stack_need = 0;  // entries of the traversal's stack in the worst case
    uint32_t depth = 0;       // nodes on the longest way from the root
};

// Where the refs' primitives are: of the whole scene, or of one geometry (whose refs have no instance).
struct LeafSource {
    std::span<const GeometryView> geometries;
    std::span<const InstanceView> instances;
    const GeometryView* geometry = nullptr;

    const GeometryView& geometry_of(const Ref& ref) const {
        return geometry ? *geometry : geometries[instances[ref.instance].geometry];
    }
    // Null: the primitive stands where its geometry has it.
    const InstanceView* placement_of(const Ref& ref) const {
        return ref.instance == k_none ? nullptr : &instances[ref.instance];
    }
    Corners corners_of(const Ref& ref) const {
        return vlp::corners_of(geometry_of(ref), placement_of(ref), ref.primitive);
    }
    Sphere sphere_of(const Ref& ref) const {
        return vlp::sphere_of(geometry_of(ref), placement_of(ref), ref.primitive);
    }
};

// `rule`: by the cheapest plan; null: opens the child with the most refs first, which bounds the depth.
WideTree collapse(const BinaryTree& tree, std::span<const Ref> refs, const LeafSource& source, const LeafRule* rule,
                  ThreadPool& pool);

// Appends `part` to `whole` and returns the index of its root there.
uint32_t append(WideTree& whole, const WideTree& part);

}  // namespace vlp
