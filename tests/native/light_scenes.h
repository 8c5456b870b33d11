// Lights to test, with the scene around them, and where a ray meets one.
#pragma once

#include <string>
#include <vector>

#include "goodness_of_fit.h"
#include "light/light.h"
#include "light/light_build.h"

namespace vlp::test {

// Turned, so that no axis hides an error; `scale` along its own axes.
inline Affine turned(Vec3 position, Vec3 scale = {1, 1, 1}) {
    const Frame f = make_frame(normalize(Vec3{0.3f, -0.5f, 0.8f}));
    const Vec3 columns[4] = {f.tangent * scale.x, f.bitangent * scale.y, f.normal * scale.z, position};
    Affine a;
    for (int j = 0; j < 4; ++j) a.m[0][j] = columns[j].x, a.m[1][j] = columns[j].y, a.m[2][j] = columns[j].z;
    return a;
}

// One light in a scene of its own.
struct LightScene {
    std::string name;
    Light light;
    double watts = 0;  // red channel of what leaves it or, if infinite, enters the scene's sphere
    uint32_t index = 0;
    SceneView view;
    std::vector<Rgb> texels;  // of the environment's picture
    EnvironmentTables tables;

    LightScene(std::string n, const std::optional<Light>& l, double w)
        : name(std::move(n)), light(l.value()), watts(w) {
        view.center = {1, -2, 0.5f};
        view.radius = 4;
    }
    const SceneView& scene() {
        view.lights = &light;
        view.light_count = 1;
        const bool listed = !is_delta(light) && !is_surface(light);
        view.infinite_lights = &index;
        view.infinite_light_count = listed && is_infinite(light) ? 1 : 0;
        view.lamps = {&index, listed && !is_infinite(light) ? 1u : 0u};
        if (!texels.empty()) {
            view.environment.texels = texels.data();
            view.environment.rows_below = tables.rows_below.data();
            view.environment.columns_below = tables.columns_below.data();
        }
        return view;
    }
};

inline constexpr Rgb k_power{3, 2, 1};
inline constexpr Vec3 k_light_position{0.5f, -1.5f, 1.0f};

// A picture of the environment: noise, a dark half, and a spot that holds most of the light; turned where asked.
inline LightScene environment_picture(const char* name, uint32_t width, uint32_t height, bool turn) {
    std::vector<Rgb> texels;
    Random random{7};
    for (uint32_t y = 0; y < height; ++y) {
        for (uint32_t x = 0; x < width; ++x) {
            const bool dark = 2 * x > width && 2 * y > height, spot = x == width / 4 && y == height / 3;
            texels.push_back(k_power * (spot ? 50.0f : dark ? 0.0f : random.next()));
        }
    }
    EnvironmentTables tables = make_environment_tables(texels, width, height);
    LightScene s(name, make_environment(tables.mean), -1);
    s.texels = std::move(texels), s.tables = std::move(tables);
    s.view.environment.width = width, s.view.environment.height = height;
    if (turn) {
        const Frame f = make_frame(normalize(Vec3{0.3f, -0.5f, 0.8f}));
        s.view.environment.to_image[0] = f.tangent;
        s.view.environment.to_image[1] = f.bitangent;
        s.view.environment.to_image[2] = f.normal;
    }
    // By midpoints much finer than the texels, times the disc that each direction comes through.
    constexpr int k_steps = 400;
    double sum = 0;
    for (int i = 0; i < k_steps; ++i) {
        for (int j = 0; j < k_steps; ++j) {
            const float z = 2 * (static_cast<float>(i) + 0.5f) / k_steps - 1, r = safe_sqrt(1 - z * z);
            const float angle = k_two_pi * (static_cast<float>(j) + 0.5f) / k_steps;
            const Vec3 d{r * std::cos(angle), r * std::sin(angle), z};
            sum += static_cast<double>(environment_radiance(s.scene().environment, s.light, d).r);
        }
    }
    s.watts = sum * 4 * static_cast<double>(k_pi) / (k_steps * k_steps) * static_cast<double>(k_pi) * 16;
    return s;
}

// Two that overlap, seen from most places.
inline Portals two_portals() {
    Portals p;
    p.count = 2;
    p.in_next_event = true;
    p.center[0] = {2.0f, -1.0f, 1.0f}, p.radius[0] = 2.2f, p.share[0] = 0.625f;
    p.center[1] = {0.0f, -3.0f, 0.0f}, p.radius[1] = 1.6f, p.share[1] = 0.375f;
    return p;
}

inline std::vector<LightScene> light_scenes() {
    const Vec3 o = k_light_position;
    const double pi = 3.14159265358979323846;
    const auto cone = [&](double size, double blend) {  // share of the sphere: smoothstep is one half on average
        return 3 * (1 - std::cos(size / 2)) * (1 - blend / 2) / 2;
    };
    const Vec3 v0{0, -1, 1}, v1{1.5f, -1.2f, 1.3f}, v2{0.4f, -2.5f, 0.8f};
    const double triangle_area = 0.5 * static_cast<double>(length(cross(v1 - v0, v2 - v0)));
    const double disc = pi * 16;
    std::vector<LightScene> s;
    s.emplace_back("point", make_point(o, k_power, 0), 3);
    s.emplace_back("point_sphere", make_point(o, k_power, 0.4f), 3);
    s.emplace_back("spot", make_spot(turned(o), k_power, 1.2f, 0.3f, 0), cone(1.2, 0.3));
    s.emplace_back("spot_hard", make_spot(turned(o), k_power, 0.6f, 0, 0), cone(0.6, 0));
    s.emplace_back("spot_sphere", make_spot(turned(o), k_power, 1.2f, 0.3f, 0.4f), cone(1.2, 0.3));
    s.emplace_back("spot_wide", make_spot(turned(o), k_power, 3.1f, 1, 0.2f), cone(3.1, 1));
    s.emplace_back("spot_scaled", make_spot(turned(o, {0.5f, 1.4f, -2}), k_power, 1.4f, 0.4f, 0.3f), -1);
    s.emplace_back("sun", make_sun(turned({}), k_power, 0), 3 * disc);
    s.emplace_back("sun_disc", make_sun(turned({}, {2, 3, 0.1f}), k_power, 0.00918f), -1);
    s.emplace_back("sun_wide", make_sun(turned({}), k_power, 2.0f), -1);
    s.emplace_back("square", make_area(turned(o), k_power, 1, 1, false, 4), 3);
    s.emplace_back("rectangle", make_area(turned(o, {2, -0.3f, 1}), k_power, 0.5f, 2, false, k_pi), 3);
    s.emplace_back("disc", make_area(turned(o), k_power, 1, 1, true, k_pi), 3);
    s.emplace_back("ellipse", make_area(turned(o, {2, 0.5f, 1}), k_power, 1, 1, true, k_pi), 3);
    s.emplace_back("square_spread", make_area(turned(o), k_power, 1, 1, false, 1.5f), 3);
    s.emplace_back("ellipse_spread", make_area(turned(o, {2, 0.5f, 1}), k_power, 1, 1, true, 0.8f), 3);
    s.emplace_back("beam", make_area(turned(o), k_power, 1, 1, false, 0.04f), 3);
    s.emplace_back("triangle", make_triangle(v0, v1, v2, k_power, 3, 7), 3 * 2 * pi * triangle_area);
    s.emplace_back("sphere", make_sphere(o, 0.5f, k_power, 2, 5), 3 * 2 * pi * 4 * pi * 0.25);
    s.emplace_back("environment", make_environment(k_power), 3 * 4 * pi * disc);
    s.push_back(environment_picture("picture", 8, 4, false));
    s.push_back(environment_picture("picture_turned", 16, 9, true));
    s.push_back(environment_picture("picture_of_few_rows", 5, 3, true));
    s.emplace_back("sun_through_portals", make_sun(turned({}), k_power, 0), 3 * disc);
    s.emplace_back("sun_wide_through_portals", make_sun(turned({}), k_power, 2.0f), -1);
    s.emplace_back("environment_through_portals", make_environment(k_power), 3 * 4 * pi * disc);
    s.push_back(environment_picture("picture_through_portals", 16, 9, true));
    for (size_t i = s.size() - 4; i < s.size(); ++i) s[i].view.light_guide.portals = two_portals();
    for (LightScene& l : s) {
        // The disc that light comes through faces each ray, not the sun's axis: 2 / (1 + cos) times the irradiance.
        if (l.light.kind == LightKind::sun) l.watts = 3 * disc * 2 / (1 + static_cast<double>(l.light.cos_outer));
    }
    return s;
}

// Where a ray first meets the light, by geometry alone where the light is a surface.
struct LightHit {
    bool found = false;
    float t = k_infinity;
    Vec3 position, normal;
};

inline LightHit hit_light(LightScene& s, const Ray& ray) {
    LightHit hit;
    const Light& light = s.light;
    if (is_infinite(light)) {
        for_each_infinite_light(s.scene(), ray.direction, [&](uint32_t) { hit.found = true; });
        hit.normal = -ray.direction;
    } else if (light.kind == LightKind::triangle) {  // Möller & Trumbore 1997
        const Vec3 p = cross(ray.direction, light.axis_v), q = cross(ray.origin - light.position, light.axis_u);
        const float determinant = dot(light.axis_u, p);
        const float u = dot(ray.origin - light.position, p) / determinant, v = dot(ray.direction, q) / determinant;
        hit.t = dot(light.axis_v, q) / determinant;
        hit.found = u >= 0 && v >= 0 && u + v <= 1 && hit.t > 0;
        hit.position = ray.origin + hit.t * ray.direction;
        hit.normal = emission_normal(light, hit.position, -ray.direction);
    } else if (light.kind == LightKind::sphere) {
        // In double: the textbook formula loses too many digits from afar.
        const Vec3 c = ray.origin - light.position, d = ray.direction;
        const double dd = double{d.x} * d.x + double{d.y} * d.y + double{d.z} * d.z;
        const double b = (double{c.x} * d.x + double{c.y} * d.y + double{c.z} * d.z) / dd;
        const double cc = (double{c.x} * c.x + double{c.y} * c.y + double{c.z} * c.z) / dd;
        const double root = b * b - cc + double{light.radius} * light.radius / dd;
        if (root < 0) return hit;
        const double near = -b - std::sqrt(root), far = -b + std::sqrt(root);
        hit.t = static_cast<float>(near > 0 ? near : far);
        hit.found = hit.t > 0;
        hit.position = ray.origin + hit.t * ray.direction;
        hit.normal = emission_normal(light, hit.position, -ray.direction);
    } else {
        for_each_lamp_hit(s.scene(), ray,
                          [&](uint32_t, float t, Vec3 position, Vec3 normal) { hit = {true, t, position, normal}; });
    }
    return hit;
}

}  // namespace vlp::test
