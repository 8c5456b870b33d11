// The acceleration structure as plain data, and what a ray finds in it.
#pragma once

#include "core/vec.h"

namespace vlp {

// What a closest-hit query found. For a triangle (u, v) weigh its second and third vertex; a sphere leaves them 0.
struct Hit {
    float t = k_infinity;
    float u = 0, v = 0;
    uint32_t primitive = k_none;  // in its geometry
    uint32_t instance = k_none;   // k_none: nothing was hit

    VLP_HD bool found() const { return instance != k_none; }
};

// A primitive that a ray must not hit: the one it leaves from, and the one it goes to.
struct PrimitiveId {
    uint32_t instance = k_none;
    uint32_t primitive = k_none;
};

struct BvhNode;
struct CompressedNode;
struct TriangleBlock;
struct SphereBlock;

// One tree: the world's. Its leaves hold triangles and spheres of geometries that are placed once (in world space) and
// instances of the others, whose own trees stand in the same arrays.
struct BvhView {
    const BvhNode* nodes = nullptr;            // null on a device
    const TriangleBlock* triangle_blocks = nullptr;
    const SphereBlock* sphere_blocks = nullptr;
    const uint32_t* instance_roots = nullptr;  // by instance: root of its geometry's own tree
    uint32_t root = k_none;                    // k_none: an empty scene
    const CompressedNode* compressed = nullptr;  // in place of `nodes` on a device
};

}  // namespace vlp
