// Densities of a path's end on a light, in the measure that both walks and next event are compared in.
#pragma once

#include "geometry/surface.h"
#include "light/light.h"
#include "light/light_choice.h"

namespace vlp {

// The point y_0 of a light as seen from the next vertex x_1; `direction` is unit, from x_1 to the light.
// Densities are per area of the light, or per solid angle when it is infinite; a delta light's are probabilities.
struct LightEnd {
    float pdf_emission = 0;    // of the light walk starting here
    float pdf_next_event = 0;  // of next event from x_1 choosing it
    float pdf_next = 0;        // of the light walk going on to x_1, per area of x_1 but for its cosine there
};

// Whether x_1 lies on the light. Next event leaves such points to hits: a sphere sees itself from within alone, and rounding
// would decide whether a point of it is within.
VLP_HD inline bool is_on_light(const Light& light, const SurfacePoint& x_1) {
    return light.instance == x_1.instance && light.primitive == x_1.primitive;
}

// What next event from x_1 draws y_0 with: per solid angle, or the probability of a delta light.
VLP_HD inline float pdf_next_event_from(const SceneView& scene, uint32_t light_index, const SurfacePoint& x_1, Vec3 y_0,
                                        Vec3 normal, Vec3 direction) {
    const Light& light = scene.lights[light_index];
    const float choice = pdf_choose_light(scene, x_1, light_index);
    if (is_delta(light)) return choice;
    return is_on_light(light, x_1) ? 0.0f : choice * pdf_next_event(scene, light, x_1.position, y_0, normal, direction);
}

// `next_event`: what pdf_next_event_from gives. `dist_squared`, `y_0` and `normal` there are not looked at when the light is
// infinite.
VLP_HD inline LightEnd light_end(const SceneView& scene, uint32_t light_index, Vec3 x_1, Vec3 y_0, Vec3 normal,
                                 Vec3 direction, float dist_squared, float next_event) {
    const Light& light = scene.lights[light_index];
    const float choice = pdf_choose_source(scene, light_index);
    const bool infinite = is_infinite(light);
    const EmissionPdf emission = pdf_emission(scene, light, infinite ? x_1 : y_0, normal, -direction);
    if (infinite) return {choice * emission.direction, next_event, emission.position};
    const float per_area = is_delta(light) ? 1.0f : abs_dot(normal, direction) / dist_squared;
    return {choice * emission.position, next_event * per_area, emission.direction / dist_squared};
}

}  // namespace vlp
