// The environment: radiance from every direction, constant or an equirectangular picture of it.
//
// Pictures are looked up as Cycles does: u = 1/2 - atan2(y, x) / 2 pi to the right, v = 1/2 + asin(z) / pi upwards, texels
// joined linearly. They are drawn from by a table over their texels, first a row and then a column of it, and evenly in u and v
// within a texel: the density per solid angle is that of (u, v) over 2 pi^2 sin(theta), theta being the angle from the
// pole below (Pharr, Jakob & Humphreys, 12.5).
#pragma once

#include "core/distribution.h"
#include "light/sun.h"

namespace vlp {

VLP_HD inline Vec3 environment_to_image(const EnvironmentView& e, Vec3 d) {
    return {dot(e.to_image[0], d), dot(e.to_image[1], d), dot(e.to_image[2], d)};
}
VLP_HD inline Vec3 environment_to_world(const EnvironmentView& e, Vec3 d) {
    return e.to_image[0] * d.x + e.to_image[1] * d.y + e.to_image[2] * d.z;
}

// A direction of the picture in texels: x from 0 to width, y from 0 to height.
VLP_HD inline Vec2 environment_texel(const EnvironmentView& e, Vec3 d) {
    const float u = 0.5f - std::atan2(d.y, d.x) / k_two_pi;
    const float v = 0.5f + std::atan2(d.z, std::sqrt(d.x * d.x + d.y * d.y)) * k_inv_pi;
    return {u * static_cast<float>(e.width), v * static_cast<float>(e.height)};
}

VLP_HD inline uint32_t environment_index(float x, uint32_t count) {
    return x > 0 ? min_of(static_cast<uint32_t>(x), count - 1) : 0u;
}

// Radiance that comes from `direction` (unit, away from the scene).
VLP_HD inline Rgb environment_radiance(const EnvironmentView& e, const Light& light, Vec3 direction) {
    if (e.texels == nullptr) return light.radiance;
    const Vec2 p = environment_texel(e, environment_to_image(e, direction));
    const float x = p.x - 0.5f, y = clamp(p.y - 0.5f, 0.0f, static_cast<float>(e.height - 1));
    const float left = std::floor(x), below = std::floor(y), across = x - left, up = y - below;
    const auto column = [&](float c) { return c < 0 ? e.width - 1 : static_cast<uint32_t>(c) % e.width; };
    const uint32_t y0 = static_cast<uint32_t>(below), y1 = min_of(y0 + 1, e.height - 1);
    const uint32_t x0 = column(left), x1 = column(left + 1);
    const Rgb* const row0 = e.texels + static_cast<size_t>(y0) * e.width;
    const Rgb* const row1 = e.texels + static_cast<size_t>(y1) * e.width;
    return (row0[x0] * (1 - across) + row0[x1] * across) * (1 - up) +
           (row1[x0] * (1 - across) + row1[x1] * across) * up;
}

VLP_HD inline Distribution environment_columns(const EnvironmentView& e, uint32_t row) {
    return {e.columns_below + static_cast<size_t>(row) * e.width, e.width};
}

VLP_HD inline float environment_texel_pdf(const EnvironmentView& e, float pdf_texel, float sin_theta) {
    const float texels = static_cast<float>(e.width) * static_cast<float>(e.height);
    return pdf_texel * texels / (2 * k_pi * k_pi * max_of(sin_theta, 1e-7f));
}

// Density per solid angle of `environment_sample`.
VLP_HD inline float environment_pdf(const EnvironmentView& e, Vec3 direction) {
    if (e.texels == nullptr) return pdf_cone(2.0f);
    const Vec3 d = environment_to_image(e, direction);
    const Vec2 p = environment_texel(e, d);
    const uint32_t row = environment_index(p.y, e.height), column = environment_index(p.x, e.width);
    const float pdf_texel = pdf(Distribution{e.rows_below, e.height}, row) * pdf(environment_columns(e, row), column);
    return environment_texel_pdf(e, pdf_texel, std::sqrt(d.x * d.x + d.y * d.y));
}

// A direction away from the scene, and its density.
struct EnvironmentSample {
    Vec3 direction;
    float pdf_solid_angle;
};

VLP_HD inline EnvironmentSample environment_sample(const EnvironmentView& e, Vec2 u) {
    if (e.texels == nullptr) return {sample_sphere(u), pdf_cone(2.0f)};
    float in_row, in_column;
    const DiscreteSample row = sample({e.rows_below, e.height}, u.y, in_row);
    const DiscreteSample column = sample(environment_columns(e, row.index), u.x, in_column);
    const float theta = k_pi * (static_cast<float>(row.index) + in_row) / static_cast<float>(e.height);
    const float azimuth =
        k_two_pi * (0.5f - (static_cast<float>(column.index) + in_column) / static_cast<float>(e.width));
    const float sin_theta = std::sin(theta);
    const Vec3 d{sin_theta * std::cos(azimuth), sin_theta * std::sin(azimuth), -std::cos(theta)};
    return {environment_to_world(e, d), environment_texel_pdf(e, row.pdf * column.pdf, sin_theta)};
}

VLP_HD inline Emission environment_sample_emission(const EnvironmentView& environment, const Light& light,
                                                   const Portals& portals, Vec3 center, float radius, Vec2 u_position,
                                                   Vec2 u_direction) {
    const EnvironmentSample from = environment_sample(environment, u_direction);
    Emission e;
    e.direction = e.normal = -from.direction;
    e.position = sample_scene_disc(portals, center, radius, e.direction, u_position);
    e.pdf_position = pdf_scene_disc(portals, radius, e.position, e.direction);
    e.pdf_direction = from.pdf_solid_angle;
    e.weight = environment_radiance(environment, light, from.direction) / (e.pdf_position * e.pdf_direction);
    return e;
}

// Density per solid angle of next event at `receiver`.
VLP_HD inline float environment_pdf_next_event(const EnvironmentView& environment, const Portals& portals,
                                               Vec3 receiver, Vec3 direction) {
    const float anywhere = environment_pdf(environment, direction);
    return portals.in_next_event ? pdf_through_portals(portals, anywhere, receiver, direction) : anywhere;
}

VLP_HD inline NextEvent environment_sample_next_event(const EnvironmentView& environment, const Light& light,
                                                      const Portals& portals, float scene_radius, Vec3 receiver,
                                                      Vec2 u) {
    EnvironmentSample from{};
    const uint32_t portal = portals.in_next_event ? choose_portal(portals, u.x) : k_none;
    if (portal == k_none || !sample_through_portal(portals, portal, receiver, u, from.direction)) {
        from = environment_sample(environment, u);
    }
    if (portals.in_next_event) {
        from.pdf_solid_angle = environment_pdf_next_event(environment, portals, receiver, from.direction);
    }
    NextEvent e;
    e.direction = from.direction;
    e.normal = -e.direction;
    e.position = beyond_scene(receiver, e.direction, scene_radius);
    e.distance = k_infinity;
    e.radiance = environment_radiance(environment, light, e.direction);
    e.pdf_solid_angle = from.pdf_solid_angle;
    return e;
}

}  // namespace vlp
