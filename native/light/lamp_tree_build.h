// Builds the tree over the shapes of lamps (host only).
#pragma once

#include <vector>

#include "bvh/refs.h"
#include "core/parallel.h"
#include "light/lamp_tree.h"

namespace vlp {

struct LampTree {
    std::vector<uint32_t> lights;  // in the order of the leaves
    std::vector<LampNode> nodes;   // empty where a list is enough
    uint32_t root = 0;
};

// The box of a light that is not infinitely far away, as wide as rounding in the tests of ray and shape may ask for.
Box box_of(const Light& light);

// `shapes`: indices into `lights` of lamps with a radius or an area.
LampTree build_lamp_tree(const std::vector<Light>& lights, std::vector<uint32_t> shapes, ThreadPool& pool);

}  // namespace vlp
