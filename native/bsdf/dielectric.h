// GGX refraction, alone or with the reflection of the same microfacets: rough glass (Walter et al. 2007).
#pragma once

#include "bsdf/albedo.h"
#include "bsdf/fresnel.h"
#include "bsdf/lobe_value.h"
#include "bsdf/microfacet.h"
#include "scene/material.h"

namespace vlp {

// What a microfacet does with the light: shares that reflect and refract, and how often `sample` chooses to reflect.
// The same from both ends of a path, since the Fresnel term is.
struct Split {
    Rgb reflect, refract;
    float choose_reflect;
};

VLP_HD inline Split split_light(const Lobe& lobe, float cos_i, float eta) {
    const float f = fresnel_dielectric(cos_i, eta);
    if (lobe.kind == LobeKind::refraction) return {Rgb{}, f < 1 ? lobe.f82 : Rgb{}, 0};
    const bool tinted = lobe.fresnel == Fresnel::tinted_dielectric;
    const Rgb reflect = tinted ? fresnel_tinted_dielectric(cos_i, eta, lobe.f0) : lobe.f0 * f;
    const Rgb refract = (rgb(1) - (tinted ? reflect : rgb(f))) * lobe.f82;
    const float r = average(reflect), t = average(refract);
    return {reflect, refract, r + t > 0 ? r / (r + t) : 1.0f};
}

VLP_HD inline LobeValue evaluate_dielectric(const Lobe& lobe, const float* tables, const DirectionPair& d) {
    const bool reflects = d.reflects();
    if (!d.frames_agree() || (reflects && lobe.kind == LobeKind::refraction)) return {};
    const Vec3 normal = d.eye_s < 0 ? -d.normal : d.normal;
    const float eta = d.eye_s < 0 ? 1.0f / lobe.eta : lobe.eta;  // behind over in front, seen from the eye
    const float cos_eye = std::fabs(d.eye_s), cos_light = std::fabs(d.light_s);

    Vec3 h = d.eye + d.light * (reflects ? 1.0f : eta);
    if (length_squared(h) < k_min_half_squared) return {};
    h = normalize(face_toward(h, normal));
    const float eye_h = dot(d.eye, h), light_h = dot(d.light, h);
    if (eye_h <= 0 || (light_h > 0) != reflects) return {};  // no microfacet that faces both joins the two

    // Of a refracted pair, seen from the thinner side, where the Fresnel term is not steep: the same from both ends.
    const bool from_eye = reflects || eta >= 1;
    const Split split = split_light(lobe, from_eye ? eye_h : -light_h, from_eye ? eta : 1.0f / eta);
    const float alpha2 = square(lobe.alpha), density = ggx_d(alpha2, normal, h);
    const float root_eye = smith_root(alpha2, cos_eye), root_light = smith_root(alpha2, cos_light);
    const float visible_eye = visible_density(density, cos_eye, root_eye);
    const float visible_light = visible_density(density, cos_light, root_light);
    // D G2 / (cos_eye cos_light) * cos_light / |light.ng|
    const float shape =
        2.0f * density * cos_light / ((root_eye * cos_light + root_light * cos_eye) * std::fabs(d.light_g));
    LobeValue value;
    if (reflects) {
        value.f = split.reflect * (0.25f * shape);
        value.pdf_light = 0.25f * visible_eye * split.choose_reflect;
        value.pdf_eye = 0.25f * visible_light * split.choose_reflect;
    } else {
        // Jacobians of refraction (Walter et al. 2007, (17)), indices in units of the eye's.
        const float choose_refract = 1.0f - split.choose_reflect;
        const float over_denominator = -eye_h * light_h / square(eye_h + eta * light_h);
        value.f = split.refract * (over_denominator * shape);  // radiance: index of the eye's side squared over theirs
        value.pdf_light = choose_refract * visible_eye * over_denominator * eta * eta;
        value.pdf_eye = choose_refract * visible_light * over_denominator;
    }
    value.f *= lobe.weight;
    if (lobe.compensate) value.f *= compensation(glass_albedo(tables, lobe.alpha, eta, cos_eye), lobe.f82);
    return value;
}

}  // namespace vlp
