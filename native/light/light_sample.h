// What lights give back: first rays of light paths, points for next event, and their densities.
#pragma once

#include "bvh/bvh_view.h"
#include "core/rgb.h"

namespace vlp {

// A light path's first ray. weight = radiance |cos at the light| / (pdf_position pdf_direction), without the cosine for
// infinite lights. The two densities are those of the draw, in which one may depend on the other's outcome: only their
// product is the density of the ray.
struct Emission {
    Vec3 position, normal, direction;
    Rgb weight;               // black: the ray carries nothing and its densities may be 0
    float pdf_position = 0;   // finite: per area of the light, 1 at a point; infinite: per area of the scene's disc
    float pdf_direction = 0;  // per solid angle; 1 for a delta direction
};

struct EmissionPdf {
    float position = 0, direction = 0;
};

// A point of a light for a receiver.
struct NextEvent {
    Vec3 position, normal;  // the normal looks toward the receiver
    Vec3 direction;         // from receiver to light
    float distance = 0;     // k_infinity: an infinite light
    Rgb radiance;           // delta lights: irradiance at a receiver that faces the light
    float pdf_solid_angle = 0;  // at the receiver; 1 for delta lights
    bool delta = false;
    PrimitiveId surface;  // the emitting primitive, none for lamps: a shadow ray must not stop at it

    // A point was drawn; and it sends light.
    VLP_HD bool drawn() const { return pdf_solid_angle > 0 && is_finite(pdf_solid_angle) && distance > 0; }
    VLP_HD bool valid() const { return drawn() && !is_black(radiance); }
};

// A density per area as one per solid angle, at a distance from a surface seen under a cosine; 0 edge on.
VLP_HD inline float to_solid_angle(float pdf_area, float distance_squared, float cosine) {
    return cosine > 0 ? pdf_area * distance_squared / cosine : 0.0f;
}

}  // namespace vlp
