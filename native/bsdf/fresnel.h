// Fresnel terms: how much of the light a smooth interface reflects, by the cosine with its normal.
#pragma once

#include "core/rgb.h"

namespace vlp {

// Unpolarised dielectric; `eta` is the index behind the interface over the one in front, 1 on total internal reflection.
// The same for both directions of a refracted pair: fresnel_dielectric(cos_i, eta) = fresnel_dielectric(cos_t, 1 / eta).
VLP_HD inline float fresnel_dielectric(float cos_i, float eta) {
    const float scaled = eta * eta - 1.0f + cos_i * cos_i;  // (eta cos_t)^2
    if (scaled <= 0) return 1;
    const float eta_cos_t = std::sqrt(scaled);
    const float s = (cos_i - eta_cos_t) / (cos_i + eta_cos_t);
    const float eta2_cos_i = eta * eta * cos_i;
    const float p = (eta2_cos_i - eta_cos_t) / (eta2_cos_i + eta_cos_t);
    return 0.5f * (s * s + p * p);
}

VLP_HD constexpr float dielectric_f0(float eta) { return square((eta - 1.0f) / (eta + 1.0f)); }

// Dielectric whose reflectance at normal incidence is `tint` times the physical one, and still 1 at grazing angles.
VLP_HD inline Rgb fresnel_tinted_dielectric(float cos_i, float eta, Rgb tint) {
    const float f0 = dielectric_f0(eta);
    const float rise = clamp((fresnel_dielectric(cos_i, eta) - f0) / (1.0f - f0), 0.0f, 1.0f);
    return tint * (f0 * (1.0f - rise)) + rgb(rise);
}

VLP_HD constexpr float pow5(float x) { return square(square(x)) * x; }

// The factor of cos (1 - cos)^6 that multiplies Schlick's reflectance by `tint` at cos = 1/7 (Kutz et al. 2021, "Novel
// aspects of the Adobe Standard Material", 2.3).
VLP_HD inline Rgb schlick_edge(Rgb f0, Rgb tint) {
    constexpr float k_rise = pow5(6.0f / 7.0f);
    return (f0 + (rgb(1) - f0) * k_rise) * (rgb(1) - tint) * (7.0f / (k_rise * 6.0f / 7.0f));
}

VLP_HD inline Rgb fresnel_schlick(float cos_i, Rgb f0, Rgb tint) {
    const float s = clamp(1.0f - cos_i, 0.0f, 1.0f);
    const Rgb f = f0 + (rgb(1) - f0) * pow5(s) - schlick_edge(f0, tint) * (cos_i * pow5(s) * s);
    return {clamp(f.r, 0.0f, 1.0f), clamp(f.g, 0.0f, 1.0f), clamp(f.b, 0.0f, 1.0f)};
}

// One channel of a conductor of complex index eta + i k in vacuum (Born & Wolf, 14.4.1).
VLP_HD inline float fresnel_conductor(float cos_i, float eta, float k) {
    const float cos2 = cos_i * cos_i, sin2 = 1.0f - cos2;
    const float real = eta * eta - k * k - sin2;
    const float modulus = std::sqrt(real * real + 4.0f * square(eta * k));  // a^2 + b^2
    const float a = safe_sqrt(0.5f * (modulus + real));
    const float s = (modulus + cos2 - 2.0f * a * cos_i) / (modulus + cos2 + 2.0f * a * cos_i);
    const float p = s * (modulus * cos2 + sin2 * sin2 - 2.0f * a * cos_i * sin2) /
                    (modulus * cos2 + sin2 * sin2 + 2.0f * a * cos_i * sin2);
    return 0.5f * (s + p);
}

VLP_HD inline Rgb fresnel_conductor(float cos_i, Rgb eta, Rgb k) {
    return {fresnel_conductor(cos_i, eta.r, k.r), fresnel_conductor(cos_i, eta.g, k.g),
            fresnel_conductor(cos_i, eta.b, k.b)};
}

// Reflectance averaged over the cosine-weighted hemisphere, 2 * integral of F(c) c dc.
// Dielectric: the fit of Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks".
VLP_HD inline float average_fresnel_dielectric(float eta) {
    if (eta < 1) return 0.997118f + eta * (0.1014f - eta * (0.965241f + eta * 0.130607f));
    return (eta - 1.0f) / (4.08567f + 1.00071f * eta);
}

// Exact for the unclamped Schlick term with an edge factor.
VLP_HD inline Rgb average_fresnel_schlick(Rgb f0, Rgb edge) {
    return f0 + (rgb(1) - f0) * (1.0f / 21.0f) - edge * (1.0f / 126.0f);
}

}  // namespace vlp
