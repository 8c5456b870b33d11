// Lights from Blender's parameters, and how often each is chosen.
#include "light/light_build.h"

#include <algorithm>
#include <limits>
#include <numbers>

namespace vlp {
namespace {

// Sums and products in double, so that the units hold to single precision.
constexpr double k_pi_d = std::numbers::pi;

Rgb scaled(Rgb c, double s) {
    return {static_cast<float>(c.r * s), static_cast<float>(c.g * s), static_cast<float>(c.b * s)};
}

double length_d(Vec3 a) { return std::sqrt(double{a.x} * a.x + double{a.y} * a.y + double{a.z} * a.z); }

bool is_positive(double x) { return x > 0 && std::isfinite(static_cast<float>(x)); }

}  // namespace

std::optional<Light> make_point(Vec3 position, Rgb power, float radius) {
    if (!is_finite(position) || !is_finite(power) || !(radius >= 0) || !is_finite(radius)) return std::nullopt;
    Light light;
    light.kind = LightKind::point;
    light.position = position;
    const double r2 = double{radius} * radius;
    light.area = static_cast<float>(4 * k_pi_d * r2);
    if (!is_positive(light.area) || !is_positive(1.0 / light.area)) light.area = 0;
    light.radius = light.area > 0 ? radius : 0;  // one that underflows is a point
    light.radiance = scaled(power, light.radius > 0 ? 1 / (4 * k_pi_d * k_pi_d * r2) : 1 / (4 * k_pi_d));
    return light;
}

std::optional<Light> make_spot(const Affine& transform, Rgb power, float spot_size, float blend, float radius) {
    std::optional<Light> light = make_point(transform.column(3), power, radius);
    const Affine to_local = inverse(transform);
    const Vec3 x = to_local.row(0), y = to_local.row(1), z = to_local.row(2);
    const float l = length(z);
    if (!light || !is_positive(l) || !is_finite(x) || !is_finite(y) || !(spot_size > 0)) return std::nullopt;
    light->kind = LightKind::spot;
    light->axis_u = x / l;
    light->axis_v = y / l;
    light->normal = -z / l;
    light->cos_outer = static_cast<float>(std::cos(std::min(double{spot_size}, 2 * k_pi_d) / 2));
    light->blend = clamp(blend, 0.0f, 1.0f);
    return light;
}

std::optional<Light> make_sun(const Affine& transform, Rgb irradiance, float angle) {
    const Vec3 back = transform.column(2);
    const double l = length_d(back);
    if (!is_positive(l) || !is_positive(1 / l) || !is_finite(irradiance) || !(angle >= 0)) return std::nullopt;
    Light light;
    light.kind = LightKind::sun;
    light.normal = normalize(-back / static_cast<float>(l));
    const double half = std::min(double{angle}, k_pi_d) / 2, sine = std::sin(half);
    light.radius = static_cast<float>(sine);
    if (!is_positive(square(light.radius))) light.radius = 0;
    light.cos_outer = light.radius > 0 ? static_cast<float>(std::cos(half)) : 1;
    light.radiance = light.radius > 0 ? scaled(irradiance, 1 / (k_pi_d * sine * sine)) : irradiance;
    return light;
}

std::optional<Light> make_area(const Affine& transform, Rgb power, float size_x, float size_y, bool ellipse,
                               float spread) {
    const Vec3 u = transform.column(0) * (0.5f * size_x), v = transform.column(1) * (0.5f * size_y);
    const double lu = length_d(u), lv = length_d(v);
    if (!is_finite(transform.column(3)) || !is_finite(power) || !is_positive(lu) || !is_positive(lv))
        return std::nullopt;
    const Vec3 x = u / static_cast<float>(lu);
    const Vec3 upright = v - x * dot(x, v);
    const double height = length_d(upright);
    if (!(height > 1e-6 * lv) || std::isnan(spread)) return std::nullopt;
    Light light;
    light.kind = LightKind::area;
    light.ellipse = ellipse;
    light.position = transform.column(3);
    light.axis_u = x;
    light.axis_v = upright / static_cast<float>(height);
    light.half_size = {static_cast<float>(lu), static_cast<float>(height)};
    light.normal = normalize(cross(light.axis_u, light.axis_v));
    if (dot(light.normal, transform.column(2)) > 0) light.normal = -light.normal;
    const double area = (ellipse ? k_pi_d : 4.0) * lu * height;
    light.area = static_cast<float>(area);
    if (!is_positive(light.area) || !is_positive(1.0 / light.area)) return std::nullopt;

    // The power of radiance 1 - tan x / tan a up to a = spread / 2 is pi area (1 - a cot a).
    const double a = std::max(double{spread}, 1e-3) / 2;
    const double cot = a < k_pi_d / 2 - 1e-6 ? std::cos(a) / std::sin(a) : 0;
    const double share = a < 0.01 ? a * a / 3 * (1 + a * a / 15) : 1 - std::min(a, k_pi_d / 2) * cot;
    light.spread = static_cast<float>(cot);
    light.spread_share = static_cast<float>(share);
    light.radiance = scaled(power, 1 / (k_pi_d * area * share));
    return light;
}

std::optional<Light> make_triangle(Vec3 v0, Vec3 v1, Vec3 v2, Rgb radiance, uint32_t instance, uint32_t primitive) {
    Light light;
    light.kind = LightKind::triangle;
    light.instance = instance;
    light.primitive = primitive;
    light.radiance = radiance;
    light.position = v0;
    light.axis_u = v1 - v0;
    light.axis_v = v2 - v0;
    const Vec3 n = cross(light.axis_u, light.axis_v);
    light.area = static_cast<float>(0.5 * length_d(n));
    if (!is_finite(v0) || !is_finite(radiance) || !is_positive(light.area) || !is_positive(1.0 / light.area)) {
        return std::nullopt;
    }
    light.normal = normalize(n / (2 * light.area));
    return light;
}

std::optional<Light> make_sphere(Vec3 center, float radius, Rgb radiance, uint32_t instance, uint32_t primitive) {
    Light light;
    light.kind = LightKind::sphere;
    light.instance = instance;
    light.primitive = primitive;
    light.radiance = radiance;
    light.position = center;
    light.radius = radius;
    light.area = static_cast<float>(4 * k_pi_d * radius * radius);
    if (!is_finite(center) || !is_finite(radiance) || !(radius > 0) || !is_positive(light.area) ||
        !is_positive(1.0 / light.area)) {
        return std::nullopt;
    }
    return light;
}

Light make_environment(Rgb mean_radiance) {
    Light light;
    light.kind = LightKind::environment;
    light.radiance = mean_radiance;
    return light;
}

EnvironmentTables make_environment_tables(std::span<const Rgb> texels, uint32_t width, uint32_t height) {
    EnvironmentTables tables;
    std::vector<double> in_row(width), rows(height);
    double mean[3] = {0, 0, 0}, area = 0;
    const auto at = [&](size_t x, size_t y) { return texels[y * width + x]; };
    for (size_t y = 0; y < height; ++y) {
        const double sin_theta = std::sin(k_pi_d * (static_cast<double>(y) + 0.5) / height);
        const size_t below = y > 0 ? y - 1 : 0, above = std::min<size_t>(y + 1, height - 1);
        double row = 0;
        for (size_t x = 0; x < width; ++x) {
            // What joining texels linearly leaves in this one: light of all its neighbours.
            const size_t left = (x + width - 1) % width, right = (x + 1) % width;
            double weight = 0;
            for (const size_t j : {below, y, above}) {
                weight += 0.25 *
                          static_cast<double>(average(at(left, j)) + 2 * average(at(x, j)) + average(at(right, j))) *
                          (j == y ? 2 : 1);
            }
            in_row[x] = weight;
            row += weight;
            mean[0] += sin_theta * static_cast<double>(at(x, y).r);
            mean[1] += sin_theta * static_cast<double>(at(x, y).g);
            mean[2] += sin_theta * static_cast<double>(at(x, y).b);
            area += sin_theta;
        }
        rows[y] = row * sin_theta;
        const std::vector<uint32_t> columns = make_distribution(in_row);
        tables.columns_below.insert(tables.columns_below.end(), columns.begin(), columns.end());
    }
    tables.rows_below = make_distribution(rows);
    tables.mean = {static_cast<float>(mean[0] / area), static_cast<float>(mean[1] / area),
                   static_cast<float>(mean[2] / area)};
    return tables;
}

float power(const Light& light, float scene_radius) {
    const auto size = [](float x) { return std::fabs(double{x}); };  // Blender's lamps may take light away
    const double mean = (size(light.radiance.r) + size(light.radiance.g) + size(light.radiance.b)) / 3;
    const double disc = k_pi_d * scene_radius * scene_radius;
    double watts = 0;
    switch (light.kind) {
        case LightKind::point:
            watts = mean * (light.radius > 0 ? k_pi_d * light.area : 4 * k_pi_d);
            break;
        case LightKind::spot: {
            // Smoothstep is one half on average, over the blended share of the cone; the map to the lamp's space is
            // left out, which only a strongly stretched lamp would notice.
            const double cone = 2 * k_pi_d * (1 - light.cos_outer) * (1 - 0.5 * light.blend);
            watts = mean * cone * (light.radius > 0 ? k_pi_d * light.radius * light.radius : 1);
            break;
        }
        case LightKind::sun: {
            const double solid_angle = 2 * k_pi_d * light.radius * light.radius / (1 + light.cos_outer);
            watts = mean * disc * (light.radius > 0 ? solid_angle : 1);
            break;
        }
        case LightKind::area:
            watts = mean * k_pi_d * light.area * light.spread_share;
            break;
        case LightKind::triangle:
        case LightKind::sphere:
            watts = mean * 2 * k_pi_d * light.area;
            break;
        case LightKind::environment:
            watts = mean * 4 * k_pi_d * disc;
            break;
    }
    return static_cast<float>(std::min(watts, double{std::numeric_limits<float>::max()}));
}

std::vector<uint32_t> make_distribution(std::span<const double> weights) {
    const auto part = [](double w) { return w > 0 ? std::min(w, 1e290) : 0; };
    double total = 0;
    for (const double w : weights) total += part(w);
    // Entry i starts after one number for each entry before it and their share of the numbers that are left.
    const double count = static_cast<double>(weights.size()), left = 4294967296.0 - count;
    std::vector<uint32_t> below(weights.size());
    double sum = 0;
    for (size_t i = 0; i < weights.size(); ++i) {
        const double share = total > 0 ? sum / total : static_cast<double>(i) / count;
        below[i] = static_cast<uint32_t>(std::min(share, 1.0) * left) + static_cast<uint32_t>(i);
        sum += part(weights[i]);
    }
    return below;
}

}  // namespace vlp
