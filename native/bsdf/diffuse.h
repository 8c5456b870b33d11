// Lambertian reflection and transmission.
#pragma once

#include "bsdf/lobe_value.h"
#include "bsdf/microfacet.h"
#include "core/frame.h"

namespace vlp {

// A direction of density |cos| / pi with the shading normal on the side of the geometric normal that `toward` (1 or -1)
// names. What the shading normal puts on the wrong side is turned around, so that no sample is lost and the whole
// side is covered, even where it lies below the shading normal.
VLP_HD inline Vec3 sample_cosine(Vec3 normal, Vec3 geometric_normal, float toward, Vec2 u) {
    const float r = std::sqrt(u.x);
    const Vec2 circle = unit_circle(u.y);
    const Vec3 w = make_frame(normal).to_world({r * circle.x, r * circle.y, std::sqrt(1.0f - u.x)});
    return dot(w, geometric_normal) * toward < 0 ? -w : w;
}

// Light arrives by the cosine with the shading normal, from the same side of it as of the surface. Where the eye is
// below the shading normal does not matter to a Lambertian surface: silhouettes of smooth-shaded meshes stay lit.
VLP_HD inline LobeValue evaluate_diffuse(Rgb weight, const DirectionPair& d) {
    const float ratio = d.light_s / d.light_g;
    return {ratio > 0 ? weight * (k_inv_pi * ratio) : Rgb{}, k_inv_pi * std::fabs(d.light_s),
            k_inv_pi * std::fabs(d.eye_s)};
}

}  // namespace vlp
