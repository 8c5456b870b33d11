// Directional albedos of every kind of material against those measured in Cycles (measure_cycles_albedos.py).
#include <gtest/gtest.h>

#include <cstdio>
#include <map>

#include "bsdf_cases.h"
#include "bsdf_cycles_albedos.h"
#include "core/sampler.h"

namespace vlp {
namespace {

using namespace test;

struct Sides {
    Rgb near_side, far_side;
};

// By low-discrepancy samples of the BSDF. Cycles does not scale radiance by the square of the index, so refraction's factor
// is taken out again.
Sides directional_albedo(const BuiltCase& built, float cosine) {
    constexpr uint32_t k_draws = 1u << 15;
    const Vec3 normal{0, 0, 1};
    const Bsdf bsdf = built.bsdf(normal, normal);
    const Vec3 eye = direction_at(make_frame(normal), cosine, 0.4f);
    double sum[2][3] = {};
    for (uint32_t i = 0; i < k_draws; ++i) {
        Sampler sampler = make_sampler(17, i);
        const float u_lobe = sampler.next();
        const BsdfSample s = sample(bsdf, eye, Walk::eye, u_lobe, sampler.next_2d());
        if (!s.valid()) continue;
        const bool far_side = s.direction.z * cosine < 0;
        float scale = 1;
        for (const Lobe& lobe : built.lobes) {
            if (far_side && (lobe.kind == LobeKind::dielectric || lobe.kind == LobeKind::refraction)) {
                scale = square(cosine < 0 ? 1 / lobe.eta : lobe.eta);
            }
        }
        sum[far_side][0] += s.weight.r * scale;
        sum[far_side][1] += s.weight.g * scale;
        sum[far_side][2] += s.weight.b * scale;
    }
    const auto mean = [&](int side) {
        return Rgb{static_cast<float>(sum[side][0] / k_draws), static_cast<float>(sum[side][1] / k_draws),
                   static_cast<float>(sum[side][2] / k_draws)};
    };
    // A lobe that lets the light pass straight through adds to the far side.
    return {mean(0), mean(1) + built.material.transparency};
}

// Within 1 % of the light that the surface leaves, and both measurements' noise (0.1 %).
TEST(BsdfCycles, AlbedosMatch) {
    double worst = 0;
    std::map<std::string, double> of_kind;
    for (const CyclesCase& c : k_cycles_cases) {
        const BuiltCase built(c.lobes);
        for (const CyclesView& view : c.views) {
            const Sides ours = directional_albedo(built, view.cosine);
            const Rgb total = view.near_side + view.far_side;
            const auto check = [&](const char* side, float a, float b, float scale) {
                const double error = std::fabs(a - b) / max_of(scale, 0.02f);
                EXPECT_LT(error, 0.01) << c.name << ", cosine " << view.cosine << ", " << side << ": " << a
                                       << ", Cycles " << b << ", measured with " << k_measured_with;
                double& of = of_kind[c.name.substr(0, c.name.find_first_of("0123456789") - 1)];
                of = max_of(of, error);
                worst = max_of(worst, error);
            };
            check("near, red", ours.near_side.r, view.near_side.r, total.r);
            check("near, green", ours.near_side.g, view.near_side.g, total.g);
            check("near, blue", ours.near_side.b, view.near_side.b, total.b);
            check("far, red", ours.far_side.r, view.far_side.r, total.r);
            check("far, green", ours.far_side.g, view.far_side.g, total.g);
            check("far, blue", ours.far_side.b, view.far_side.b, total.b);
        }
    }
    for (const auto& [kind, error] : of_kind) std::printf("  %-50s %.2f %%\n", kind.c_str(), 100 * error);
}

}  // namespace
}  // namespace vlp
