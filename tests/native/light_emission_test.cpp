// First rays of light paths: they follow their density, carry the watts asked for, and light a disc as next event does.
#include <gtest/gtest.h>

#include "light_scenes.h"

namespace vlp::test {
namespace {

constexpr uint32_t k_seed = 20240612;

Emission draw_emission(LightScene& s, Random& random) {
    const Vec2 u_position = random.next_2d(), u_direction = random.next_2d();
    return sample_emission(s.scene(), s.light, u_position, u_direction);
}

// Uniform coordinates of the places that a light's rays may start from, given their direction.
struct PositionMap {
    const LightScene& s;

    bool round() const { return s.light.radius > 0 && !is_infinite(s.light); }
    float area() const {
        if (is_infinite(s.light)) return k_pi * square(s.view.radius);
        return is_delta(s.light) ? 1.0f : s.light.area;
    }
    Vec3 position(Vec2 p, Vec3 direction) const {
        const Light& l = s.light;
        const float r = std::sqrt(p.x), c = r * std::cos(k_two_pi * p.y), d = r * std::sin(k_two_pi * p.y);
        if (is_infinite(l)) {
            const Frame f = make_frame(direction);
            return s.view.center + (f.tangent * c + f.bitangent * d - direction * 2.0f) * s.view.radius;
        }
        if (round()) return l.position + l.radius * DirectionMap{make_frame(direction), 2}.direction(p);
        if (l.kind == LightKind::triangle) return l.position + l.axis_u * (1 - r) + l.axis_v * (r * p.y);
        if (l.kind == LightKind::area && l.ellipse) return area_point(l, {l.half_size.x * c, l.half_size.y * d});
        return area_point(l, {l.half_size.x * (2 * p.x - 1), l.half_size.y * (2 * p.y - 1)});
    }
    Vec2 point(Vec3 position, Vec3 direction) const {
        const Light& l = s.light;
        const auto polar = [](float x, float y) {
            const float angle = std::atan2(y, x) / k_two_pi;
            return Vec2{x * x + y * y, angle < 0 ? angle + 1 : angle};
        };
        if (is_infinite(l)) {
            const Frame f = make_frame(direction);
            const Vec3 local = f.to_local(position - s.view.center) / s.view.radius;
            EXPECT_LT(local.z, -1);  // outside the sphere
            return polar(local.x, local.y);
        }
        const Vec3 v = position - l.position;
        if (round()) {
            EXPECT_NEAR(length(v), l.radius, 1e-5f);
            return DirectionMap{make_frame(direction), 2}.point(v / length(v));
        }
        if (is_delta(l)) return {0.5f, 0.5f};
        const Vec2 size = l.kind == LightKind::area ? l.half_size : Vec2{1, 1};
        const Vec3 a = l.axis_u * size.x, b = l.axis_v * size.y;
        const float uu = length_squared(a), vv = length_squared(b), uv = dot(a, b);
        const float x = (dot(v, a) * vv - dot(v, b) * uv) / (uu * vv - uv * uv);
        const float y = (dot(v, b) * uu - dot(v, a) * uv) / (uu * vv - uv * uv);
        EXPECT_LT(length(v - a * x - b * y), 1e-5f);  // in its plane
        if (l.kind == LightKind::triangle) return {square(1 - x), y / (1 - x)};
        return l.ellipse ? polar(x, y) : Vec2{0.5f * (x + 1), 0.5f * (y + 1)};
    }
};

Vec3 normal_at(const LightScene& s, Vec3 position, Vec3 direction) {
    if (is_infinite(s.light) || is_delta(s.light)) return direction;
    if (s.light.kind == LightKind::area) return s.light.normal;
    if (s.light.kind == LightKind::triangle) return face_toward(s.light.normal, direction);
    return face_toward(normalize(position - s.light.position), direction);
}

DirectionMap directions_of(LightScene& s, Random& random) {
    DirectionMap map{make_frame({0, 0, 1}), 2};
    const LightKind kind = s.light.kind;
    if (kind != LightKind::spot && kind != LightKind::sun && kind != LightKind::area) return map;
    map.frame = make_frame(s.light.normal);
    float widest = 0;
    for (int i = 0; i < 20000; ++i) {
        widest = max_of(widest, 0.5f * length_squared(draw_emission(s, random).direction - s.light.normal));
    }
    map.one_minus_cos = kind == LightKind::area && s.light.spread == 0 ? 1.0f : min_of(2.0f, 1.1f * widest);
    return map;
}

// 20 fits in the four dimensions of (position, direction), of significance 1e-6: a false-alarm rate of 2e-5.
TEST(LightEmission, RaysFollowTheirDensity) {
    Random random{k_seed};
    for (LightScene& s : light_scenes()) {
        SCOPED_TRACE(s.name);
        const PositionMap positions{s};
        const bool one_direction = s.light.kind == LightKind::sun && is_delta(s.light);
        const bool one_place = is_delta(s.light) && !is_infinite(s.light);
        const DirectionMap map = one_direction ? DirectionMap{} : directions_of(s, random);
        const auto draw = [&](float (&point)[4]) {
            const Emission e = draw_emission(s, random);
            const Vec2 p = positions.point(e.position, e.direction);
            const Vec2 d = one_direction ? Vec2{0.5f, 0.5f} : map.point(e.direction);
            point[0] = p.x, point[1] = p.y, point[2] = d.x, point[3] = d.y;
            if (one_place) point[0] = random.next(), point[1] = random.next();
            if (one_direction) point[2] = random.next(), point[3] = random.next();
            return true;
        };
        const auto density = [&](const float (&point)[4]) {
            const Vec3 d = one_direction ? s.light.normal : map.direction({point[2], point[3]});
            const Vec3 p = one_place ? s.light.position : positions.position({point[0], point[1]}, d);
            const EmissionPdf pdf = pdf_emission(s.scene(), s.light, p, normal_at(s, p, d), d);
            return pdf.position * positions.area() * pdf.direction * (one_direction ? 1.0f : map.solid_angle());
        };
        const Fit fit = goodness_of_fit({4, 6, 6, 8}, 300000, 5, random, draw, density);
        EXPECT_GT(fit.p, 1e-6) << "seed " << k_seed;
        EXPECT_NEAR(fit.expected, 1, 0.005);
    }
}

TEST(LightEmission, DensitiesAndWeightsAgreeWithEmittedRadiance) {
    Random random{k_seed};
    for (LightScene& s : light_scenes()) {
        SCOPED_TRACE(s.name);
        for (int i = 0; i < 2000; ++i) {
            const Emission e = draw_emission(s, random);
            ASSERT_NEAR(length(e.direction), 1, 1e-5f);
            ASSERT_NEAR(length(e.normal), 1, 1e-5f);
            const EmissionPdf pdf = pdf_emission(s.scene(), s.light, e.position, e.normal, e.direction);
            ASSERT_NEAR(pdf.position / e.pdf_position, 1, 1e-3f);
            ASSERT_NEAR(pdf.direction / e.pdf_direction, 1, 1e-3f);
            const float cosine = is_infinite(s.light) ? 1.0f : dot(e.normal, e.direction);
            ASSERT_GT(cosine, 0);
            const Rgb expected = emitted(s.scene(), s.light, e.position, e.normal, e.direction) *
                                 (cosine / (pdf.position * pdf.direction));
            ASSERT_NEAR(e.weight.r, expected.r, 1e-3f * expected.r + 1e-4f);
            ASSERT_NEAR(e.weight.g * 3, e.weight.r * 2, 1e-5f * e.weight.r);
            ASSERT_NEAR(e.weight.b * 3, e.weight.r, 1e-5f * e.weight.r);
        }
    }
}

// 5 standard errors (6e-7 each) and 1e-4 for single precision.
TEST(LightEmission, CarriesTheWattsAskedFor) {
    Random random{k_seed};
    for (LightScene& s : light_scenes()) {
        SCOPED_TRACE(s.name);
        constexpr int k_draws = 100000;
        double sum = 0, squares = 0;
        for (int i = 0; i < k_draws; ++i) {
            const double w = static_cast<double>(draw_emission(s, random).weight.r);
            sum += w, squares += w * w;
        }
        const double mean = sum / k_draws, error = std::sqrt(max_of(0.0, squares / k_draws - mean * mean) / k_draws);
        if (s.watts >= 0) {
            EXPECT_NEAR(mean, s.watts, 5 * error + 1e-4 * s.watts) << "seed " << k_seed;
            // Of a picture, the power that lights are chosen by takes texels as even.
            const double even = s.texels.empty() ? 1e-5 : 0.05;
            EXPECT_NEAR(static_cast<double>(power(s.light, s.view.radius)), s.watts * 2 / 3, even * s.watts);
        } else {  // a stretched cone: by directions all around
            double lit = 0, lit_squares = 0;
            for (int i = 0; i < k_draws; ++i) {
                const double f = 3 * static_cast<double>(spot_falloff(s.light, sample_sphere(random.next_2d())));
                lit += f, lit_squares += f * f;
            }
            const double truth = lit / k_draws,
                         lit_error = std::sqrt((lit_squares / k_draws - truth * truth) / k_draws);
            EXPECT_NEAR(mean, truth, 5 * std::hypot(error, lit_error) + 1e-4 * truth) << "seed " << k_seed;
        }
    }
}

// The mean irradiance of a disc, once by what light paths carry onto it and once by next event from its points. Both
// means are over many draws; they may differ by 5 standard errors: 60 comparisons, a false-alarm rate of 4e-5.
TEST(LightEmission, LightsADiscAsNextEventDoes) {
    Random random{k_seed};
    constexpr float k_radius = 0.5f;
    constexpr int k_rays = 400000, k_points = 100000;
    const Vec3 axis = -turned({}).column(2), side = turned({}).column(0);
    for (LightScene& s : light_scenes()) {
        for (const Vec3 center : {k_light_position + axis * 1.3f + side * 0.2f,
                                  k_light_position + side * 1.1f + axis * 0.6f, k_light_position - axis * 1.2f}) {
            SCOPED_TRACE(s.name);
            const Vec3 normal = normalize(k_light_position - center + side * 0.5f);
            const Frame frame = make_frame(normal);
            double rays = 0, rays2 = 0, points = 0, points2 = 0;
            for (int i = 0; i < k_rays; ++i) {
                const Emission e = draw_emission(s, random);
                const float cosine = -dot(e.direction, normal);
                const float t = dot(e.position - center, normal) / cosine;
                const bool inward =
                    s.light.kind == LightKind::sphere && dot(e.position - s.light.position, e.normal) < 0;
                if (inward) continue;  // its far side stops the ray
                if (!(cosine > 0 && t > 0) || length(e.position + t * e.direction - center) > k_radius) continue;
                const double w = static_cast<double>(e.weight.r) / static_cast<double>(k_pi * square(k_radius));
                rays += w, rays2 += w * w;
            }
            for (int i = 0; i < k_points; ++i) {
                const Vec2 d = k_radius * sample_disc(random.next_2d());
                const Vec3 p = center + frame.tangent * d.x + frame.bitangent * d.y;
                const NextEvent e = sample_next_event(s.scene(), s.light, p, random.next_2d());
                const double cosine = static_cast<double>(dot(e.direction, normal));
                if (!e.valid() || cosine <= 0) continue;
                const double w = static_cast<double>(e.radiance.r / e.pdf_solid_angle) * cosine;
                points += w, points2 += w * w;
            }
            rays /= k_rays, rays2 /= k_rays, points /= k_points, points2 /= k_points;
            const double variance = (rays2 - rays * rays) / k_rays + (points2 - points * points) / k_points;
            EXPECT_NEAR(rays, points, 5 * std::sqrt(variance) + 1e-4 * points) << "seed " << k_seed;
        }
    }
}

// Smoothstep of the cosine within the blended share of the cone; a lamp stretched along its x has a cone so much wider.
TEST(LightEmission, SpotsFallOffSmoothly) {
    constexpr float k_size = 1.0f, k_blend = 0.5f;
    const Light light = make_spot(Affine{}, k_power, k_size, k_blend, 0).value();
    Affine stretch;
    stretch.m[0][0] = 2;
    const Light stretched = make_spot(stretch, k_power, k_size, k_blend, 0).value();
    const float cos_outer = std::cos(0.5f * k_size);
    for (const float x : {-0.1f, 0.1f, 0.25f, 0.5f, 0.9f, 1.1f}) {
        const float c = cos_outer + x * k_blend * (1 - cos_outer), s = std::sqrt(1 - c * c);
        const float expected = x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x);
        for (const Vec3 d : {Vec3{s, 0, -c}, Vec3{0, -s, -c}}) EXPECT_NEAR(spot_falloff(light, d), expected, 2e-5f);
        EXPECT_NEAR(spot_falloff(stretched, normalize(Vec3{2 * s, 0, -c})), expected, 2e-5f);
        EXPECT_NEAR(spot_falloff(stretched, Vec3{0, s, -c}), expected, 2e-5f);
    }
    EXPECT_EQ(spot_falloff(light, {0, 0, 1}), 0);
    EXPECT_NEAR(emitted(SceneView{}, light, {}, {}, {0, 0, -1}).r, 3 / (4 * k_pi), 1e-6f);
}

// Light paths don't start on the inner side of a lamp's sphere, though next event sees it.
TEST(LightEmission, SphereLampsShineOutward) {
    for (LightScene& s : light_scenes()) {
        if (s.name != "point_sphere" && s.name != "spot_sphere") continue;
        const NextEvent e = sample_next_event(s.scene(), s.light, k_light_position + Vec3{0.1f, 0, 0}, {0.3f, 0.6f});
        ASSERT_TRUE(e.drawn());
        EXPECT_LT(dot(e.normal, e.position - k_light_position), 0);
        const EmissionPdf pdf = pdf_emission(s.scene(), s.light, e.position, e.normal, -e.direction);
        EXPECT_EQ(pdf.position * pdf.direction, 0);
    }
}

}  // namespace
}  // namespace vlp::test
