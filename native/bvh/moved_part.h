// Where a part of a triangle goes when the triangle's corners move.
#pragma once

#include "bvh/refs.h"

namespace vlp {

// Bounds of what was in `box` of the triangle `from`, after its corners have moved to `to`. Parts that covered the triangle
// together still do so. The whole triangle where it was in the box, or where none of it was.
Box moved_part(const Corners& from, const Box& box, const Corners& to);

}  // namespace vlp
