// Materials: which lobes there are, how often each is sampled, and how much passes straight through.
#include "scene/material_build.h"

#include <stdexcept>
#include <string>

#include "bsdf/albedo_tables.h"
#include "bsdf/reflection.h"

namespace vlp {
namespace {

// Refraction by an index this close to 1 bends nothing that single precision could resolve, as in Cycles.
constexpr float k_min_index_step = 1e-4f;

// What a dielectric reflects is at least this much for the choice among lobes: all of it at grazing angles.
constexpr float k_least_reflectance = 0.1f;

[[noreturn]] void fail(size_t index, const std::string& what) {
    throw std::invalid_argument("lobe " + std::to_string(index) + ": " + what);
}

bool is_color(Rgb c) { return is_finite(c) && c.r >= 0 && c.g >= 0 && c.b >= 0; }

void check(std::span<const LobeInput> input, size_t i) {
    const LobeInput& lobe = input[i];
    if (lobe.kind > LobeKind::transparent) fail(i, "unknown kind " + std::to_string(static_cast<int>(lobe.kind)));
    if (lobe.fresnel > Fresnel::tinted_dielectric) {
        fail(i, "unknown Fresnel term " + std::to_string(static_cast<int>(lobe.fresnel)));
    }
    if (!is_color(lobe.weight)) fail(i, "weight must be finite and not negative");
    if (!is_color(lobe.f0) || !is_color(lobe.f82)) fail(i, "f0 and f82 must be finite and not negative");
    if (!(lobe.roughness >= 0 && lobe.roughness <= 1)) {
        fail(i, "roughness " + std::to_string(lobe.roughness) + " is not in [0, 1]");
    }
    if (!(lobe.ior > 0) || !is_finite(lobe.ior)) fail(i, "ior " + std::to_string(lobe.ior) + " is not positive");
    size_t steps = 0;
    for (int above = lobe.layered_under; above != -1; above = input[static_cast<size_t>(above)].layered_under) {
        if (above < 0 || static_cast<size_t>(above) >= input.size()) {
            fail(i, "layered under lobe " + std::to_string(above) + ", which is not there");
        }
        if (input[static_cast<size_t>(above)].kind != LobeKind::reflection) {
            fail(i, "layered under lobe " + std::to_string(above) + ", which is not a reflection");
        }
        if (++steps > input.size()) fail(i, "layered under itself");
    }
}

bool goes_straight(const LobeInput& lobe) {
    return lobe.kind == LobeKind::transparent ||
           ((lobe.kind == LobeKind::dielectric || lobe.kind == LobeKind::refraction) &&
            std::fabs(lobe.ior - 1.0f) < k_min_index_step);
}

Lobe to_native(const LobeInput& input) {
    Lobe lobe;
    lobe.kind = input.kind;
    lobe.fresnel = input.fresnel;
    lobe.layered_under = static_cast<int8_t>(input.layered_under);
    lobe.compensate = input.compensate;
    lobe.alpha = square(input.roughness) < k_min_alpha ? 0.0f : square(input.roughness);
    lobe.eta = input.ior;
    lobe.weight = input.weight;
    lobe.f0 = input.f0;
    lobe.f82 = input.f82;
    return lobe;
}

// About what a lobe scatters of the light from everywhere; `selection` and transparency need no more.
Rgb mean_albedo(const std::vector<Lobe>& lobes, const Lobe& lobe) {
    constexpr float k_mean_cosine = 2.0f / 3.0f;
    Rgb albedo = lobe.weight;
    for (int above = lobe.layered_under; above >= 0; above = lobes[static_cast<size_t>(above)].layered_under) {
        const Rgb layer = layer_albedo(lobes[static_cast<size_t>(above)], albedo_tables().data(), k_mean_cosine);
        albedo *= max_of(1.0f - max_component(layer), 0.0f);
    }
    switch (lobe.kind) {
        case LobeKind::reflection: {
            const Rgb mean = average_reflectance(lobe);
            return albedo * max_of(average(mean), lobe.fresnel == Fresnel::none ? 0.0f : k_least_reflectance);
        }
        case LobeKind::dielectric:
        case LobeKind::refraction:
            return albedo * lobe.f82;
        default:
            return albedo;
    }
}

}  // namespace

Material build_material(std::span<const LobeInput> input, Rgb emission, std::vector<Lobe>& lobes) {
    if (!is_color(emission)) throw std::invalid_argument("emission must be finite and not negative");
    if (input.size() > 127) throw std::invalid_argument("more than 127 lobes");
    for (size_t i = 0; i < input.size(); ++i) check(input, i);
    std::vector<Lobe> all;
    std::vector<bool> kept(input.size());
    for (size_t i = 0; i < input.size(); ++i) {
        all.push_back(to_native(input[i]));
        kept[i] = !goes_straight(input[i]) && !is_black(input[i].weight);
    }
    for (const LobeInput& lobe : input) {
        if (lobe.layered_under >= 0) kept[static_cast<size_t>(lobe.layered_under)] = true;  // even a black one
    }

    Material material;
    material.first_lobe = static_cast<uint32_t>(lobes.size());
    material.emission = emission;
    std::vector<int8_t> place(input.size(), -1);
    float total = 0;
    for (size_t i = 0; i < input.size(); ++i) {
        const Rgb albedo = mean_albedo(all, all[i]);
        if (goes_straight(input[i])) material.transparency += albedo;
        if (!kept[i]) continue;
        place[i] = static_cast<int8_t>(material.lobe_count++);
        total += all[i].selection = average(albedo);
    }
    for (size_t i = 0; i < input.size(); ++i) {
        if (!kept[i]) continue;
        Lobe lobe = all[i];
        lobe.selection = total > 0 ? lobe.selection / total : 0.0f;
        if (lobe.layered_under >= 0) lobe.layered_under = place[static_cast<size_t>(lobe.layered_under)];
        (is_specular(lobe) ? material.has_specular : material.has_finite) = true;
        if (!is_specular(lobe)) {
            material.transmits |= lobe.kind != LobeKind::diffuse && lobe.kind != LobeKind::reflection;
            material.albedo += mean_albedo(all, all[i]);
        }
        lobes.push_back(lobe);
    }
    constexpr float k_least_albedo = 1e-2f;  // what is 0 on average may not be in all directions
    for (float* c : {&material.albedo.r, &material.albedo.g, &material.albedo.b}) *c = std::max(*c, k_least_albedo);
    const float straight = average(material.transparency);
    material.pass_through = straight > 0 ? straight / (straight + total) : 0.0f;
    return material;
}

}  // namespace vlp
