// Every light behind one switch: what it emits, how it is sampled from either end of a path, and where rays hit it.
#pragma once

#include "light/area.h"
#include "light/environment.h"
#include "light/lamp_tree.h"
#include "light/mesh.h"
#include "light/point.h"
#include "light/spot.h"
#include "light/sun.h"
#include "scene/scene_view.h"

namespace vlp {

// The end of the path is a direction: densities are per solid angle.
VLP_HD inline bool is_infinite(const Light& light) {
    return light.kind == LightKind::sun || light.kind == LightKind::environment;
}

// No ray can hit it: points and suns without an extent.
VLP_HD inline bool is_delta(const Light& light) {
    const bool lamp = light.kind == LightKind::point || light.kind == LightKind::spot || light.kind == LightKind::sun;
    return lamp && light.radius == 0;
}

// An emitting primitive of the scene's surfaces.
VLP_HD inline bool is_surface(const Light& light) {
    return light.kind == LightKind::triangle || light.kind == LightKind::sphere;
}

// The normal of an emitting surface at `position`, on the side that `direction` leaves from.
VLP_HD inline Vec3 emission_normal(const Light& light, Vec3 position, Vec3 direction) {
    const Vec3 n = light.kind == LightKind::sphere ? normalize(position - light.position) : light.normal;
    return face_toward(n, direction);
}

// Radiance that leaves the point `position` with emission normal `normal` in `direction` (unit, away from the light,
// for infinite lights the way that light travels). Points without an extent: intensity; delta suns: irradiance.
VLP_HD inline Rgb emitted(const SceneView& scene, const Light& light, Vec3 /*position*/, Vec3 normal, Vec3 direction) {
    switch (light.kind) {
        case LightKind::point:
            return point_emitted(light, normal, direction);
        case LightKind::spot:
            return spot_emitted(light, normal, direction);
        case LightKind::sun:
            return sun_emitted(light, direction);
        case LightKind::area:
            return area_emitted(light, direction);
        case LightKind::triangle:
        case LightKind::sphere:
            return light.radiance;
        case LightKind::environment:
            return environment_radiance(scene.environment, light, -direction);
    }
    return {};
}

VLP_HD inline Emission sample_emission(const SceneView& scene, const Light& light, Vec2 u_position, Vec2 u_direction) {
    switch (light.kind) {
        case LightKind::point:
            return point_sample_emission(light, u_position, u_direction);
        case LightKind::spot:
            return spot_sample_emission(light, u_position, u_direction);
        case LightKind::sun:
            return sun_sample_emission(light, scene.light_guide.portals, scene.center, scene.radius, u_position,
                                       u_direction);
        case LightKind::area:
            return area_sample_emission(light, u_position, u_direction);
        case LightKind::triangle:
            return triangle_sample_emission(light, u_position, u_direction);
        case LightKind::sphere:
            return sphere_sample_emission(light, u_position, u_direction);
        case LightKind::environment:
            return environment_sample_emission(scene.environment, light, scene.light_guide.portals, scene.center,
                                               scene.radius, u_position, u_direction);
    }
    return {};
}

// The densities of the ray from `position` in `direction`, their product being that of `sample_emission`. 0 where no
// light path starts: the inner side of a lamp's sphere, directions that the lamp does not shine in. `position`: of an infinite
// light any point of the ray.
VLP_HD inline EmissionPdf pdf_emission(const SceneView& scene, const Light& light, Vec3 position, Vec3 normal,
                                       Vec3 direction) {
    switch (light.kind) {
        case LightKind::point:
            return point_pdf_emission(light, position, normal, direction);
        case LightKind::spot:
            return spot_pdf_emission(light, position, normal, direction);
        case LightKind::sun:
            return sun_pdf_emission(light, scene.light_guide.portals, scene.radius, position, direction);
        case LightKind::area:
            return area_pdf_emission(light, direction);
        case LightKind::triangle:
        case LightKind::sphere:
            return surface_pdf_emission(light, position, normal, direction);
        case LightKind::environment:
            return {pdf_scene_disc(scene.light_guide.portals, scene.radius, position, direction),
                    environment_pdf(scene.environment, -direction)};
    }
    return {};
}

VLP_HD inline NextEvent sample_next_event(const SceneView& scene, const Light& light, Vec3 receiver, Vec2 u) {
    switch (light.kind) {
        case LightKind::point:
            return point_sample_next_event(light, receiver, u);
        case LightKind::spot:
            return spot_sample_next_event(light, receiver, u);
        case LightKind::sun:
            return sun_sample_next_event(light, scene.radius, receiver, u);
        case LightKind::area:
            return area_sample_next_event(light, receiver, u);
        case LightKind::triangle: {
            NextEvent e = triangle_sample_next_event(light, receiver, u);
            e.surface = {light.instance, light.primitive};
            return e;
        }
        case LightKind::sphere: {
            NextEvent e = sample_sphere_shape(light.position, light.radius, receiver, u);
            e.radiance = light.radiance;
            e.surface = {light.instance, light.primitive};
            return e;
        }
        case LightKind::environment:
            return environment_sample_next_event(scene.environment, light, scene.light_guide.portals, scene.radius,
                                                 receiver, u);
    }
    return {};
}

// Density per solid angle at `receiver` with which next event finds the light's point `position`, which lies in
// `direction` and whose emission normal is `normal`. 0 for delta lights and for points that it never draws.
VLP_HD inline float pdf_next_event(const SceneView& scene, const Light& light, Vec3 receiver, Vec3 position,
                                   Vec3 normal, Vec3 direction) {
    switch (light.kind) {
        case LightKind::point:
        case LightKind::spot:
            return point_pdf_next_event(light, receiver, position, normal);
        case LightKind::sun:
            return light.radius == 0 ? 0 : sun_pdf_direction(light, -direction);
        case LightKind::area:
            return area_pdf_next_event(light, receiver, position);
        case LightKind::triangle:
            return triangle_pdf_next_event(light, receiver, position, direction);
        case LightKind::sphere:
            return pdf_sphere_shape(light.position, light.radius, receiver, position, normal);
        case LightKind::environment:
            return environment_pdf_next_event(scene.environment, scene.light_guide.portals, receiver, direction);
    }
    return 0;
}

// Calls f(light_index, t, position, normal) for every lamp shape that the ray crosses before ray.t_max, at most once a
// lamp. Lamps neither block nor reflect.
template <typename F>
VLP_HD inline void for_each_lamp_hit(const SceneView& scene, const Ray& ray, F&& f) {
    for_each_lamp_near(scene.lamps, ray, [&](uint32_t index) {
        const Light& light = scene.lights[index];
        float t = 0;
        Vec3 normal = light.normal;
        const bool hit = light.kind == LightKind::area
                             ? area_intersect(light, ray, t)
                             : intersect_sphere_shape(light.position, light.radius, ray, t, normal);
        if (hit) f(index, t, ray.origin + t * ray.direction, normal);
    });
}

// Calls f(light_index) for every infinite light that an escaping ray in `direction` sees: the environment and the suns
// in whose disc it ends. What it sees of one is emitted(..., -direction).
template <typename F>
VLP_HD inline void for_each_infinite_light(const SceneView& scene, Vec3 direction, F&& f) {
    for (uint32_t i = 0; i < scene.infinite_light_count; ++i) {
        const uint32_t index = scene.infinite_lights[i];
        const Light& light = scene.lights[index];
        if (light.kind != LightKind::sun || sun_contains(light, -direction)) f(index);
    }
}

// The light of an emitting triangle or sphere that was hit; k_none if it does not emit.
VLP_HD inline uint32_t light_of_surface(const SceneView& scene, uint32_t instance, uint32_t primitive) {
    const uint32_t first = scene.instances[instance].first_emitter;
    return first == k_none ? k_none : scene.light_of_primitive[first + primitive];
}

}  // namespace vlp
