// What every lobe answers for a pair of directions: its value and both densities.
#pragma once

#include "core/rgb.h"

namespace vlp {

// Directions closer to the surface's plane than this belong to neither side.
inline constexpr float k_min_cosine = 1e-7f;

// Two directions at a surface point, both leaving it: towards the eye's side of the path and towards the light's.
struct DirectionPair {
    Vec3 eye, light;
    Vec3 normal;               // for shading
    float eye_s, light_s;      // cosines with the shading normal
    float eye_g, light_g;      // cosines with the geometric normal

    VLP_HD bool on_surface() const { return std::fabs(eye_g) < k_min_cosine || std::fabs(light_g) < k_min_cosine; }
    VLP_HD bool reflects() const { return eye_g * light_g > 0; }
    // Each direction lies on the same side of the surface and of the shading frame (Veach 1997, 5.3: what the two do
    // not agree upon neither reflects nor refracts).
    VLP_HD bool frames_agree() const {
        return eye_s * eye_g > 0 && light_s * light_g > 0 && std::fabs(eye_s) > k_min_cosine &&
               std::fabs(light_s) > k_min_cosine;
    }
};

// `f` is f_s(light -> eye) |light.ns| / |light.ng|; the densities are per solid angle, without the probability of the
// lobe: of `light` for a walk that comes along `eye`, and of `eye` for a walk that comes along `light`.
struct LobeValue {
    Rgb f;
    float pdf_light = 0, pdf_eye = 0;
};

}  // namespace vlp
