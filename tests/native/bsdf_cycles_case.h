// One material measured in Cycles.
#pragma once

#include <string>
#include <vector>

#include "scene/material_build.h"

namespace vlp::test {

// A plane seen at `cosine` with its normal: the light that it sends to the eye out of an environment of radiance 1 on the
// eye's side alone, and on the far side alone.
struct CyclesView {
    float cosine;
    Rgb near_side, far_side;
};

struct CyclesCase {
    std::string name;
    std::vector<LobeInput> lobes;
    std::vector<CyclesView> views;
};

}  // namespace vlp::test
