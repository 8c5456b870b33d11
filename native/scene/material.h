// Materials as plain data: a weighted list of scattering lobes and an emitted radiance.
#pragma once

#include "core/rgb.h"

namespace vlp {

// The same numbers as vlp_bpt.scene.LobeKind.
enum class LobeKind : uint8_t { diffuse, translucent, reflection, dielectric, refraction, transparent };

// The Fresnel term of a reflection lobe; the same numbers as vlp_bpt.scene.Fresnel.
enum class Fresnel : uint8_t { none, dielectric, schlick, conductor };

struct Lobe {
    LobeKind kind = LobeKind::diffuse;
    Fresnel fresnel = Fresnel::none;
    int8_t layered_under = -1;  // index in the material of the lobe above this one, -1: none
    bool compensate = false;    // adds back the energy that single-scattering GGX loses
    float selection = 0;        // probability that `sample` picks this lobe, given the path did not pass through
    float alpha = 0;            // GGX width; 0: specular
    float eta = 1;              // index of refraction inside over outside, outside being where the normal points
    Rgb weight;
    Rgb f0;   // schlick: reflectance at normal incidence; conductor: eta
    Rgb f82;  // schlick: tint near 82 degrees; conductor: k
};

// Lobes of width below this are specular: a delta distribution.
inline constexpr float k_min_alpha = 1e-6f;

VLP_HD constexpr bool is_specular(const Lobe& lobe) {
    return lobe.kind != LobeKind::diffuse && lobe.kind != LobeKind::translucent && lobe.alpha < k_min_alpha;
}

struct Material {
    uint32_t first_lobe = 0;
    uint32_t lobe_count = 0;      // without the transparent ones, which are summed up below
    bool has_specular = false;    // some lobe is a delta distribution
    bool has_finite = false;      // some lobe is not: the surface can be connected and hold VLPs
    float pass_through = 0;       // probability that a path goes straight through
    Rgb transparency;             // what passes straight through, for connection rays; weight / pass_through for paths
    Rgb emission;                 // radiance on both sides
};

}  // namespace vlp
