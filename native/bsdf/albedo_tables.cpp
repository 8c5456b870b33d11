// Directional albedos of GGX by quadrature over the visible microfacet normals.
#include "bsdf/albedo_tables.h"

#include "bsdf/albedo.h"
#include "bsdf/fresnel.h"
#include "bsdf/microfacet.h"

namespace vlp {
namespace {

constexpr uint32_t k_normals = 512;

// The value of a node; Cycles keeps off the ends, where the models degenerate.
float node(uint32_t i, uint32_t count, float last = 1.0f) {
    return clamp(static_cast<float>(i) / static_cast<float>(count - 1), 1e-4f, last);
}

float ior_at(uint32_t i) {
    const float root_f0 = square(node(i, k_coarse, 0.99f));
    return (1.0f + root_f0) / (1.0f - root_f0);
}

// The microfacets visible along a direction of cosine `cos`, as a lattice by the golden ratio, with what reflects.
struct VisibleNormals {
    float cos, root, alpha2;
    float cos_h[k_normals];      // with the direction
    float z_h[k_normals];        // with the surface's normal
    float reflected[k_normals];  // G2 / G1 of the reflection, 0 where it goes into the surface

    VisibleNormals(float roughness, float cosine) : cos(cosine) {
        const float alpha = square(roughness);
        alpha2 = square(alpha);
        root = smith_root(alpha2, cos);
        const Vec3 w{safe_sqrt(1.0f - cosine * cosine), 0, cosine};
        for (uint32_t i = 0; i < k_normals; ++i) {
            const Vec2 u{static_cast<float>(i * 0x9e3779b9u) * 0x1p-32f,
                         (static_cast<float>(i) + 0.5f) / static_cast<float>(k_normals)};
            const Vec3 h = sample_visible_normal(w, alpha, {min_of(u.x, 0x1.fffffep-1f), u.y});
            cos_h[i] = max_of(dot(w, h), 0.0f);
            z_h[i] = h.z;
            reflected[i] = shadowing(2.0f * cos_h[i] * h.z - cosine);
        }
    }

    // G2 / G1 for an outgoing direction of cosine `cos_out`.
    float shadowing(float cos_out) const {
        return cos_out <= 0 ? 0 : cos_out * (cos + root) / (root * cos_out + smith_root(alpha2, cos_out) * cos);
    }

    float reflection() const {
        float sum = 0;
        for (float value : reflected) sum += value;
        return sum / k_normals;
    }

    // What refraction sends to the wrong side of the surface is counted too, as in Cycles' tables: only near grazing
    // angles inside the denser medium does it matter, and there compensation would overshoot without it.
    float glass(float eta) const {
        if (std::fabs(eta - 1.0f) < 1e-4f) return 1;  // goes straight
        float sum = 0;
        for (uint32_t i = 0; i < k_normals; ++i) {
            const float f = fresnel_dielectric(cos_h[i], eta);
            sum += f * reflected[i];
            if (f == 1) continue;
            const float eta_cos_t = safe_sqrt(eta * eta - 1.0f + cos_h[i] * cos_h[i]);
            sum += (1.0f - f) * shadowing(std::fabs(cos - z_h[i] * (cos_h[i] - eta_cos_t)) / eta);
        }
        return sum / k_normals;
    }

    float rise(float eta) const {
        const float f0 = dielectric_f0(eta);
        float sum = 0;
        for (uint32_t i = 0; i < k_normals; ++i) {
            if (reflected[i] > 0) sum += clamp((fresnel_dielectric(cos_h[i], eta) - f0) / (1.0f - f0), 0.0f, 1.0f);
        }
        return sum / k_normals;
    }
};

// 2 * integral of E(c) c dc for E linear between its nodes.
float hemisphere_average(const float* albedo, uint32_t count) {
    const float step = 1.0f / static_cast<float>(count - 1);
    float sum = 0;
    for (uint32_t i = 0; i + 1 < count; ++i) {
        const float c = static_cast<float>(i) * step;
        sum += step * (albedo[i] * (c + step / 3) + albedo[i + 1] * (c + 2 * step / 3));
    }
    return sum;
}

std::vector<float> compute() {
    std::vector<float> tables(k_albedo_table_size);
    float* const ggx = tables.data() + k_ggx_albedo;
    for (uint32_t r = 0; r < k_fine; ++r) {
        for (uint32_t c = 0; c < k_fine; ++c) {
            ggx[r * k_fine + c] = min_of(VisibleNormals(node(r, k_fine), node(c, k_fine)).reflection(), 1.0f);
        }
        tables[k_ggx_average + r] = hemisphere_average(ggx + r * k_fine, k_fine);
    }
    constexpr uint32_t k_slice = k_coarse * k_coarse, k_cube = k_slice * k_coarse;
    float* const glass = tables.data() + k_glass_albedo;
    float* const rise = tables.data() + k_dielectric_rise;
    for (uint32_t r = 0; r < k_coarse; ++r) {
        for (uint32_t c = 0; c < k_coarse; ++c) {
            const VisibleNormals normals(node(r, k_coarse), node(c, k_coarse));
            for (uint32_t z = 0; z < k_coarse; ++z) {
                const uint32_t i = z * k_slice + r * k_coarse + c;
                glass[i] = min_of(normals.glass(ior_at(z)), 1.0f);
                glass[k_cube + i] = min_of(normals.glass(1.0f / ior_at(z)), 1.0f);
                rise[i] = normals.rise(ior_at(z));
            }
        }
    }
    for (uint32_t row = 0; row < 2 * k_slice; ++row) {
        tables[k_glass_average + row] = hemisphere_average(glass + row * k_coarse, k_coarse);
    }
    return tables;
}

}  // namespace

const std::vector<float>& albedo_tables() {
    static const std::vector<float> tables = compute();
    return tables;
}

}  // namespace vlp
