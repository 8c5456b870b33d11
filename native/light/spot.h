// Spot lamps: point lamps whose light fades to nothing at the edge of a cone.
//
// The cone lives in the lamp's own space, so that a scaled lamp has an elliptic one: axis_u, axis_v and normal are the
// rows of the map from world directions to that space, the last turned to look where the lamp shines.
// From within the lamp's sphere Cycles sees no falloff; here the direction alone decides, on both sides.
#pragma once

#include "light/point.h"

namespace vlp {

VLP_HD inline Vec3 spot_to_local(const Light& light, Vec3 direction) {
    return {dot(light.axis_u, direction), dot(light.axis_v, direction), dot(light.normal, direction)};
}

// Share of the intensity on the axis that leaves in `direction`: smooth in the cosine, over the share `blend` of the
// cone.
VLP_HD inline float spot_falloff(const Light& light, Vec3 direction) {
    const Vec3 local = spot_to_local(light, direction);
    const float above = local.z / length(local) - light.cos_outer;
    if (!(above > 0)) return 0;
    const float width = (1 - light.cos_outer) * light.blend;
    if (above >= width) return 1;
    const float x = above / width;
    return x * x * (3 - 2 * x);
}

VLP_HD inline Rgb spot_emitted(const Light& light, Vec3 normal, Vec3 direction) {
    return point_emitted(light, normal, direction) * spot_falloff(light, direction);
}

// Directions are uniform in the cone of the lamp's space; in the world by |det| / |local|³, the change of solid angle
// under a linear map.
VLP_HD inline float spot_pdf_direction(const Light& light, Vec3 direction) {
    const Vec3 local = spot_to_local(light, direction);
    const float l = length(local);
    if (!(local.z > light.cos_outer * l)) return 0;
    const float determinant = std::fabs(dot(light.axis_u, cross(light.axis_v, light.normal)));
    return pdf_cone(1 - light.cos_outer) * determinant / (l * l * l);
}

VLP_HD inline Vec3 spot_sample_direction(const Light& light, Vec2 u) {
    const Vec3 local = sample_cone(u, 1 - light.cos_outer);
    const Vec3 c0 = cross(light.axis_v, light.normal), c1 = cross(light.normal, light.axis_u),
               c2 = cross(light.axis_u, light.axis_v);
    const Vec3 world = local.x * c0 + local.y * c1 + local.z * c2;
    return normalize(dot(light.axis_u, c0) < 0 ? -world : world);
}

// With a radius: first the direction, then a point of the half sphere that faces it, uniform on the disc that it shows;
// so that the weight varies with the falloff alone.
VLP_HD inline Emission spot_sample_emission(const Light& light, Vec2 u_position, Vec2 u_direction) {
    Emission e;
    e.direction = spot_sample_direction(light, u_direction);
    e.pdf_direction = spot_pdf_direction(light, e.direction);
    const float falloff = e.pdf_direction > 0 ? spot_falloff(light, e.direction) / e.pdf_direction : 0.0f;
    if (light.radius == 0) {
        e.position = light.position;
        e.normal = e.direction;
        e.pdf_position = 1;
        e.weight = light.radiance * falloff;
        return e;
    }
    const Vec3 local = sample_cosine(u_position);
    const float disc_area = k_pi * square(light.radius);
    e.normal = make_frame(e.direction).to_world(local);
    e.position = light.position + light.radius * e.normal;
    e.pdf_position = local.z / disc_area;
    if (local.z > 0) e.weight = light.radiance * (falloff * disc_area);
    return e;
}

VLP_HD inline EmissionPdf spot_pdf_emission(const Light& light, Vec3 position, Vec3 normal, Vec3 direction) {
    const float pdf_direction = spot_pdf_direction(light, direction);
    if (light.radius == 0) return {1, pdf_direction};
    const float cosine = dot(normal, direction);
    if (cosine <= 0 || dot(position - light.position, normal) <= 0) return {};
    return {cosine / (k_pi * square(light.radius)), pdf_direction};
}

VLP_HD inline NextEvent spot_sample_next_event(const Light& light, Vec3 receiver, Vec2 u) {
    NextEvent e = point_sample_next_event(light, receiver, u);
    e.radiance *= spot_falloff(light, -e.direction);
    return e;
}

}  // namespace vlp
