// Packs the primitives of a leaf into blocks.
#pragma once

#include "bvh/collapse.h"

namespace vlp {

// All `refs` are of one kind, or one instance. Appends blocks to `out` and returns the child that points to them.
uint32_t pack_leaf(std::span<const Ref> refs, const LeafSource& source, WideTree& out);

}  // namespace vlp
