// Builds the tree that next event chooses lights by (host only).
#pragma once

#include <vector>

#include "core/parallel.h"
#include "light/light_tree.h"

namespace vlp {

struct LightTree {
    std::vector<LightTreeNode> nodes;
    std::vector<uint32_t> places, infinite_lights, infinite_below;
    float infinite_irradiance = 0;
};

LightTree build_light_tree(const std::vector<Light>& lights, ThreadPool& pool);

// The bounds of one light that is not infinitely far away, which is no node's child yet.
LightTreeNode bounds_of(const Light& light);

// Those of two nodes together.
LightTreeNode merge(const LightTreeNode& a, const LightTreeNode& b);

}  // namespace vlp
