// BSDF values: weights of samples, reciprocity, energy, and the limits of narrow lobes.
#include <gtest/gtest.h>

#include <cmath>

#include "bsdf_cases.h"
#include "chi_squared.h"
#include "random_numbers.h"

namespace vlp {
namespace {

using namespace test;

::testing::AssertionResult close(Rgb a, Rgb b, float tolerance) {
    const float scale = max_of(max_of(max_component(a), max_component(b)), 1e-6f);
    const float error = max_of(std::fabs(a.r - b.r), max_of(std::fabs(a.g - b.g), std::fabs(a.b - b.b))) / scale;
    if (error <= tolerance) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "(" << a.r << " " << a.g << " " << a.b << ") vs (" << b.r << " " << b.g
                                         << " " << b.b << "), off by " << error;
}

::testing::AssertionResult close(float a, float b, float tolerance) { return close(rgb(a), rgb(b), tolerance); }

BsdfSample draw(const Bsdf& bsdf, Vec3 from, Walk walk, Random& random) {
    const float u_lobe = random.next();
    return sample(bsdf, from, walk, u_lobe, random.next_2d());
}

TEST(BsdfValue, WeightsAndDensitiesOfSamplesMatchEval) {
    Random random{11};
    for (const BsdfCase& c : finite_cases()) {
        const BuiltCase built(c.input);
        for (const View& view : views()) {
            const Bsdf bsdf = built.bsdf(view.geometric_normal, view.shading_normal);
            for (int i = 0; i < 60; ++i) {
                const Walk walk = i % 2 ? Walk::eye : Walk::light;
                const BsdfSample s = draw(bsdf, view.from, walk, random);
                if (!(s.pdf_solid_angle > 0) || s.specular) continue;
                SCOPED_TRACE(c.name + ", " + view.name + (i % 2 ? ", eye" : ", light"));
                ASSERT_TRUE(is_finite(s.direction) && is_finite(s.weight));
                EXPECT_NEAR(length(s.direction), 1, 1e-5);
                const Rgb f = i % 2 ? eval(bsdf, view.from, s.direction) : eval(bsdf, s.direction, view.from);
                const float cosine = abs_dot(s.direction, view.geometric_normal);
                EXPECT_TRUE(close(s.weight, f * (cosine / s.pdf_solid_angle), 1e-4f));
                // Half vectors of refraction, computed from either end, leave 2e-4 in single precision.
                EXPECT_TRUE(close(s.pdf_solid_angle, pdf(bsdf, view.from, s.direction), 1e-3f));
                EXPECT_TRUE(close(s.pdf_rev_solid_angle, pdf(bsdf, s.direction, view.from), 1e-3f));
            }
        }
    }
}

// f_s(a -> b) / eta_b^2 = f_s(b -> a) / eta_a^2 (Veach 1997, 5.2), f_s being eval without |light.ns| / |light.ng|.
TEST(BsdfValue, ReciprocalLobesAreReciprocal) {
    Random random{12};
    int compared = 0;
    for (const BsdfCase& c : finite_cases()) {
        if (!c.reciprocal) continue;
        const BuiltCase built(c.input);
        for (const View& view : views()) {
            const Bsdf bsdf = built.bsdf(view.geometric_normal, view.shading_normal);
            for (int i = 0; i < 20; ++i) {
                const BsdfSample s = draw(bsdf, view.from, Walk::eye, random);
                if (!(s.pdf_solid_angle > 0) || s.specular) continue;
                const Vec3 a = view.from, b = s.direction;
                const auto value = [&](Vec3 eye, Vec3 light) {
                    return eval(bsdf, eye, light) *
                           (abs_dot(light, bsdf.geometric_normal) / abs_dot(light, bsdf.normal));
                };
                const auto index = [&](Vec3 w) {
                    return dot(w, bsdf.geometric_normal) < 0 ? built.lobes[0].eta : 1.0f;
                };
                // Lambertian lobes are dark only where the light is below the shading normal.
                const bool frames_agree = dot(a, bsdf.normal) * dot(a, bsdf.geometric_normal) > 0 &&
                                          dot(b, bsdf.normal) * dot(b, bsdf.geometric_normal) > 0;
                if (!frames_agree) continue;
                SCOPED_TRACE(c.name + ", " + view.name);
                // Materials that mix Lambertian and refracting lobes transmit by the latter alone.
                const bool radiance =
                    built.lobes[0].kind == LobeKind::dielectric || built.lobes[0].kind == LobeKind::refraction;
                const float eta_a = radiance ? index(a) : 1, eta_b = radiance ? index(b) : 1;
                EXPECT_TRUE(close(value(a, b) / square(eta_a), value(b, a) / square(eta_b), 2e-3f));
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 5000);
}

// The share of a constant environment that an eye sees in the surface: the mean weight, with the radiance's eta^2 taken
// out of what is refracted. Eight standard errors of slack: a false alarm is out of the question.
struct Furnace {
    double mean, error;
};

Furnace furnace(const BuiltCase& built, const View& view, Random& random, int draws) {
    const Bsdf bsdf = built.bsdf(view.geometric_normal, view.shading_normal);
    double sum = 0, squares = 0;
    for (int i = 0; i < draws; ++i) {
        const BsdfSample s = draw(bsdf, view.from, Walk::eye, random);
        double weight = 0;
        if (s.valid()) {
            weight = max_component(s.weight);
            const float side = dot(view.from, view.geometric_normal);
            const LobeKind kind = built.lobes[0].kind;
            if (side * dot(s.direction, view.geometric_normal) < 0 &&
                (kind == LobeKind::dielectric || kind == LobeKind::refraction)) {
                weight *= square(side < 0 ? 1 / built.lobes[0].eta : built.lobes[0].eta);
            }
        }
        sum += weight, squares += weight * weight;
    }
    const double mean = sum / draws;
    return {mean, std::sqrt(max_of(squares / draws - mean * mean, 0.0) / draws)};
}

TEST(BsdfValue, NoMaterialGainsEnergy) {
    Random random{13};
    for (BsdfCase c : finite_cases()) {
        if (c.input.size() > 1 && c.input[1].layered_under < 0) {  // an even mix
            for (LobeInput& lobe : c.input) lobe.weight = lobe.weight * (1.0f / static_cast<float>(c.input.size()));
        }
        if (c.name == "tinted glass" || c.name == "glass, diffuse and gold") {
            for (LobeInput& lobe : c.input)
                lobe.f0 = {min_of(lobe.f0.r, 1.0f), min_of(lobe.f0.g, 1.0f), min_of(lobe.f0.b, 1.0f)};
        }
        const BuiltCase built(c.input);
        for (const View& view : views()) {
            SCOPED_TRACE(c.name + ", " + view.name);
            const Furnace f = furnace(built, view, random, 4000);
            // Compensation reads tables between whose nodes the albedo is not quite linear: 1 % near grazing angles.
            const double slack = c.reciprocal ? 1e-5 : 0.01;
            EXPECT_LE(f.mean, 1 + slack + 8 * f.error);
        }
    }
}

TEST(BsdfValue, CompensationFillsTheFurnace) {
    Random random{14};
    using enum LobeKind;
    for (const float roughness : {0.2f, 0.5f, 0.8f, 1.0f}) {
        for (const float cosine : {0.95f, 0.5f, 0.2f}) {
            const Frame frame = make_frame({0, 0, 1});
            const View view{frame.normal, frame.normal, direction_at(frame, cosine, 1), ""};
            for (const LobeInput& lobe : {lobe_input(reflection, Fresnel::none, roughness),
                                          lobe_input(dielectric, Fresnel::dielectric, roughness, 1.5f)}) {
                SCOPED_TRACE("roughness " + std::to_string(roughness) + ", cosine " + std::to_string(cosine));
                const Furnace f = furnace(BuiltCase({compensated(lobe)}), view, random, 40000);
                EXPECT_NEAR(f.mean, 1, 0.01 + 8 * f.error);
            }
        }
    }
}

TEST(BsdfValue, DiffuseFurnaceIsTheAlbedo) {
    LobeInput input = lobe_input(LobeKind::diffuse);
    input.weight = {0.7f, 0.2f, 0.4f};
    const BuiltCase built({input});
    Random random{15};
    for (const View& view : views()) {
        const Bsdf bsdf = built.bsdf(view.geometric_normal, view.shading_normal);
        for (int i = 0; i < 50; ++i) {
            const BsdfSample s = draw(bsdf, view.from, Walk::eye, random);
            ASSERT_GT(s.pdf_solid_angle, 0);  // a diffuse surface never refuses
            const bool lit = dot(s.direction, bsdf.normal) * dot(s.direction, bsdf.geometric_normal) > 0;
            EXPECT_TRUE(close(s.weight, lit ? input.weight : Rgb{}, 1e-5f));
        }
    }
}

// A surface's own value: albedo / pi, times the cosines of the light, and black where the light is behind.
TEST(BsdfValue, DiffuseCarriesTheShadingNormalOnTheLightsSide) {
    const BuiltCase built({lobe_input(LobeKind::diffuse)});
    const Vec3 ng{0, 0, 1}, ns = normalize(Vec3{0.6f, 0, 1});
    const Bsdf bsdf = built.bsdf(ng, ns);
    const Vec3 light = normalize(Vec3{0.3f, 0.4f, 0.5f}), eye = normalize(Vec3{-1, 0.2f, 0.1f});
    ASSERT_LT(dot(eye, ns), 0);  // seen, though below the shading normal
    EXPECT_NEAR(eval(bsdf, eye, light).g, k_inv_pi * dot(light, ns) / dot(light, ng), 1e-6);
    EXPECT_EQ(eval(bsdf, light, eye).g, 0);                       // lit from below the shading normal
    EXPECT_EQ(eval(bsdf, eye, -light).g, 0);                      // through the surface
    EXPECT_NEAR(eval(bsdf, -light, -light).g, k_inv_pi * dot(light, ns) / dot(light, ng), 1e-6);  // the other side
}

// In a light walk the weight is the adjoint one: the same path has the same value, whichever end samples it.
TEST(BsdfValue, SpecularWeightsFollowFromNarrowLobes) {
    using enum LobeKind;
    Random random{16};
    std::vector<LobeInput> lobes = {lobe_input(reflection),
                                    gold(0),
                                    painted_metal(0),
                                    lobe_input(reflection, Fresnel::dielectric, 0, 1.5f),
                                    lobe_input(dielectric, Fresnel::dielectric, 0, 1.5f),
                                    tinted_glass(0, 1.4f),
                                    lobe_input(refraction, Fresnel::none, 0, 1.33f)};
    int compared = 0;
    for (LobeInput input : lobes) {
        const BuiltCase smooth({input});
        EXPECT_TRUE(smooth.material.has_specular);
        EXPECT_FALSE(smooth.material.has_finite);
        input.roughness = 0.01f;  // alpha 1e-4
        const BuiltCase narrow({input});
        EXPECT_TRUE(narrow.material.has_finite);
        for (const View& view : views()) {
            if (std::fabs(dot(view.from, view.shading_normal)) < 0.1f) continue;
            const Bsdf a = smooth.bsdf(view.geometric_normal, view.shading_normal);
            const Bsdf b = narrow.bsdf(view.geometric_normal, view.shading_normal);
            for (const Walk walk : {Walk::eye, Walk::light}) {
                for (int i = 0; i < 20; ++i) {
                    const float u_lobe = random.next();
                    const Vec2 u{random.next(), 0.9f * random.next()};
                    const BsdfSample s = sample(a, view.from, walk, u_lobe, u),
                                     n = sample(b, view.from, walk, u_lobe, u);
                    SCOPED_TRACE("kind " + std::to_string(static_cast<int>(input.kind)) + ", " + view.name +
                                 (walk == Walk::eye ? ", eye" : ", light"));
                    if (!s.valid() || !n.valid()) continue;
                    const float g = dot(view.from, view.geometric_normal);
                    if (std::fabs(dot(s.direction, view.geometric_normal)) < 0.05f) continue;
                    ASSERT_TRUE(s.specular);
                    if (dot(s.direction, view.geometric_normal) * g * dot(n.direction, view.geometric_normal) * g < 0)
                        continue;
                    EXPECT_LT(length(s.direction - n.direction), 0.02f);
                    EXPECT_TRUE(close(s.weight, n.weight, 0.02f));
                    // Both densities belong to one pair of directions, so their ratio has a limit too.
                    EXPECT_TRUE(close(s.pdf_rev_solid_angle / s.pdf_solid_angle,
                                      n.pdf_rev_solid_angle / n.pdf_solid_angle, 0.02f));
                    EXPECT_TRUE(is_black(eval(a, view.from, s.direction)));
                    EXPECT_EQ(pdf(a, view.from, s.direction), 0);
                    ++compared;
                }
            }
        }
    }
    EXPECT_GT(compared, 2000);
}

TEST(BsdfValue, SmoothInterfacesObeySnellAndFresnel) {
    const BuiltCase glass({lobe_input(LobeKind::dielectric, Fresnel::dielectric, 0, 1.5f)});
    const Vec3 n{0, 0, 1};
    const Bsdf bsdf = glass.bsdf(n, n);
    const float sine = 0.6f;
    const Vec3 from{sine, 0, 0.8f};
    const float sine_t = sine / 1.5f, cosine_t = std::sqrt(1 - sine_t * sine_t);
    const float s = (0.8f - 1.5f * cosine_t) / (0.8f + 1.5f * cosine_t), p = (1.2f - cosine_t) / (1.2f + cosine_t);
    const float reflected = 0.5f * (s * s + p * p);

    const BsdfSample up = sample(bsdf, from, Walk::eye, 0, {0.5f, 0.5f});
    EXPECT_TRUE(up.specular);
    EXPECT_NEAR(up.pdf_solid_angle, reflected, 1e-5);
    EXPECT_NEAR(up.direction.x, -sine, 1e-6);
    EXPECT_NEAR(up.direction.z, 0.8f, 1e-6);
    EXPECT_NEAR(up.weight.g, 1, 1e-5);

    const BsdfSample down = sample(bsdf, from, Walk::eye, 0.999f, {0.5f, 0.5f});
    EXPECT_NEAR(down.pdf_solid_angle, 1 - reflected, 1e-5);
    EXPECT_NEAR(down.direction.x, -sine_t, 1e-6);
    EXPECT_NEAR(down.direction.z, -cosine_t, 1e-6);
    EXPECT_NEAR(down.weight.g, 1 / 2.25f, 1e-5);  // radiance, from the denser side
    EXPECT_NEAR(sample(bsdf, from, Walk::light, 0.999f, {0.5f, 0.5f}).weight.g, 1, 1e-5);
    const BsdfSample back = sample(bsdf, down.direction, Walk::eye, 0.999f, {0.5f, 0.5f});
    EXPECT_NEAR(length(back.direction - from), 0, 1e-5);
    EXPECT_NEAR(back.weight.g, 2.25f, 1e-4);

    // Beyond the critical angle everything is reflected.
    const BsdfSample total = sample(bsdf, {0.8f, 0, -0.6f}, Walk::eye, 0.999f, {0.5f, 0.5f});
    EXPECT_NEAR(total.direction.x, -0.8f, 1e-6);
    EXPECT_EQ(total.pdf_solid_angle, 1);
    EXPECT_EQ(total.pdf_rev_solid_angle, 1);
}

TEST(BsdfValue, UnitCircleIsCosineAndSine) {
    for (int i = 0; i < 1000; ++i) {
        const float u = static_cast<float>(i) / 1000;
        const Vec2 p = unit_circle(u);
        const double angle = 2 * 3.14159265358979323846 * static_cast<double>(u);
        EXPECT_NEAR(p.x, std::cos(angle), 3e-7);
        EXPECT_NEAR(p.y, std::sin(angle), 3e-7);
    }
}

// Schlick's term meets its three anchors; the conductor's meets published reflectances of gold and the dielectric's.
TEST(BsdfValue, FresnelTermsMeetTheirAnchors) {
    const Rgb f0{0.9f, 0.6f, 0.3f}, tint{0.7f, 1.0f, 0.4f};
    EXPECT_TRUE(close(fresnel_schlick(1, f0, tint), f0, 1e-6f));
    EXPECT_TRUE(close(fresnel_schlick(0, f0, tint), rgb(1), 1e-6f));
    const float rise = std::pow(6.0f / 7, 5.0f);
    EXPECT_TRUE(close(fresnel_schlick(1.0f / 7, f0, tint), (f0 + (rgb(1) - f0) * rise) * tint, 1e-5f));
    EXPECT_NEAR(fresnel_conductor(1, 0.27f, 2.78f), (square(0.73f) + square(2.78f)) / (square(1.27f) + square(2.78f)),
                1e-6);
    EXPECT_NEAR(fresnel_conductor(0, 0.27f, 2.78f), 1, 1e-6);
    for (const float cosine : {0.05f, 0.3f, 0.7f, 1.0f}) {
        EXPECT_NEAR(fresnel_conductor(cosine, 1.5f, 0), fresnel_dielectric(cosine, 1.5f), 1e-5);
        EXPECT_TRUE(
            close(fresnel_tinted_dielectric(cosine, 1.5f, rgb(1)), rgb(fresnel_dielectric(cosine, 1.5f)), 1e-5f));
    }
    EXPECT_NEAR(fresnel_dielectric(1, 1.5f), 0.04f, 1e-6);
    // The means that compensation uses, against quadrature.
    double dielectric = 0, schlick = 0;
    for (int i = 0; i < 1000; ++i) {
        const float cosine = (static_cast<float>(i) + 0.5f) / 1000;
        dielectric += 2e-3 * cosine * fresnel_dielectric(cosine, 1.5f);
        schlick += 2e-3 * cosine * fresnel_schlick(cosine, f0, tint).r;
    }
    EXPECT_NEAR(average_fresnel_dielectric(1.5f), dielectric, 0.003);  // a fit
    EXPECT_NEAR(average_fresnel_schlick(f0, schlick_edge(f0, tint)).r, schlick, 1e-3);
}

}  // namespace
}  // namespace vlp
