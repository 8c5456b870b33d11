// Turns the lobes of a material as users describe them into what the passes read (host only).
#pragma once

#include <span>
#include <vector>

#include "scene/material.h"

namespace vlp {

// One lobe as vlp_bpt.scene.Lobe has it.
struct LobeInput {
    LobeKind kind = LobeKind::diffuse;
    Fresnel fresnel = Fresnel::none;
    Rgb weight = rgb(1);
    float roughness = 0;  // alpha = roughness^2
    float ior = 1.5f;
    Rgb f0 = rgb(1), f82 = rgb(1);
    int layered_under = -1;
    bool compensate = false;
};

// Appends the material's lobes to `lobes`. Transparent lobes, and refraction by an index of 1, become transparency.
// Throws std::invalid_argument naming the lobe and the value at fault.
Material build_material(std::span<const LobeInput> input, Rgb emission, std::vector<Lobe>& lobes);

}  // namespace vlp
