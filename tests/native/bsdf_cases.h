// Surfaces and materials that the tests of BSDFs share.
#pragma once

#include <string>
#include <vector>

#include "bsdf/albedo_tables.h"
#include "bsdf/bsdf.h"
#include "scene/material_build.h"

namespace vlp::test {

struct BsdfCase {
    std::string name;
    std::vector<LobeInput> input;
    bool reciprocal = true;     // not layered, no compensation
};

inline LobeInput lobe_input(LobeKind kind, Fresnel fresnel = Fresnel::none, float roughness = 0, float ior = 1.5f) {
    LobeInput lobe;
    lobe.kind = kind;
    lobe.fresnel = fresnel;
    lobe.roughness = roughness;
    lobe.ior = ior;
    return lobe;
}

inline LobeInput compensated(LobeInput lobe) {
    lobe.compensate = true;
    return lobe;
}

// Plastic as Principled builds it: a dielectric layer over a diffuse base.
inline std::vector<LobeInput> plastic(float roughness, float ior) {
    LobeInput layer = compensated(lobe_input(LobeKind::reflection, Fresnel::dielectric, roughness, ior));
    LobeInput base = lobe_input(LobeKind::diffuse);
    base.weight = {0.8f, 0.5f, 0.2f};
    base.layered_under = 0;
    return {layer, base};
}

inline LobeInput gold(float roughness) {
    LobeInput lobe = lobe_input(LobeKind::reflection, Fresnel::conductor, roughness);
    lobe.f0 = {0.15f, 0.38f, 1.42f};
    lobe.f82 = {3.6f, 2.6f, 2.0f};
    return lobe;
}

inline LobeInput painted_metal(float roughness) {
    LobeInput lobe = lobe_input(LobeKind::reflection, Fresnel::schlick, roughness);
    lobe.f0 = {0.9f, 0.6f, 0.3f};
    lobe.f82 = {0.7f, 1.0f, 0.4f};
    return lobe;
}

inline LobeInput tinted_glass(float roughness, float ior) {
    LobeInput lobe = lobe_input(LobeKind::dielectric, Fresnel::tinted_dielectric, roughness, ior);
    lobe.f0 = {0.5f, 1.0f, 2.0f};
    lobe.f82 = {0.9f, 0.6f, 0.3f};
    return lobe;
}

inline std::vector<BsdfCase> finite_cases() {
    using enum LobeKind;
    std::vector<BsdfCase> cases = {
        {"diffuse", {lobe_input(diffuse)}},
        {"translucent", {lobe_input(translucent)}},
        {"diffuse and translucent", {lobe_input(diffuse), lobe_input(translucent)}},
        {"conductor", {gold(0.4f)}},
        {"schlick", {painted_metal(0.6f)}},
        {"tinted glass", {tinted_glass(0.5f, 1.45f)}},
        {"glass multi", {compensated(lobe_input(dielectric, Fresnel::dielectric, 0.7f, 1.5f))}, false},
        {"glossy multi", {compensated(lobe_input(reflection, Fresnel::none, 0.9f))}, false},
        {"plastic", plastic(0.4f, 1.5f), false},
        {"polished plastic", plastic(0.0f, 1.5f), false},
        {"glass, diffuse and gold", {tinted_glass(0.3f, 1.6f), lobe_input(diffuse), gold(0.2f)}},
    };
    for (float roughness : {0.1f, 0.3f, 0.6f, 1.0f}) {
        const std::string end = std::to_string(roughness).substr(0, 3);
        cases.push_back({"glossy " + end, {lobe_input(reflection, Fresnel::none, roughness)}});
        cases.push_back({"glass " + end, {lobe_input(dielectric, Fresnel::dielectric, roughness, 1.5f)}});
        cases.push_back({"refraction " + end, {lobe_input(refraction, Fresnel::none, roughness, 1.33f)}});
    }
    cases.push_back({"bubble", {lobe_input(dielectric, Fresnel::dielectric, 0.4f, 1 / 1.5f)}});
    cases.push_back({"diamond", {lobe_input(dielectric, Fresnel::dielectric, 0.5f, 2.4f)}});
    return cases;
}

// A built material with the storage that its Bsdf points into.
struct BuiltCase {
    std::vector<Lobe> lobes;
    Material material;

    explicit BuiltCase(const std::vector<LobeInput>& input) { material = build_material(input, {}, lobes); }

    Bsdf bsdf(Vec3 geometric_normal, Vec3 shading_normal) const {
        return {lobes.data(), albedo_tables().data(), material.lobe_count, shading_normal, geometric_normal};
    }
};

// A direction at `cosine` with the axis of `frame`, below it where the cosine is negative.
inline Vec3 direction_at(const Frame& frame, float cosine, float azimuth) {
    const float sine = std::sqrt(1 - cosine * cosine);
    return normalize(frame.to_world({sine * std::cos(azimuth), sine * std::sin(azimuth), cosine}));
}

struct View {
    Vec3 geometric_normal, shading_normal, from;
    std::string name;
};

// Views from above and below, straight and grazing, with shading normals of growing tilt.
inline std::vector<View> views() {
    std::vector<View> result;
    const Frame frame = make_frame(normalize(Vec3{0.3f, -0.5f, 0.8f}));
    for (float tilt : {0.0f, 0.35f, 0.9f}) {
        const Vec3 shading = direction_at(frame, std::cos(tilt), 0.7f);
        for (float cosine : {0.95f, 0.3f, 0.01f, -0.02f, -0.6f}) {
            for (float azimuth : {0.7f, 3.0f}) {
                if (tilt == 0 && azimuth > 1) continue;
                result.push_back(
                    {frame.normal, tilt == 0 ? frame.normal : shading, direction_at(frame, cosine, azimuth),
                     "tilt " + std::to_string(tilt).substr(0, 4) + ", cosine " + std::to_string(cosine).substr(0, 5) +
                         ", azimuth " + std::to_string(azimuth).substr(0, 3)});
            }
        }
    }
    return result;
}

}  // namespace vlp::test
