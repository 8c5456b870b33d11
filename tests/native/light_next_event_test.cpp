// Next event: samples follow their density, the density is the one that hits report, and both see the same light.
#include <gtest/gtest.h>

#include "light_scenes.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_seed = 20240611;

struct Receiver {
    const char* name;
    Vec3 position;
};

// In front of the lamps (they shine along -normal of `turned`), behind, aside, near, far, and inside the spheres.
std::vector<Receiver> receivers() {
    const Vec3 axis = -turned({}).column(2), side = turned({}).column(0);
    const Vec3 o = k_light_position;
    return {{"in_front", o + axis * 1.5f + side * 0.3f}, {"near", o + axis * 0.45f - side * 0.5f},
            {"aside", o + axis * 0.2f + side * 2.0f},    {"far", o + axis * 60.0f + side * 9.0f},
            {"behind", o - axis * 1.2f + side * 0.4f},   {"inside", o + axis * 0.1f + side * 0.15f}};
}

// The smallest cone around the light that the density fills, from hits alone.
DirectionMap directions_toward(LightScene& s, Vec3 receiver, Random& random) {
    DirectionMap all{make_frame({0, 0, 1}), 2};
    Vec3 sum;
    std::vector<Vec3> found;
    const bool sphere = s.light.kind != LightKind::sun && s.light.radius > 0;
    const bool inside = sphere && length(k_light_position - receiver) < s.light.radius;
    for (int i = 0; i < 20000; ++i) {
        const NextEvent e = sample_next_event(s.scene(), s.light, receiver, random.next_2d());
        if (e.drawn()) found.push_back(e.direction), sum += e.direction;
    }
    if (found.empty() || inside || length(sum) < 0.05f * static_cast<float>(found.size())) return all;
    all.frame = make_frame(normalize(sum));
    float widest = 0;
    for (const Vec3 d : found) widest = max_of(widest, 0.5f * length_squared(d - all.frame.normal));
    all.one_minus_cos = min_of(2.0f, 1.2f * widest);
    return all;
}

// 20 lights x 6 receivers, less those that can't be hit: about 90 fits of significance 1e-6, a false-alarm rate of
// 1e-4.
TEST(LightNextEvent, SamplesFollowTheDensityOfHits) {
    Random random{k_seed};
    for (LightScene& s : light_scenes()) {
        if (is_delta(s.light)) continue;
        for (const Receiver& r : receivers()) {
            SCOPED_TRACE(s.name + ", " + r.name);
            // The bins would be wider than a portal from there.
            if (s.view.light_guide.portals.count > 0 && r.name == std::string("far")) continue;
            const DirectionMap map = directions_toward(s, r.position, random);
            const auto draw = [&](float (&point)[2]) {
                const NextEvent e = sample_next_event(s.scene(), s.light, r.position, random.next_2d());
                if (!e.drawn()) return false;
                const Vec2 p = map.point(e.direction);
                point[0] = p.x, point[1] = p.y;
                return true;
            };
            const auto density = [&](const float (&point)[2]) {
                const Vec3 d = map.direction({point[0], point[1]});
                const LightHit hit = hit_light(s, {r.position, d});
                if (!hit.found) return 0.0f;
                return pdf_next_event(s.scene(), s.light, r.position, hit.position, hit.normal, d) * map.solid_angle();
            };
            const Fit fit = goodness_of_fit({16, 16}, 200000, 48, random, draw, density);
            EXPECT_GT(fit.p, 1e-6) << "seed " << k_seed << ", integral " << fit.expected << ", valid " << fit.seen;
            EXPECT_NEAR(fit.expected, fit.seen, 0.005);
            // Only an ellipse drawn from the rectangle around it, and a lamp seen from behind, may waste draws.
            if (!s.light.ellipse && fit.seen > 0) {
                EXPECT_GT(fit.seen, 0.9999);
            }
        }
    }
}

