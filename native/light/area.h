// Area lamps: one-sided rectangles and ellipses, Lambertian or narrowed by a spread.
//
// Spread s < pi multiplies the radiance by 1 - tan(angle) / tan(s / 2), what a grid of slats in front of the lamp would
// let through. light.spread holds cot(s / 2), 0 for a Lambertian lamp, so that one formula serves both;
// light.spread_share is the share of a Lambertian lamp's power that is left.
#pragma once

#include "core/frame.h"
#include "core/ray.h"
#include "core/warp.h"
#include "light/light_data.h"
#include "light/light_sample.h"
#include "light/spherical_rectangle.h"

namespace vlp {

// Share of the radiance along the normal that leaves in `direction`; 0 behind.
VLP_HD inline float area_spread(const Light& light, Vec3 direction) {
    const float cosine = dot(light.normal, direction);
    if (cosine <= 0) return 0;
    return light.spread == 0 ? 1.0f : max_of(0.0f, 1 - light.spread * length(cross(light.normal, direction)) / cosine);
}

VLP_HD inline Rgb area_emitted(const Light& light, Vec3 direction) {
    return light.radiance * area_spread(light, direction);
}

// Square of the sine of the widest angle that light leaves at.
VLP_HD inline float area_sin_squared(const Light& light) { return 1 / (1 + square(light.spread)); }

// The point of the lamp's plane that lies so far from the centre, along the sides.
VLP_HD inline Vec3 area_point(const Light& light, Vec2 p) {
    return light.position + light.axis_u * p.x + light.axis_v * p.y;
}

VLP_HD inline bool is_in_ellipse(const Light& light, Vec2 p) {
    return square(p.x / light.half_size.x) + square(p.y / light.half_size.y) <= 1;
}

VLP_HD inline Emission area_sample_emission(const Light& light, Vec2 u_position, Vec2 u_direction) {
    const Vec2 p = light.ellipse ? sample_disc(u_position) : Vec2{2 * u_position.x - 1, 2 * u_position.y - 1};
    const float sin_squared = area_sin_squared(light), projected_angle = k_pi * sin_squared;
    const Vec3 local = sample_cosine(u_direction, std::sqrt(sin_squared));
    Emission e;
    e.position = area_point(light, {p.x * light.half_size.x, p.y * light.half_size.y});
    e.normal = light.normal;
    e.direction = make_frame(light.normal).to_world(local);
    e.pdf_position = 1 / light.area;
    e.pdf_direction = local.z / projected_angle;
    if (local.z > 0) e.weight = area_emitted(light, e.direction) * (light.area * projected_angle);
    return e;
}

VLP_HD inline EmissionPdf area_pdf_emission(const Light& light, Vec3 direction) {
    const float cosine = dot(light.normal, direction), sin_squared = area_sin_squared(light);
    if (cosine <= 0) return {};
    if (light.spread > 0 && length_squared(cross(light.normal, direction)) > sin_squared) return {};
    return {1 / light.area, cosine * k_inv_pi / sin_squared};
}

// What next event draws from for one receiver: the part of the rectangle around the lamp that may shine on it, by solid
// angle or, where that is too small to measure, by area; or the ellipse by area.
enum class AreaDraw : uint8_t { nothing, ellipse, rectangle, solid_angle };

struct AreaAspect {
    AreaDraw draw = AreaDraw::nothing;
    Vec2 foot;  // the receiver's foot on the lamp's plane, from the centre
    float reach = 0;  // no light comes from farther away on the plane
    SeenRectangle seen;  // around the foot
    SphericalRectangle spherical;
};

// Below this many steradians single precision can't measure the angle, and drawing by area is as good.
inline constexpr float k_min_rectangle_angle = 1e-3f;

VLP_HD inline AreaAspect area_aspect(const Light& light, Vec3 receiver) {
    AreaAspect a;
    const Vec3 from_light = receiver - light.position;
    const float height = dot(from_light, light.normal);
    if (!(height > 0)) return a;
    const Vec2 half = light.half_size;
    a.foot = {dot(from_light, light.axis_u), dot(from_light, light.axis_v)};
    a.reach = height / light.spread;
    a.seen.low = {max_of(-half.x - a.foot.x, -a.reach), max_of(-half.y - a.foot.y, -a.reach)};
    a.seen.high = {min_of(half.x - a.foot.x, a.reach), min_of(half.y - a.foot.y, a.reach)};
    a.seen.height = height;
    if (!(a.seen.low.x < a.seen.high.x && a.seen.low.y < a.seen.high.y)) return a;
    if (light.ellipse && area(a.seen) >= light.area) {
        a.draw = AreaDraw::ellipse;
        return a;
    }
    a.spherical = make_spherical(a.seen);
    a.draw = a.spherical.solid_angle > k_min_rectangle_angle ? AreaDraw::solid_angle : AreaDraw::rectangle;
    return a;
}

// Density per solid angle of the point `p` of the lamp's plane, counted from the foot.
VLP_HD inline float area_pdf(const Light& light, const AreaAspect& a, Vec2 p) {
    if (a.draw == AreaDraw::nothing) return 0;
    if (a.draw == AreaDraw::solid_angle) return 1 / a.spherical.solid_angle;
    const float distance2 = p.x * p.x + p.y * p.y + square(a.seen.height);
    const float pdf_area = 1 / (a.draw == AreaDraw::ellipse ? light.area : area(a.seen));
    return to_solid_angle(pdf_area, distance2, a.seen.height / std::sqrt(distance2));
}

VLP_HD inline NextEvent area_sample_next_event(const Light& light, Vec3 receiver, Vec2 u) {
    const AreaAspect a = area_aspect(light, receiver);
    NextEvent e;
    Vec2 p;
    switch (a.draw) {
        case AreaDraw::nothing:
            return e;
        case AreaDraw::ellipse: {
            const Vec2 disc = sample_disc(u);
            p = {disc.x * light.half_size.x - a.foot.x, disc.y * light.half_size.y - a.foot.y};
            break;
        }
        case AreaDraw::rectangle:
            p = {lerp(a.seen.low.x, a.seen.high.x, u.x), lerp(a.seen.low.y, a.seen.high.y, u.y)};
            break;
        case AreaDraw::solid_angle:
            p = sample(a.seen, a.spherical, u);
            break;
    }
    const Vec2 on_lamp = p + a.foot;
    const bool outside = light.ellipse && !is_in_ellipse(light, on_lamp);
    const Vec3 to_light = light.axis_u * p.x + light.axis_v * p.y - light.normal * a.seen.height;
    e.position = area_point(light, on_lamp);
    e.normal = light.normal;
    e.distance = length(to_light);
    e.direction = to_light / e.distance;
    e.radiance = area_emitted(light, -e.direction);
    e.pdf_solid_angle = outside ? 0 : area_pdf(light, a, p);
    return e;
}

VLP_HD inline float area_pdf_next_event(const Light& light, Vec3 receiver, Vec3 position) {
    const AreaAspect a = area_aspect(light, receiver);
    if (a.draw == AreaDraw::nothing) return 0;
    const Vec3 on_lamp = position - light.position;
    const Vec2 p{dot(on_lamp, light.axis_u) - a.foot.x, dot(on_lamp, light.axis_v) - a.foot.y};
    const bool clipped = std::fabs(p.x) > a.reach || std::fabs(p.y) > a.reach;
    return clipped && a.draw != AreaDraw::ellipse ? 0 : area_pdf(light, a, p);
}

// Where a ray meets the lamp's front.
VLP_HD inline bool area_intersect(const Light& light, const Ray& ray, float& t) {
    const float cosine = -dot(light.normal, ray.direction);
    if (!(cosine > 0)) return false;
    const Vec3 from_light = ray.origin - light.position;
    t = dot(from_light, light.normal) / cosine;
    if (!(t > 0 && t < ray.t_max)) return false;
    const Vec3 p = from_light + t * ray.direction;
    const Vec2 q{dot(p, light.axis_u), dot(p, light.axis_v)};
    return light.ellipse ? is_in_ellipse(light, q)
                         : std::fabs(q.x) <= light.half_size.x && std::fabs(q.y) <= light.half_size.y;
}

}  // namespace vlp
