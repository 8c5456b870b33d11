// GGX reflection with a Fresnel term: glossy surfaces, metals and the gloss of plastics.
#pragma once

#include "bsdf/albedo.h"
#include "bsdf/fresnel.h"
#include "bsdf/lobe_value.h"
#include "bsdf/microfacet.h"
#include "scene/material.h"

namespace vlp {

VLP_HD inline Rgb reflectance(const Lobe& lobe, float cos_i) {
    switch (lobe.fresnel) {
        case Fresnel::none:
            return lobe.f0;
        case Fresnel::dielectric:
            return lobe.f0 * fresnel_dielectric(cos_i, lobe.eta);
        case Fresnel::schlick:
            return fresnel_schlick(cos_i, lobe.f0, lobe.f82);
        case Fresnel::conductor:
            return fresnel_conductor(cos_i, lobe.f0, lobe.f82);
        default:
            return fresnel_tinted_dielectric(cos_i, lobe.eta, lobe.f0);
    }
}

// The reflectance of one bounce between microfacets, averaged over the hemisphere.
VLP_HD inline Rgb average_reflectance(const Lobe& lobe) {
    const Rgb f0 = lobe.f0;
    switch (lobe.fresnel) {
        case Fresnel::none:
            return f0;
        case Fresnel::dielectric:
            return f0 * average_fresnel_dielectric(lobe.eta);
        case Fresnel::schlick:
            return average_fresnel_schlick(f0, schlick_edge(f0, lobe.f82));
        case Fresnel::conductor: {
            // Schlick's term with an edge factor, through the exact reflectances at 0 and near 82 degrees.
            const Rgb normal = fresnel_conductor(1, f0, lobe.f82), edge = fresnel_conductor(1.0f / 7, f0, lobe.f82);
            constexpr float k_rise = pow5(6.0f / 7.0f);
            const Rgb factor = (normal + (rgb(1) - normal) * k_rise - edge) * (7.0f / (k_rise * 6.0f / 7.0f));
            const Rgb mean = average_fresnel_schlick(normal, factor);
            return {clamp(mean.r, 0.0f, 1.0f), clamp(mean.g, 0.0f, 1.0f), clamp(mean.b, 0.0f, 1.0f)};
        }
        default: {
            const float real_f0 = dielectric_f0(lobe.eta), mean = average_fresnel_dielectric(lobe.eta);
            const float rise = clamp((mean - real_f0) / (1.0f - real_f0), 0.0f, 1.0f);
            return f0 * (real_f0 * (1.0f - rise)) + rgb(rise);
        }
    }
}

VLP_HD inline Rgb reflection_compensation(const Lobe& lobe, const float* tables, float cos_eye) {
    return compensation(ggx_albedo(tables, lobe.alpha, cos_eye), average_reflectance(lobe));
}

// The share of the light that a layer reflects towards an eye at this cosine, its weight left out; what lies below gets
// the rest. Shadowing between microfacets counts as reflection, as in Cycles.
VLP_HD inline Rgb layer_albedo(const Lobe& lobe, const float* tables, float cos_eye) {
    Rgb albedo;
    if (lobe.fresnel == Fresnel::dielectric || lobe.fresnel == Fresnel::tinted_dielectric) {
        const float f0 = dielectric_f0(lobe.eta), rise = dielectric_rise(tables, lobe.alpha, lobe.eta, cos_eye);
        albedo = lobe.fresnel == Fresnel::dielectric ? lobe.f0 * lerp(f0, 1, rise)
                                                     : lobe.f0 * (f0 * (1.0f - rise)) + rgb(rise);
    } else {
        albedo = reflectance(lobe, cos_eye);
    }
    if (!lobe.compensate) return albedo;
    // That is the albedo of all bounces but for the tint which the second and later ones add.
    const Albedo e = ggx_albedo(tables, lobe.alpha, cos_eye);
    return albedo * compensation(e, average_reflectance(lobe)) * e.directional;
}

VLP_HD inline LobeValue evaluate_reflection(const Lobe& lobe, const float* tables, const DirectionPair& d) {
    if (!d.reflects() || !d.frames_agree()) return {};
    const Vec3 normal = d.eye_s < 0 ? -d.normal : d.normal;
    const float cos_eye = std::fabs(d.eye_s), cos_light = std::fabs(d.light_s);
    Vec3 h = d.eye + d.light;
    if (length_squared(h) < k_min_half_squared) return {};
    h = normalize(h);
    const float alpha2 = square(lobe.alpha), density = ggx_d(alpha2, normal, h);
    const float root_eye = smith_root(alpha2, cos_eye), root_light = smith_root(alpha2, cos_light);

    // F D G2 / (4 cos_eye cos_light) * cos_light / |light.ng|
    const float shape =
        0.5f * density * cos_light / ((root_eye * cos_light + root_light * cos_eye) * std::fabs(d.light_g));
    LobeValue value;
    value.f = lobe.weight * reflectance(lobe, dot(d.eye, h)) * shape;
    if (lobe.compensate) value.f *= reflection_compensation(lobe, tables, cos_eye);
    value.pdf_light = 0.25f * visible_density(density, cos_eye, root_eye);
    value.pdf_eye = 0.25f * visible_density(density, cos_light, root_light);
    return value;
}

}  // namespace vlp
