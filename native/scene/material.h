// Materials as plain data: a weighted list of scattering lobes and an emitted radiance.
#pragma once

#include "core/rgb.h"

namespace vlp {

// The same numbers as vlp_bpt.scene.LobeKind.
enum class LobeKind : uint8_t { diffuse, translucent, reflection, dielectric, refraction, transparent };

// The Fresnel term of a lobe; the same numbers as vlp_bpt.scene.Fresnel.
enum class Fresnel : uint8_t { none, dielectric, schlick, conductor, tinted_dielectric };

struct Lobe {
    LobeKind kind = LobeKind::diffuse;
    Fresnel fresnel = Fresnel::none;
    int8_t layered_under = -1;  // index in the material of the lobe above this one, -1: none
    bool compensate = false;    // adds back the energy that single-scattering GGX loses
    float selection = 0;        // probability that `sample` picks this lobe, given the path did not pass through
    float alpha = 0;            // GGX width; 0: specular
    float eta = 1;              // index of refraction inside over outside, outside being where the normal points
    Rgb weight;
    // none: reflectance; dielectric: tint of the reflection; tinted_dielectric: tint of the reflectance at normal
    // incidence; schlick: reflectance at normal incidence; conductor: index of refraction
    Rgb f0 = rgb(1);
    // dielectric lobe: tint of what it refracts; schlick: tint near 82 degrees; conductor: absorption index k
    Rgb f82 = rgb(1);
};

// GGX lobes of width below this are specular: a delta distribution. The same width as in Cycles (a roughness of
// 0.0038); single precision cannot resolve much narrower lobes.
inline constexpr float k_min_alpha = 1.4142e-5f;

VLP_HD constexpr bool is_specular(const Lobe& lobe) {
    return lobe.kind != LobeKind::diffuse && lobe.kind != LobeKind::translucent && lobe.alpha < k_min_alpha;
}

struct Material {
    uint32_t first_lobe = 0;
    uint32_t lobe_count = 0;      // without the transparent ones, which are summed up below
    bool has_specular = false;    // some lobe is a delta distribution
    bool has_finite = false;      // some lobe is not: the surface can be connected and hold VLPs
    bool transmits = false;       // some finite lobe lets light through to the other side
    float pass_through = 0;       // probability that a path goes straight through
    Rgb transparency;  // what passes straight through, for connection rays; weight / pass_through for paths
    Rgb albedo;  // about what finite lobes scatter of light from everywhere, nowhere 0
    Rgb emission;  // radiance on both sides
};

}  // namespace vlp
