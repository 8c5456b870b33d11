// Lights at the ends of single precision and of sense: no NaN, no negative density, clear refusals; light choice.
#include <gtest/gtest.h>

#include "light/light_choice.h"
#include "light_scenes.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_seed = 20240613;

bool sane(const Emission& e) {
    if (is_black(e.weight)) return true;
    return is_finite(e.weight) && is_finite(e.position) && is_finite(e.normal) && is_finite(e.direction) &&
           e.pdf_position > 0 && e.pdf_direction > 0 && std::fabs(length(e.direction) - 1) < 1e-4f;
}

bool sane(const NextEvent& e) {
    if (!e.valid()) return !std::isnan(e.pdf_solid_angle);
    return is_finite(e.position) && is_finite(e.normal) && is_finite(e.radiance) && !std::isnan(e.distance) &&
           std::fabs(length(e.direction) - 1) < 1e-4f && is_finite(e.radiance * (1 / e.pdf_solid_angle));
}

// Receivers on the light, on its plane, at its centre, beside it by rounding, and far beyond; numbers at both ends.
TEST(LightRobustness, AnyReceiverAndAnyNumbers) {
    Random random{k_seed};
    std::vector<LightScene> scenes = light_scenes();
    const Vec3 o = k_light_position;
    for (const float size : {1e-12f, 1e-6f, 1e-3f, 1.0f, 1e3f, 1e6f}) {
        scenes.emplace_back("tiny or huge point", make_point(o, k_power, size), 0);
        scenes.emplace_back("tiny or huge spot", make_spot(turned(o, {size, size, size}), k_power, size, 1, size), 0);
        scenes.emplace_back("tiny or huge area", make_area(turned(o), k_power, size, 2 * size, false, k_pi), 0);
        scenes.emplace_back("long area", make_area(turned(o), k_power, size, 1, true, 1), 0);
        scenes.emplace_back("narrow sun", make_sun(turned(o), k_power, size), 0);
        scenes.emplace_back("tiny or huge sphere", make_sphere(o, size, k_power, 0, 0), 0);
        scenes.emplace_back("sliver", make_triangle(o, o + Vec3{1, 0, 0}, o + Vec3{0.5f, 1e-4f, size}, k_power, 0, 0),
                            0);
    }
    const float ends[] = {0, 0x1p-24f, 0.25f, 0.5f, 0.75f, 1 - 0x1p-24f};
    for (LightScene& s : scenes) {
        SCOPED_TRACE(s.name);
        std::vector<Vec3> places = {o, o + Vec3{1e-30f, 0, 0}, o + Vec3{1e30f, 0, 0}};
        for (int i = 0; i < 60; ++i) {
            const Emission e = sample_emission(s.scene(), s.light, random.next_2d(), random.next_2d());
            places.push_back(e.position);  // on it
            places.push_back(e.position + e.normal * 1e-7f);  // just above
            places.push_back(o + s.light.axis_u * 3.0f);  // in the plane of an area lamp
            places.push_back(o + sample_sphere(random.next_2d()) * std::pow(10.0f, 20 * random.next() - 8));
        }
        for (const float x : ends) {
            for (const float y : ends) {
                for (const float z : ends) {
                    ASSERT_TRUE(sane(sample_emission(s.scene(), s.light, {x, y}, {z, x})));
                    ASSERT_TRUE(sane(sample_emission(s.scene(), s.light, {y, z}, {x, y})));
                }
                for (const Vec3 place : places) {
                    const NextEvent e = sample_next_event(s.scene(), s.light, place, {x, y});
                    ASSERT_TRUE(sane(e)) << place.x << " " << place.y << " " << place.z << " pdf " << e.pdf_solid_angle
                                         << " t " << e.distance;
                }
            }
        }
        for (const Vec3 place : places) {
            for (int i = 0; i < 20; ++i) {
                const NextEvent e = sample_next_event(s.scene(), s.light, place, random.next_2d());
                ASSERT_TRUE(sane(e));
                if (!e.valid()) continue;
                const float pdf = pdf_next_event(s.scene(), s.light, place, e.position, e.normal, e.direction);
                EXPECT_FALSE(std::isnan(pdf) || pdf < 0);
                const EmissionPdf back = pdf_emission(s.scene(), s.light, e.position, e.normal, -e.direction);
                EXPECT_FALSE(std::isnan(back.position * back.direction) || back.position * back.direction < 0);
                hit_light(s, {place, sample_sphere(random.next_2d())});
            }
        }
    }
}

