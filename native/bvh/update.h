// Brings the hierarchy of a scene to where its primitives have moved: refitted, or built anew where that pays.
#pragma once

#include "bvh/build.h"

namespace vlp {

// 1: geometries whose positions or radii, and instances whose transforms are others than before.
struct Moved {
    std::vector<uint8_t> geometries, instances;
};

// A tree is built anew once a refitted one costs this much more than it did when it was built; see native/bench/README.md.
inline constexpr double k_max_growth = 1.5;

// Geometries and instances must be as many as when `bvh` was built, of the same kinds and primitives. Afterwards rays find
// what they find in a tree that is built anew. The result does not depend on the number of threads.
void update_bvh(Bvh& bvh, std::span<const GeometryView> geometries, std::span<const InstanceView> instances,
                const Moved& moved, ThreadPool& pool, double max_growth = k_max_growth);

}  // namespace vlp
