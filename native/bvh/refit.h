// Moves a tree with what it holds: the nodes stay, their boxes and leaves follow the primitives.
#pragma once

#include "bvh/build.h"
#include "bvh/collapse.h"

namespace vlp {

// What of a tree has moved: all of it, as in a geometry's own tree, or what belongs to some instances.
struct MovedRefs {
    bool all = false;
    std::span<const uint8_t> instances;  // by instance, 1: moved; may be empty

    bool of(uint32_t instance) const { return all || (!instances.empty() && instances[instance]); }
};

struct Refitted {
    Box box;  // of the primitives, without margins
    // By the surface area heuristic: what a ray's steps through nodes and leaves cost, beside the boxes of the primitives.
    // Those grow with a tree that is stretched or turned, and would after a build as well.
    double cost = 0;
};

// Brings tree `which` of `bvh.trees` to where its source has the primitives now. Trees of geometries come before the
// world's, which asks them for boxes. The tree must hold something. The result does not depend on the number of threads.
Refitted refit(Bvh& bvh, size_t which, const LeafSource& source, const MovedRefs& moved, ThreadPool& pool);

}  // namespace vlp