TEST(LightRobustness, DegenerateLampsAreRefused) {
    const float nan = std::nanf("");
    const Affine flat = turned({}, {0, 1, 1});
    EXPECT_FALSE(make_point({nan, 0, 0}, k_power, 1));
    EXPECT_FALSE(make_point({}, {1, nan, 1}, 1));
    EXPECT_FALSE(make_point({}, k_power, -1));
    EXPECT_FALSE(make_spot(flat, k_power, 1, 0, 0));
    EXPECT_FALSE(make_spot(turned({}), k_power, 0, 0, 0));
    EXPECT_FALSE(make_sun(turned({}, {1, 1, 0}), k_power, 0));
    EXPECT_FALSE(make_sun(turned({}), k_power, nan));
    EXPECT_FALSE(make_area(flat, k_power, 1, 1, false, 1));
    EXPECT_FALSE(make_area(turned({}), k_power, 0, 1, false, 1));
    EXPECT_FALSE(make_area(turned({}), k_power, 1, 1, false, nan));
    EXPECT_FALSE(make_area(turned({}), {k_infinity, 1, 1}, 1, 1, false, 1));
    EXPECT_FALSE(make_triangle({0, 0, 0}, {1, 1, 1}, {2, 2, 2}, k_power, 0, 0));
    EXPECT_FALSE(make_triangle({0, 0, 0}, {1, nan, 1}, {2, 1, 2}, k_power, 0, 0));
    EXPECT_FALSE(make_sphere({}, 0, k_power, 0, 0));
    EXPECT_GT(power(make_point({}, {-1, -1, -1}, 0).value(), 1), 0);
    EXPECT_TRUE(is_finite(power(make_environment(k_power), 1e30f)));
    EXPECT_TRUE(make_area(turned({}, {1, 1, 0}), k_power, 1, 1, false, 1));  // its thickness is of no use
}

// A parallelogram becomes the rectangle of its area along its first axis, and shines the way of -z.
TEST(LightRobustness, ShearedAreaKeepsItsArea) {
    Affine sheared;
    sheared.m[0][1] = 0.7f;
    const Light light = make_area(sheared, k_power, 2, 3, false, k_pi).value();
    EXPECT_NEAR(light.area, 6, 1e-5);
    EXPECT_NEAR(dot(light.axis_u, light.axis_v), 0, 1e-6);
    EXPECT_NEAR(light.normal.z, -1, 1e-6);
}

TEST(LightChoice, WidthsAreExact) {
    Random random{k_seed};
    for (const size_t count : {size_t{1}, size_t{2}, size_t{3}, size_t{1000}, size_t{200000}}) {
        for (int kind = 0; kind < 4; ++kind) {
            std::vector<double> weights(count, 1.0);
            for (size_t i = 0; i < count; ++i) {
                if (kind == 1) weights[i] = std::pow(10.0, 60 * static_cast<double>(random.next()) - 30);
                if (kind == 2) weights[i] = i % 2 ? 0 : static_cast<double>(random.next()) + 0.1;
                if (kind == 3) weights[i] = 0;
            }
            const std::vector<uint32_t> below = make_distribution(weights);
            const Distribution d{below.data(), static_cast<uint32_t>(count)};
            double total = 0, sum = 0;
            for (const double w : weights) total += w;
            for (uint32_t i = 0; i < count; ++i) {
                const double p = static_cast<double>(pdf(d, i));
                ASSERT_GT(p, 0) << count << ", " << kind;
                const double share = total > 0 ? weights[i] / total : 1.0 / static_cast<double>(count);
                ASSERT_NEAR(p, share, 3 * 0x1p-32 + 2.0 * static_cast<double>(count) * 0x1p-32 * share + 1e-7 * share);
                sum += p;
                ASSERT_EQ(sample(d, below[i]).index, i);
                const uint32_t last = (i + 1 < count ? below[i + 1] : 0u) - 1u;
                ASSERT_EQ(sample(d, last).index, i);
            }
            EXPECT_NEAR(sum, 1, 1e-6);
        }
    }
    const double odd[] = {-1, std::nan(""), 3, 1e308, INFINITY};
    const std::vector<uint32_t> below = make_distribution(odd);
    EXPECT_NEAR(pdf({below.data(), 5}, 4), 0.5, 1e-6);
    EXPECT_EQ(pdf({below.data(), 5}, 0), 0x1p-32f);
    EXPECT_TRUE(make_distribution({}).empty());
    EXPECT_EQ(choose_source(SceneView{}, 7).index, k_none);
}

