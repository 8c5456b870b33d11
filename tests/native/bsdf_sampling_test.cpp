// BSDF samples follow the densities that they claim, and their weights follow from value and density.
#include <gtest/gtest.h>

#include "bsdf_cases.h"
#include "chi_squared.h"

namespace vlp {
namespace {

using namespace testing;

constexpr double k_false_alarm = 1e-3;  // that any of a test's comparisons fails by chance
constexpr int k_draws = 40000;

// The bins for one side of the surface: around the mirrored or refracted direction where a lobe is narrow.
SphereBins bins_for(const BuiltCase& built, const View& view, bool reflects) {
    float alpha = 1, eta = 1.5f;
    for (const Lobe& lobe : built.lobes) {
        if (lobe.alpha > 0 && lobe.alpha < alpha) alpha = lobe.alpha, eta = lobe.eta;
    }
    if (alpha > 0.02f) return {};
    const Vec3 n = face_toward(view.shading_normal, view.from);
    const float relative = dot(view.from, view.shading_normal) < 0 ? 1 / eta : eta;
    const Vec3 axis = reflects ? reflect(view.from, n) : refract(view.from, n, relative);
    return {normalize(axis), 4.0 * alpha * alpha};
}

TEST(BsdfSampling, DirectionsFollowTheDensity) {
    const std::vector<BsdfCase> cases = finite_cases();
    const std::vector<View> all_views = views();
    const double threshold = family_threshold(k_false_alarm, 2 * cases.size() * all_views.size());
    uint32_t seed = 1;
    for (const BsdfCase& c : cases) {
        const BuiltCase built(c.input);
        for (const View& view : all_views) {
            const Bsdf bsdf = built.bsdf(view.geometric_normal, view.shading_normal);
            double total = 0;
            for (const bool reflects : {true, false}) {
                SCOPED_TRACE(c.name + ", " + view.name + (reflects ? ", reflected" : ", transmitted") + ", seed " +
                             std::to_string(seed));
                Random random{seed++};
                const Walk walk = seed / 2 % 2 ? Walk::eye : Walk::light;
                const auto on_side = [&](Vec3 w) {
                    return (dot(w, view.geometric_normal) * dot(view.from, view.geometric_normal) > 0) == reflects;
                };
                const auto draw = [&]() -> std::optional<Vec3> {
                    const float u_lobe = random.next();
                    const BsdfSample s = sample(bsdf, view.from, walk, u_lobe, random.next_2d());
                    if (!(s.pdf_solid_angle > 0) || s.specular || !on_side(s.direction)) return std::nullopt;
                    return s.direction;
                };
                const auto density = [&](Vec3 w) { return on_side(w) ? pdf(bsdf, view.from, w) : 0.0; };
                const ChiSquared result = chi_squared(draw, density, bins_for(built, view, reflects), k_draws);
                EXPECT_GT(result.p, threshold) << "statistic " << result.statistic << " of " << result.bins
                                               << " bins, integral " << result.integral << ", success "
                                               << result.success;
                total += result.integral;
            }
            EXPECT_LT(total, 1.001) << c.name << ", " << view.name;
        }
    }
}

}  // namespace
}  // namespace vlp
