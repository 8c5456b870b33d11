// The BSDF at a surface point: value, densities and samples of all lobes of its material together.
//
// Directions carry roles, not "in" and "out": one points towards the eye's side of the path, the other towards the
// light's. The value holds the factor |light.ns| / |light.ng|, so that with geometric cosines everywhere the integrand of
// a path is one function for every strategy, and the adjoint factor of Veach 1997, 5.3 appears in light walks by itself.
// Roles also give layered materials, which are not reciprocal, one meaning for both walks: the base is dimmed by
// what the layer above it reflects towards the eye, as in Cycles.
#pragma once

#include "bsdf/dielectric.h"
#include "bsdf/diffuse.h"
#include "bsdf/reflection.h"
#include "core/frame.h"
#include "geometry/surface.h"
#include "scene/scene_view.h"

namespace vlp {

// Which end of the path is being extended.
enum class Walk : uint8_t { eye, light };

struct Bsdf {
    const Lobe* lobes = nullptr;
    const float* tables = nullptr;  // see bsdf/albedo.h
    uint32_t count = 0;
    Vec3 normal, geometric_normal;

    VLP_HD bool is_diffuse() const { return count == 1 && lobes[0].kind == LobeKind::diffuse; }
};

VLP_HD inline Bsdf make_bsdf(const SceneView& scene, const SurfacePoint& point) {
    const Material& material = scene.materials[point.material];
    return {scene.lobes + material.first_lobe, scene.albedo_tables, material.lobe_count, point.shading_normal,
            point.geometric_normal};
}

VLP_HD inline DirectionPair make_pair(const Bsdf& bsdf, Vec3 eye, Vec3 light) {
    return {eye,
            light,
            bsdf.normal,
            dot(eye, bsdf.normal),
            dot(light, bsdf.normal),
            dot(eye, bsdf.geometric_normal),
            dot(light, bsdf.geometric_normal)};
}

// What the layers above a lobe let through, by the cosine of the eye with the shading normal.
VLP_HD inline float passed_by_layers(const Bsdf& bsdf, const Lobe& lobe, float cos_eye) {
    float share = 1;
    for (int above = lobe.layered_under; above >= 0; above = bsdf.lobes[above].layered_under) {
        share *= max_of(1.0f - max_component(layer_albedo(bsdf.lobes[above], bsdf.tables, cos_eye)), 0.0f);
    }
    return share;
}

// One finite lobe. Zero for specular ones.
VLP_HD inline LobeValue evaluate(const Bsdf& bsdf, const Lobe& lobe, const DirectionPair& d) {
    switch (lobe.kind) {
        case LobeKind::diffuse:
            return d.reflects() ? evaluate_diffuse(lobe.weight, d) : LobeValue{};
        case LobeKind::translucent:
            return d.reflects() ? LobeValue{} : evaluate_diffuse(lobe.weight, d);
        case LobeKind::reflection:
            return is_specular(lobe) ? LobeValue{} : evaluate_reflection(lobe, bsdf.tables, d);
        case LobeKind::dielectric:
        case LobeKind::refraction:
            return is_specular(lobe) ? LobeValue{} : evaluate_dielectric(lobe, bsdf.tables, d);
        default:
            return {};
    }
}

VLP_HD inline LobeValue evaluate_lobes(const Bsdf& bsdf, const DirectionPair& d) {
    LobeValue sum;
    for (uint32_t i = 0; i < bsdf.count; ++i) {
        const Lobe& lobe = bsdf.lobes[i];
        const LobeValue value = evaluate(bsdf, lobe, d);
        sum.pdf_light += lobe.selection * value.pdf_light;
        sum.pdf_eye += lobe.selection * value.pdf_eye;
        if (is_black(value.f)) continue;
        sum.f += lobe.layered_under < 0 ? value.f : value.f * passed_by_layers(bsdf, lobe, std::fabs(d.eye_s));
    }
    return sum;
}

// All finite lobes: the sum of their values and their densities, each by the probability of its lobe. The densities
// are those of a walk along `eye` choosing `light` (pdf_light), and of a walk along `light` choosing `eye` (pdf_eye).
// A single diffuse lobe, the common case, is inlined where this is called.
VLP_HD VLP_FORCE_INLINE LobeValue evaluate(const Bsdf& bsdf, Vec3 eye, Vec3 light) {
    const DirectionPair d = make_pair(bsdf, eye, light);
    if (d.on_surface()) return {};
    if (bsdf.is_diffuse()) return d.reflects() ? evaluate_diffuse(bsdf.lobes[0].weight, d) : LobeValue{};
    return evaluate_lobes(bsdf, d);
}

// f_s(w_light -> w_eye) |w_light.ns| / |w_light.ng|; for refraction f_s is the radiance BSDF (Veach 1997, 5.2).
VLP_HD inline Rgb eval(const Bsdf& bsdf, Vec3 w_eye, Vec3 w_light) { return evaluate(bsdf, w_eye, w_light).f; }

// Density per solid angle of `sample` choosing `w_to` when the walk arrives along `w_from`, finite lobes only.
VLP_HD inline float pdf(const Bsdf& bsdf, Vec3 w_from, Vec3 w_to) { return evaluate(bsdf, w_from, w_to).pdf_light; }

// weight: eval |direction.ng| / pdf, of all finite lobes together, or of the specular lobe alone.
// Of a specular lobe the densities are probability masses; the reverse one is multiplied by d(direction) / d(w_from).
struct BsdfSample {
    Vec3 direction;
    Rgb weight;
    float pdf_solid_angle = 0, pdf_rev_solid_angle = 0;
    bool specular = false;

