// A place in the arrays of a tree.
#pragma once

#include <cstdint>

namespace vlp {

// Where a tree's part of each array begins, or how much of each it takes.
struct TreeSpan {
    uint32_t node = 0, triangle_block = 0, sphere_block = 0;

    void add(const TreeSpan& s) { node += s.node, triangle_block += s.triangle_block, sphere_block += s.sphere_block; }
};

}  // namespace vlp
