// Building materials: selection, layers, transparency and the values that are refused.
#include <gtest/gtest.h>

#include <stdexcept>

#include "bsdf_cases.h"

namespace vlp {
namespace {

using namespace test;

std::string refusal(const std::vector<LobeInput>& input) {
    std::vector<Lobe> lobes;
    try {
        build_material(input, {}, lobes);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "accepted";
}

TEST(BsdfMaterial, SelectionSumsToOneAndFollowsTheAlbedo) {
    LobeInput bright = lobe_input(LobeKind::diffuse), dark = lobe_input(LobeKind::translucent);
    bright.weight = rgb(0.6f), dark.weight = rgb(0.2f);
    const BuiltCase built({bright, dark});
    ASSERT_EQ(built.lobes.size(), 2u);
    EXPECT_FLOAT_EQ(built.lobes[0].selection, 0.75f);
    EXPECT_FLOAT_EQ(built.lobes[1].selection, 0.25f);
    for (const BsdfCase& c : finite_cases()) {
        float sum = 0;
        for (const Lobe& lobe : BuiltCase(c.input).lobes) sum += lobe.selection;
        EXPECT_NEAR(sum, 1, 1e-6) << c.name;
    }
}

TEST(BsdfMaterial, TransparentLobesBecomeTransparency) {
    LobeInput clear = lobe_input(LobeKind::transparent), solid = lobe_input(LobeKind::diffuse);
    clear.weight = {0.3f, 0.2f, 0.1f}, solid.weight = rgb(0.6f);
    const BuiltCase built({clear, solid});
    EXPECT_EQ(built.material.lobe_count, 1u);
    EXPECT_FLOAT_EQ(built.material.transparency.r, 0.3f);
    EXPECT_FLOAT_EQ(built.material.pass_through, 0.25f);  // 0.2 of 0.2 + 0.6
    EXPECT_FLOAT_EQ(built.lobes[0].selection, 1);

    const BuiltCase air({lobe_input(LobeKind::dielectric, Fresnel::dielectric, 0.5f, 1.0f)});
    EXPECT_EQ(air.material.lobe_count, 0u);
    EXPECT_FLOAT_EQ(air.material.pass_through, 1);
    EXPECT_FLOAT_EQ(air.material.transparency.g, 1);

    const BuiltCase opaque({solid});
    EXPECT_EQ(opaque.material.pass_through, 0);
}

TEST(BsdfMaterial, LayersKeepTheirPlacesWhenLobesDropOut) {
    LobeInput clear = lobe_input(LobeKind::transparent), black = lobe_input(LobeKind::diffuse);
    clear.weight = rgb(0.5f), black.weight = rgb(0);
    std::vector<LobeInput> input = plastic(0.4f, 1.5f);
    input[1].layered_under = 2;
    input.insert(input.begin(), {clear, black});
    const BuiltCase built(input);
    ASSERT_EQ(built.lobes.size(), 2u);
    EXPECT_EQ(built.lobes[0].kind, LobeKind::reflection);
    EXPECT_EQ(built.lobes[1].layered_under, 0);
    // The base is dimmed by the layer's albedo towards the eye, and by nothing of the light's.
    const Vec3 n{0, 0, 1};
    const Bsdf bsdf = built.bsdf(n, n);
    for (const float cosine : {0.1f, 0.5f, 1.0f}) {
        const float passed = 1 - max_component(layer_albedo(built.lobes[0], albedo_tables().data(), cosine));
        EXPECT_FLOAT_EQ(passed_by_layers(bsdf, built.lobes[1], cosine), passed);
        EXPECT_LT(passed, 0.97f);
    }
    EXPECT_LT(passed_by_layers(bsdf, built.lobes[1], 0.1f), passed_by_layers(bsdf, built.lobes[1], 1.0f));
    EXPECT_EQ(passed_by_layers(bsdf, built.lobes[0], 0.5f), 1);
}

// Refraction sees the layer at two cosines; only the eye's counts, in both walks.
TEST(BsdfMaterial, LayersDimSpecularLobesTowardsTheEye) {
    LobeInput glass = lobe_input(LobeKind::dielectric, Fresnel::dielectric, 0, 1.5f);
    const BuiltCase bare({glass});
    LobeInput layer = lobe_input(LobeKind::reflection, Fresnel::dielectric, 0.3f, 1.4f);
    glass.layered_under = 0;
    const BuiltCase built({layer, glass});
    const Vec3 n{0, 0, 1};
    const Bsdf layered = built.bsdf(n, n), alone = bare.bsdf(n, n);
    const Vec3 from = normalize(Vec3{0.9f, 0, 0.3f});
    const float u_alone = 0.999f;  // refracts
    for (const Walk walk : {Walk::eye, Walk::light}) {
        const BsdfSample s = sample(layered, from, walk, u_alone, {0.5f, 0.5f});
        const BsdfSample reference = sample(alone, from, walk, u_alone, {0.5f, 0.5f});
        ASSERT_TRUE(s.specular && reference.specular);
        ASSERT_LT(s.direction.z, 0);
        const float cos_eye = walk == Walk::eye ? from.z : -s.direction.z;
        const float passed = 1 - max_component(layer_albedo(built.lobes[0], albedo_tables().data(), cos_eye));
        EXPECT_NEAR(s.weight.g * built.lobes[1].selection, reference.weight.g * passed, 1e-5);
    }
}

TEST(BsdfMaterial, BlackMaterialsHaveNoLobes) {
    LobeInput black = lobe_input(LobeKind::diffuse);
    black.weight = {};
    const BuiltCase built({black});
    EXPECT_EQ(built.material.lobe_count, 0u);
    EXPECT_FALSE(built.material.has_finite);
    const Bsdf bsdf = built.bsdf({0, 0, 1}, {0, 0, 1});
    EXPECT_FALSE(sample(bsdf, {0, 0, 1}, Walk::eye, 0.5f, {0.5f, 0.5f}).valid());
    EXPECT_EQ(pdf(bsdf, {0, 0, 1}, {0, 0, 1}), 0);
}

TEST(BsdfMaterial, WrongValuesAreRefusedByName) {
    LobeInput lobe = lobe_input(LobeKind::reflection);
    lobe.roughness = 1.5f;
    EXPECT_EQ(refusal({lobe}), "lobe 0: roughness 1.500000 is not in [0, 1]");
    lobe = lobe_input(LobeKind::dielectric);
    lobe.ior = 0;
    EXPECT_EQ(refusal({lobe}), "lobe 0: ior 0.000000 is not positive");
    lobe = lobe_input(LobeKind::diffuse);
    lobe.weight.g = -1;
    EXPECT_EQ(refusal({lobe}), "lobe 0: weight must be finite and not negative");
    lobe.weight.g = std::nanf("");
    EXPECT_EQ(refusal({lobe}), "lobe 0: weight must be finite and not negative");
    lobe = lobe_input(LobeKind::diffuse);
    lobe.layered_under = 3;
    EXPECT_EQ(refusal({lobe}), "lobe 0: layered under lobe 3, which is not there");
    lobe.layered_under = 0;
    EXPECT_EQ(refusal({lobe}), "lobe 0: layered under lobe 0, which is not a reflection");
    lobe.kind = LobeKind::reflection;
    EXPECT_EQ(refusal({lobe}), "lobe 0: layered under itself");
    lobe = lobe_input(static_cast<LobeKind>(9));
    EXPECT_EQ(refusal({lobe}), "lobe 0: unknown kind 9");
    std::vector<Lobe> lobes;
    EXPECT_THROW(build_material({}, {0, INFINITY, 0}, lobes), std::invalid_argument);
}

TEST(BsdfMaterial, NarrowLobesAreSpecular) {
    EXPECT_TRUE(BuiltCase({lobe_input(LobeKind::reflection, Fresnel::none, 0.003f)}).material.has_specular);
    EXPECT_TRUE(BuiltCase({lobe_input(LobeKind::reflection, Fresnel::none, 0.004f)}).material.has_finite);
    EXPECT_TRUE(BuiltCase({lobe_input(LobeKind::diffuse)}).material.has_finite);
}

}  // namespace
}  // namespace vlp