// Favoured lights are drawn as often as their density says, and the others no less than half as often as by power.
TEST(LightChoice, FavouredLights) {
    const double powers[] = {1, 2, 3, 4, 0.5};
    const std::vector<uint32_t> below = make_distribution(powers);
    const double worth[] = {3, 1};
    const std::vector<uint32_t> among = make_distribution(worth);
    SceneView scene;
    scene.light_count = 5;
    scene.light_choice = {below.data(), 5};
    SceneView guided = scene;
    FavouredLights& favoured = guided.light_guide.favoured;
    favoured.count = 2;
    favoured.light[0] = 4, favoured.light[1] = 1;
    std::copy(among.begin(), among.end(), favoured.below);
    double sum = 0;
    for (uint32_t i = 0; i < 5; ++i) {
        const auto share = static_cast<double>(pdf_choose_source(guided, i));
        const double expected = 0.5 * static_cast<double>(pdf_choose_source(scene, i)) + (i == 4   ? 0.375
                                                                                          : i == 1 ? 0.125
                                                                                                   : 0.0);
        EXPECT_NEAR(share, expected, 1e-6);
        sum += share;
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    constexpr uint32_t k_draws = 1 << 16;
    double drawn[5]{};
    for (uint32_t i = 0; i < k_draws; ++i) {
        const DiscreteSample choice = choose_source(guided, (i << 16) + 0x8000u);  // evenly over all numbers
        ASSERT_EQ(choice.pdf, pdf_choose_source(guided, choice.index));
        drawn[choice.index] += 1.0 / k_draws;
    }
    for (uint32_t i = 0; i < 5; ++i) EXPECT_NEAR(drawn[i], static_cast<double>(pdf_choose_source(guided, i)), 1e-4);
}

// One lamp of 10,000 chosen at a time gives the sum over all of them, to 5 standard errors (6e-7).
TEST(LightChoice, TenThousandLamps) {
    Random random{k_seed};
    std::vector<Light> lights;
    std::vector<uint32_t> shapes;
    std::vector<double> powers;
    const Vec3 receiver{0, 0, -3};
    double truth = 0;
    for (uint32_t i = 0; i < 10000; ++i) {
        const Vec3 p{10 * random.next() - 5, 10 * random.next() - 5, 10 * random.next()};
        const float watts = std::exp(4 * random.next());
        lights.push_back(make_point(p, rgb(watts), i % 2 ? 0.01f : 0.0f).value());
        powers.push_back(static_cast<double>(power(lights.back(), 10)));
        if (i % 2) shapes.push_back(i);
        truth += static_cast<double>(watts * normalize(p - receiver).z / (4 * k_pi * length_squared(p - receiver)));
    }
    const std::vector<uint32_t> below = make_distribution(powers);
    SceneView scene;
    scene.lights = lights.data();
    scene.light_count = 10000;
    scene.light_choice = {below.data(), 10000};
    scene.lamps = {shapes.data(), static_cast<uint32_t>(shapes.size())};
    double sum = 0, squares = 0;
    constexpr int k_draws = 1000000;
    for (int i = 0; i < k_draws; ++i) {
        const DiscreteSample choice = choose_source(scene, hash(k_seed, static_cast<uint32_t>(i)));
        ASSERT_EQ(choice.pdf, pdf_choose_source(scene, choice.index));
        const NextEvent e = sample_next_event(scene, lights[choice.index], receiver, random.next_2d());
        const double x = static_cast<double>(e.radiance.g * e.direction.z / (e.pdf_solid_angle * choice.pdf));
        sum += x, squares += x * x;
    }
    const double mean = sum / k_draws, error = std::sqrt((squares / k_draws - mean * mean) / k_draws);
    EXPECT_NEAR(mean, truth, 5 * error + 1e-4 * truth) << "seed " << k_seed;
    for (int i = 0; i < 100; ++i) {
        const uint32_t target = shapes[hash(k_seed, static_cast<uint32_t>(i)) % shapes.size()];
        bool found = false;
        const Ray ray{receiver, normalize(lights[target].position - receiver)};
        for_each_lamp_hit(scene, ray, [&](uint32_t light, float t, Vec3, Vec3) {
            EXPECT_GT(t, 0);
            found = found || light == target;
        });
        EXPECT_TRUE(found);
    }
}

}  // namespace
}  // namespace vlp::test