TEST(LightNextEvent, SamplesAgreeWithHits) {
    Random random{k_seed};
    for (LightScene& s : light_scenes()) {
        for (const Receiver& r : receivers()) {
            SCOPED_TRACE(s.name + ", " + r.name);
            int missed = 0, valid = 0;
            for (int i = 0; i < 2000; ++i) {
                const NextEvent e = sample_next_event(s.scene(), s.light, r.position, random.next_2d());
                if (!e.drawn()) continue;
                ++valid;
                ASSERT_NEAR(length(e.direction), 1, 1e-5);
                ASSERT_EQ(e.delta, is_delta(s.light));
                const float pdf = pdf_next_event(s.scene(), s.light, r.position, e.position, e.normal, e.direction);
                if (e.delta) {
                    ASSERT_EQ(e.pdf_solid_angle, 1);
                    ASSERT_EQ(pdf, 0);
                    continue;
                }
                ASSERT_NEAR(pdf / e.pdf_solid_angle, 1, 2e-3);
                ASSERT_EQ(is_infinite(s.light), e.distance == k_infinity);
                ASSERT_LT(dot(e.normal, e.direction), 0);
                if (!is_infinite(s.light)) {
                    const float scale = length(e.position - r.position);
                    ASSERT_NEAR(e.distance, scale, 1e-4f * scale + 1e-5f);
                    ASSERT_LT(length(normalize(e.position - r.position) - e.direction), 1e-5f + 1e-5f / scale);
                }
                const LightHit hit = hit_light(s, {r.position, e.direction});
                missed += !hit.found;
                if (!hit.found) continue;
                const Rgb seen = emitted(s.scene(), s.light, hit.position, hit.normal, -e.direction);
                ASSERT_NEAR(seen.g, e.radiance.g, 1e-3f * s.light.radiance.g);
                ASSERT_NEAR(seen.r * 2, e.radiance.g * 3, 2e-3f * s.light.radiance.g);
                if (is_infinite(s.light)) continue;
                // Grazing hits are badly conditioned along the ray, not across it.
                const float cosine = -dot(e.normal, e.direction);
                ASSERT_NEAR(hit.t * cosine, e.distance * cosine, 2e-4f * e.distance + 1e-5f);
                if (cosine > 0.05f) {
                    ASSERT_GT(dot(hit.normal, e.normal), 0.999f);
                }
            }
            EXPECT_LE(missed, valid / 200);  // on edges, by rounding
        }
    }
}

TEST(LightNextEvent, SurfacesAreNamedAndLampsAreNot) {
    for (LightScene& s : light_scenes()) {
        const NextEvent e = sample_next_event(s.scene(), s.light, {3, -4, -2}, {0.3f, 0.6f});
        EXPECT_EQ(e.surface.instance, is_surface(s.light) ? s.light.instance : k_none) << s.name;
        EXPECT_EQ(e.surface.primitive, is_surface(s.light) ? s.light.primitive : k_none) << s.name;
    }
}

// Points that next event never draws have no density: the far side of a sphere from outside, the back of an area lamp,
// and what lies outside the beam of a spread one.
TEST(LightNextEvent, PointsNeverDrawnHaveNoDensity) {
    const Vec3 o = k_light_position, axis = -turned({}).column(2), side = turned({}).column(0);
    const auto pdf = [&](LightScene s, Vec3 receiver, Vec3 position, Vec3 normal) {
        return pdf_next_event(s.scene(), s.light, receiver, position, normal, normalize(position - receiver));
    };
    const Vec3 receiver = o + axis * 2.0f;
    for (const auto& light : {make_point(o, k_power, 0.5f), make_sphere(o, 0.5f, k_power, 0, 0)}) {
        EXPECT_GT(pdf({"sphere", light, 0}, receiver, o + axis * 0.5f, axis), 0);
        EXPECT_EQ(pdf({"sphere", light, 0}, receiver, o - axis * 0.5f, axis), 0);
        EXPECT_GT(pdf({"sphere", light, 0}, o, o + axis * 0.5f, -axis), 0);
    }
    for (const bool ellipse : {false, true}) {
        const LightScene lambertian("area", make_area(turned(o), k_power, 2, 2, ellipse, k_pi), 0);
        const LightScene beam("beam", make_area(turned(o), k_power, 2, 2, ellipse, 0.4f), 0);
        EXPECT_GT(pdf(lambertian, receiver, o + side * 0.9f, axis), 0);
        EXPECT_EQ(pdf(lambertian, o - axis, o + side * 0.9f, axis), 0);
        EXPECT_GT(pdf(beam, receiver, o + side * 0.2f, axis), 0);
        EXPECT_EQ(pdf(beam, receiver, o + side * 0.9f, axis), 0);
    }
}