    VLP_HD bool valid() const { return pdf_solid_angle > 0 && !is_black(weight); }
};

VLP_HD inline BsdfSample finite_sample(const Bsdf& bsdf, Vec3 w_from, Vec3 direction, Walk walk) {
    const bool eye_walk = walk == Walk::eye;
    const LobeValue value = evaluate(bsdf, eye_walk ? w_from : direction, eye_walk ? direction : w_from);
    const float forward = eye_walk ? value.pdf_light : value.pdf_eye, back = eye_walk ? value.pdf_eye : value.pdf_light;
    if (!(forward > 0)) return {};
    return {direction, value.f * (abs_dot(direction, bsdf.geometric_normal) / forward), forward, back, false};
}

// A single diffuse lobe, the common case: its weight in an eye walk is the albedo or 0.
VLP_HD inline BsdfSample sample_diffuse(const Bsdf& bsdf, Vec3 w_from, Walk walk, Vec2 u) {
    const float from_g = dot(w_from, bsdf.geometric_normal);
    if (std::fabs(from_g) < k_min_cosine) return {};
    const Vec3 w = sample_cosine(bsdf.normal, bsdf.geometric_normal, from_g, u);
    const float to_s = dot(w, bsdf.normal), to_g = dot(w, bsdf.geometric_normal), from_s = dot(w_from, bsdf.normal);
    if (to_s == 0 || std::fabs(to_g) < k_min_cosine) return {};
    const Rgb albedo = bsdf.lobes[0].weight;
    Rgb weight;
    if (walk == Walk::eye) {
        if (to_s * to_g > 0) weight = albedo;
    } else if (from_s * from_g > 0) {
        weight = albedo * std::fabs(from_s * to_g / (from_g * to_s));
    }
    return {w, weight, k_inv_pi * std::fabs(to_s), k_inv_pi * std::fabs(from_s), false};
}

// A direction chosen by a microfacet, or by the surface itself where the lobe is specular.
struct MicrofacetSample {
    Vec3 direction;
    Rgb share;  // of the light that takes this way, the lobe's weight left out (specular lobes only)
    float mass = 0;  // probability of this way, 0: no direction
    float eta = 1;  // index on the side of `direction` over the one on the side of `w_from`
};

VLP_HD inline MicrofacetSample sample_microfacet(const Bsdf& bsdf, const Lobe& lobe, Vec3 w_from, float u_way, Vec2 u) {
    const float from_g = dot(w_from, bsdf.geometric_normal), from_s = dot(w_from, bsdf.normal);
    if (from_s * from_g <= 0 || std::fabs(from_s) < k_min_cosine) return {};
    Vec3 h = from_s < 0 ? -bsdf.normal : bsdf.normal;
    if (!is_specular(lobe)) {
        const Frame frame = make_frame(h);
        h = frame.to_world(sample_visible_normal(frame.to_local(w_from), lobe.alpha, u));
    }
    const float cos_h = dot(w_from, h);
    if (cos_h <= 0) return {};

    MicrofacetSample way{{}, {}, 1, 1};
    bool reflects = true;
    if (lobe.kind == LobeKind::reflection) {
        way.share = is_specular(lobe) ? reflectance(lobe, cos_h) : rgb(1);
    } else {
        const float eta = from_s < 0 ? 1.0f / lobe.eta : lobe.eta;
        const Split split = split_light(lobe, cos_h, eta);
        reflects = u_way < split.choose_reflect;
        way.share = reflects ? split.reflect : split.refract;
        way.mass = reflects ? split.choose_reflect : 1.0f - split.choose_reflect;
        if (!reflects) way.eta = eta;
    }
    if (is_black(way.share)) return {};
    way.direction = reflects ? reflect(w_from, h) : normalize(refract(w_from, h, way.eta));
    const float to_g = dot(way.direction, bsdf.geometric_normal), to_s = dot(way.direction, bsdf.normal);
    if ((to_g * from_g > 0) != reflects || (to_s * from_s > 0) != reflects) return {};
    return way;
}

// A specular lobe is a delta distribution in the direction of the light over |light.ns|. Its weight in a light walk
// follows from d(light) = eta_eye^2 |eye.ns| / (eta_light^2 |light.ns|) d(eye).
VLP_HD inline BsdfSample specular_sample(const Bsdf& bsdf, const Lobe& lobe, Vec3 w_from, Walk walk,
                                         const MicrofacetSample& way) {
    const float from_s = abs_dot(w_from, bsdf.normal), to_s = abs_dot(way.direction, bsdf.normal);
    const float from_g = abs_dot(w_from, bsdf.geometric_normal), to_g = abs_dot(way.direction, bsdf.geometric_normal);
    const float cos_eye = walk == Walk::eye ? from_s : to_s;
    const float measure = walk == Walk::eye ? 1.0f / square(way.eta) : from_s * to_g / (to_s * from_g);
    const float mass = lobe.selection * way.mass;
    const Rgb weight = lobe.weight * way.share * (passed_by_layers(bsdf, lobe, cos_eye) * measure / mass);
    const float d_to_over_d_from = way.eta == 1 ? 1.0f : from_s / (square(way.eta) * to_s);
    return {way.direction, weight, mass, mass * d_to_over_d_from, true};
}

// The next direction of a walk that arrived along `w_from`. `u_lobe` chooses among the lobes, then between reflection
// and refraction.
VLP_HD inline BsdfSample sample(const Bsdf& bsdf, Vec3 w_from, Walk walk, float u_lobe, Vec2 u) {
    if (bsdf.is_diffuse()) return sample_diffuse(bsdf, w_from, walk, u);
    uint32_t chosen = 0;
    while (chosen + 1 < bsdf.count && u_lobe >= bsdf.lobes[chosen].selection) u_lobe -= bsdf.lobes[chosen++].selection;
    if (bsdf.count == 0 || bsdf.lobes[chosen].selection <= 0) return {};
    const Lobe& lobe = bsdf.lobes[chosen];
    if (lobe.kind == LobeKind::diffuse || lobe.kind == LobeKind::translucent) {
        const float from_g = dot(w_from, bsdf.geometric_normal);
        const float toward = lobe.kind == LobeKind::diffuse ? from_g : -from_g;
        const Vec3 w = sample_cosine(bsdf.normal, bsdf.geometric_normal, toward, u);
        return finite_sample(bsdf, w_from, w, walk);
    }
    const MicrofacetSample way = sample_microfacet(bsdf, lobe, w_from, u_lobe / lobe.selection, u);
    if (way.mass <= 0) return {};
    return is_specular(lobe) ? specular_sample(bsdf, lobe, w_from, walk, way)
                             : finite_sample(bsdf, w_from, way.direction, walk);
}

}  // namespace vlp
