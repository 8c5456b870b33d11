// Blocks of structure-of-arrays primitives; lanes that stay empty hold NaN, which no ray meets.
#include "bvh/pack.h"

#include <limits>

namespace vlp {

namespace {

constexpr float k_nan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

void set_lane(TriangleBlock& block, uint32_t lane, const Corners& corners, const Ref& ref) {
    for (uint32_t vertex = 0; vertex < 3; ++vertex) {
        for (uint32_t axis = 0; axis < 3; ++axis) block.vertex[vertex][axis][lane] = (&corners.v[vertex].x)[axis];
    }
    block.instance[lane] = ref.instance, block.primitive[lane] = ref.primitive;
}

void set_lane(SphereBlock& block, uint32_t lane, const Sphere& sphere, const Ref& ref) {
    for (uint32_t axis = 0; axis < 3; ++axis) block.center[axis][lane] = (&sphere.center.x)[axis];
    block.radius[lane] = sphere.radius;
    block.instance[lane] = ref.instance, block.primitive[lane] = ref.primitive;
}

Corners in_lane(const TriangleBlock& block, uint32_t lane) {
    Corners corners;
    for (uint32_t vertex = 0; vertex < 3; ++vertex) {
        for (uint32_t axis = 0; axis < 3; ++axis) (&corners.v[vertex].x)[axis] = block.vertex[vertex][axis][lane];
    }
    return corners;
}

Sphere in_lane(const SphereBlock& block, uint32_t lane) {
    return {{block.center[0][lane], block.center[1][lane], block.center[2][lane]}, block.radius[lane]};
}

uint32_t pack_leaf(std::span<const Ref> refs, const LeafSource& source, WideTree& out, TreeSpan& place) {
    const Ref& first = refs.front();
    if (first.primitive == k_none) return make_child(ChildKind::instance, first.instance);
    const uint32_t blocks = blocks_for(static_cast<uint32_t>(refs.size()));
    if (source.geometry_of(first).kind == GeometryKind::mesh) {
        const uint32_t index = place.triangle_block;
        place.triangle_block += blocks;
        for (uint32_t i = 0; i < blocks * k_block_width; ++i) {
            TriangleBlock& block = out.triangle_blocks[index + i / k_block_width];
            const Corners none{{{k_nan, k_nan, k_nan}, {k_nan, k_nan, k_nan}, {k_nan, k_nan, k_nan}}};
            if (i >= refs.size()) {
                set_lane(block, i % k_block_width, none, Ref{{}, k_none, {}, k_none});
            } else {
                const Ref& ref = refs[i];
                set_lane(block, i % k_block_width, source.corners_of(ref), ref);
            }
        }
        return make_child(ChildKind::triangles, index, blocks);
    }
    const uint32_t index = place.sphere_block;
    place.sphere_block += blocks;
    for (uint32_t i = 0; i < blocks * k_block_width; ++i) {
        SphereBlock& block = out.sphere_blocks[index + i / k_block_width];
        if (i >= refs.size()) {
            set_lane(block, i % k_block_width, Sphere{{}, k_nan}, Ref{{}, k_none, {}, k_none});
        } else {
            const Ref& ref = refs[i];
            set_lane(block, i % k_block_width, source.sphere_of(ref), ref);
        }
    }
    return make_child(ChildKind::spheres, index, blocks);
}

}  // namespace vlp