// Irradiance of a small surface at `receiver` that faces `normal`, green channel, with its standard error.
struct Estimate {
    double mean = 0, error = 0;
};

Estimate irradiance(LightScene& s, Vec3 receiver, Vec3 normal, int draws, Random& random) {
    double sum = 0, squares = 0;
    for (int i = 0; i < draws; ++i) {
        const NextEvent e = sample_next_event(s.scene(), s.light, receiver, random.next_2d());
        const double cosine = static_cast<double>(dot(normal, e.direction));
        const double x = e.valid() && cosine > 0 ? static_cast<double>(e.radiance.g / e.pdf_solid_angle) * cosine : 0;
        sum += x, squares += x * x;
    }
    const double mean = sum / draws;
    return {mean, std::sqrt(max_of(0.0, squares / draws - mean * mean) / draws)};
}

// Closed forms. 5 standard errors (6e-7 each) and 1e-4 for single precision.
TEST(LightNextEvent, IrradianceEqualsClosedForms) {
    Random random{k_seed};
    const double pi = 3.14159265358979323846, watts = 2;
    const Vec3 o = k_light_position, axis = -turned({}).column(2);
    const auto check = [&](LightScene s, Vec3 receiver, Vec3 normal, double truth) {
        const Estimate e = irradiance(s, receiver, normal, 400000, random);
        EXPECT_NEAR(e.mean, truth, 5 * e.error + 1e-4 * truth) << s.name << ", seed " << k_seed;
    };
    for (const float radius : {0.0f, 1e-4f, 0.3f, 1.99f}) {
        check({"point", make_point(o, k_power, radius), 0}, o + axis * 2.0f, -axis, watts / (16 * pi));
    }
    check({"spot", make_spot(turned(o), k_power, 1, 0.2f, 0.01f), 0}, o + axis * 2.0f, -axis, watts / (16 * pi));
    for (const float angle : {0.0f, 1e-4f, 0.00918f, 0.5f, k_pi}) {
        check({"sun", make_sun(turned({}), k_power, angle), 0}, {1, 2, 3}, -axis, watts);
    }
    for (const float h : {0.05f, 0.5f, 5.0f, 500.0f}) {
        const double disc = watts / (pi * 0.25) / (1 + 4 * static_cast<double>(h * h));  // L pi R² / (R² + h²), R = 1/2
        check({"disc", make_area(turned(o), k_power, 1, 1, true, k_pi), 0}, o + axis * h, -axis, disc);
        // Form factor of a square of side 1 seen by a small parallel surface under its centre.
        const double x = 0.5 / std::sqrt(0.25 + static_cast<double>(h * h)),
                     a = std::atan(0.5 / std::sqrt(0.25 + static_cast<double>(h * h)));
        check({"square", make_area(turned(o), k_power, 1, 1, false, k_pi), 0}, o + axis * h, -axis,
              watts / pi * 4 * x * a);
    }
    // A spread lamp seen from afar on its axis: radiance grows by 1 / (1 - a cot a).
    const double a = 0.25, far = 300;
    check({"spread", make_area(turned(o), k_power, 0.01f, 0.01f, false, 0.5f), 0}, o + axis * 300.0f, -axis,
          watts / pi / (1 - a / std::tan(a)) / (far * far));
    check({"environment", make_environment(k_power), 0}, o, axis, pi * watts);
    check({"inside", make_sphere(o, 2, k_power, 0, 0), 0}, o + axis * 1.5f, axis, pi * watts);
    check({"outside", make_sphere(o, 2, k_power, 0, 0), 0}, o + axis * 3.0f, -axis, pi * watts * 4 / 9);
}

}  // namespace
}  // namespace vlp::test
