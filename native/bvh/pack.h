// Packs the primitives of a leaf into blocks.
#pragma once

#include "bvh/collapse.h"

namespace vlp {

// A lane of a block: its primitive, and whose it is.
void set_lane(TriangleBlock& block, uint32_t lane, const Corners& corners, const Ref& ref);
void set_lane(SphereBlock& block, uint32_t lane, const Sphere& sphere, const Ref& ref);
Corners in_lane(const TriangleBlock& block, uint32_t lane);
Sphere in_lane(const SphereBlock& block, uint32_t lane);

// All `refs` are of one kind, or one instance. Writes blocks to `out` at `place`, which moves behind them, and returns the
// child that points to them.
uint32_t pack_leaf(std::span<const Ref> refs, const LeafSource& source, WideTree& out, TreeSpan& place);

}  // namespace vlp
